"""A depth camera's images as scans, in a diagram."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, LeafSystem
from pydrake.systems.sensors import ImageDepth32F

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.scene.depth_camera import DepthCamera
from drake_aerial.scene.depth_image import read_depth_image
from drake_aerial.scene.depth_noise import DepthNoise


class DepthScanner(LeafSystem):
    """Turn a depth image into a scan in the camera's frame C: x right, y down, z forward.

    | port | size | meaning |
    |---|---|---|
    | in `depth_image` | abstract | `ImageDepth32F` of an RgbdSensor [m] |
    | in `X_WC` | abstract | `RigidTransform`: the camera in the world, whose z is up |
    | out `scan` | abstract | `PointCloud` in C [m], with the world's up direction |

    The output is computed when it is evaluated. The noise depends on the seed and the time alone.

    Parameters
    ----------
    camera : DepthCamera or pydrake CameraInfo
        Intrinsics; see `DepthCamera.read`.
    noise : DepthNoise, optional
        Noise of the sensor; none by default.
    seed : int
        Random seed of the noise.
    """

    def __init__(self, camera: Any, noise: DepthNoise | None = None, seed: int = 0):
        super().__init__()
        self._camera, self._noise, self._seed = DepthCamera.read(camera), noise, seed
        self._image = self.DeclareAbstractInputPort(
            "depth_image", AbstractValue.Make(ImageDepth32F())
        )
        self._pose = self.DeclareAbstractInputPort("X_WC", AbstractValue.Make(RigidTransform()))
        self.DeclareAbstractOutputPort("scan", lambda: AbstractValue.Make(None), self._calc)

    def _calc(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self.scan(context))

    def scan(self, context: Context) -> PointCloud:
        """Return the scan of the present image.

        Raises
        ------
        InputError
            If the image has another size than the camera's, or no pixel has a depth.
        """
        image = np.array(self._image.Eval(context).data[..., 0], dtype=np.float64)
        # An RgbdSensor gives infinity beyond its range and 0 before it.
        image[~np.isfinite(image)] = 0.0
        if self._noise is not None:
            number = int(round(1e6 * context.get_time()))
            rng = np.random.default_rng([self._seed, number])
            image = self._noise.applied(image, rng, self._camera.fx)
        up_C = self._pose.Eval(context).rotation().matrix()[2]
        return read_depth_image(image.astype(np.float32), self._camera, up=up_C)
