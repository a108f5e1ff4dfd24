"""A scene's cloud on a grid of pixels: the camera's own, or one laid over the cloud."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.geometry import Array
from drake_aerial.scene.depth_camera import DepthCamera


@dataclass(frozen=True, eq=False)
class SceneImage:
    """A cloud in its own frame S, and the pixel of each of its points.

    The image frame C has x right, y down and z away from the viewer. A cloud with a viewpoint is
    projected through it; one without (several views fused) is seen from above, in parallel.

    Attributes
    ----------
    cloud : PointCloud
        The scene's points, in S.
    index : (H, W) int array
        For each pixel the nearest of the cloud's points in it; -1 where there is none.
    pixel : (N, 2) int array
        Row and column of each point.
    points_C : (H, W, 3) array
        The pixels' points in the image frame [m]; NaN where there is none.
    R_SC : (3, 3) array
        Rotation of the image frame.
    viewpoint : (3,) array or None
        Position of the camera in S [m]; None for a parallel view from above.
    camera : DepthCamera or None
        Intrinsics, if the pixels are the camera's own.
    """

    cloud: PointCloud
    index: NDArray[np.int64]
    pixel: NDArray[np.int64]
    points_C: Array
    R_SC: Array
    viewpoint: Array | None
    camera: DepthCamera | None

    @classmethod
    def of_cloud(cls, cloud: PointCloud) -> SceneImage:
        """Return the image of a cloud.

        The pixels are the camera's own for a depth image or a cloud in a camera's axes; else a grid
        is laid over the cloud, seen from its viewpoint, or from above if it has none.
        """
        raise NotImplementedError

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.index.shape[0], self.index.shape[1]

    def on_pixels(self, values: NDArray, nothing: float) -> NDArray:
        """Return values (N, ...) of the points as an image (H, W, ...)."""
        image = values[self.index]
        image[self.index < 0] = nothing
        return image
