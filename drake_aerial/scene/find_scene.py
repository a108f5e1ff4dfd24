"""Find gravity, supports and objects in a scene's cloud."""

from __future__ import annotations

from numpy.typing import ArrayLike

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.scene.parameters import SceneParameters
from drake_aerial.scene.scene import Scene
from drake_aerial.scene.scene_image import SceneImage


def find_scene(
    source: PointCloud | SceneImage,
    *,
    up: ArrayLike | None = None,
    imu: ArrayLike | None = None,
    parameters: SceneParameters | None = None,
) -> Scene:
    """Return the gravity, supports and objects of a cloud.

    The answer is deterministic and turns with the cloud.

    Parameters
    ----------
    source : PointCloud or SceneImage
        A depth image's cloud (`read_depth_image`), a cloud with a viewpoint, or one of fused views.
    up : (3,) array, optional
        Direction against gravity in S; by default the cloud's own where it is known.
    imu : (3,) array, optional
        Specific force of an accelerometer at rest in S, which points up; any length.
    parameters : SceneParameters, optional

    Raises
    ------
    InputError
        If the cloud holds only a plane, nothing stands on the support, or no object is seen.
    """
    raise NotImplementedError
