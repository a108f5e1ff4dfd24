"""A scene: gravity, the supports, and the objects that stand on them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_aerial.cloud.boundary import Boundary
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.geometry import Array
from drake_aerial.scene.scene_image import SceneImage

NOTHING, SUPPORT, FIRST_OBJECT = 0, 1, 2
"""Labels: neither support nor object (background, walls, stray points); supports; objects."""


class GravitySource(StrEnum):
    """Where the direction of gravity comes from."""

    GIVEN = "given"
    IMU = "imu"
    SUPPORT = "support"


@dataclass(frozen=True, eq=False)
class Gravity:
    """The direction against gravity.

    Attributes
    ----------
    up : (3,) array
        Unit vector against gravity in S.
    source : GravitySource
        `given` (also: the cloud's axes are known to have z up), an IMU's, or the support's normal.
    uncertainty_deg : float
        Standard deviation of the direction [deg]; for a given direction 0.
    disagreement_deg : float or None
        Largest angle [deg] between `up` and a direction that was not used: the IMU's or the main
        support's normal; None if there is no other.
    warning : str or None
        One line if the disagreement is above 3 deg.
    """

    up: Array
    source: GravitySource
    uncertainty_deg: float
    disagreement_deg: float | None = None
    warning: str | None = None


@dataclass(frozen=True, eq=False)
class Support:
    """A plane that objects stand on: the points p with normal . p = offset.

    Attributes
    ----------
    normal : (3,) array
        Unit normal in S, on the side of the objects.
    offset : float
        Signed distance [m] from the origin of S.
    uncertainty_deg : float
        Standard deviation of the normal's direction [deg].
    indices : (M,) int array
        Its points in the scene's cloud.
    """

    normal: Array
    offset: float
    uncertainty_deg: float
    indices: NDArray[np.int64]

    def height(self, points: ArrayLike) -> Array:
        """Return the heights [m] of points (..., 3) above the plane."""
        return np.asarray(points, dtype=np.float64) @ self.normal - self.offset


@dataclass(frozen=True, eq=False)
class Box:
    """The upright box around an object: its sides are the least rectangle seen from above.

    Attributes
    ----------
    center : (3,) array
        Centre of the box in S [m].
    axes : (3, 3) array
        Columns are the unit vectors of length, width and height in S; the last is up.
    size : (3,) array
        Length, width (not longer) and height [m].
    """

    center: Array
    axes: Array
    size: Array


@dataclass(frozen=True, eq=False)
class SceneObject:
    """One object of a scene.

    Attributes
    ----------
    number : int
        Its label, 2 and up, from the largest image area to the smallest.
    indices : (M,) int array
        Its points in the scene's cloud.
    box : Box
        The upright box around its points.
    distance : float
        Distance [m] of its nearest point from the viewpoint; for a view from above, of its centre
        from the origin.
    boundary : Boundary
        Its outline in the image, and where that is seen, occluded or cut.
    touches_border : bool
        True if the image's border cuts the object.
    support : int or None
        Index of the support below it in the scene's supports.
    """

    number: int
    indices: NDArray[np.int64]
    box: Box
    distance: float
    boundary: Boundary
    touches_border: bool
    support: int | None


@dataclass(frozen=True, eq=False)
class Scene:
    """A cloud understood as supports and objects.

    Attributes
    ----------
    image : SceneImage
        The cloud and its pixels.
    gravity : Gravity
        Direction against gravity.
    supports : tuple of Support
        The planes that objects stand on, the one with the most points first; may be empty.
    objects : tuple of SceneObject
        The objects; `objects[k].number` is k + 2.
    labels : (N,) int array
        For each point of the cloud 0 (nothing), 1 (a support) or an object's number.
    """

    image: SceneImage
    gravity: Gravity
    supports: tuple[Support, ...]
    objects: tuple[SceneObject, ...]
    labels: NDArray[np.int64]

    @property
    def cloud(self) -> PointCloud:
        """The scene's whole cloud, in S."""
        return self.image.cloud

    @property
    def is_one_object(self) -> bool:
        """True if there is no support and the whole cloud is one object."""
        return not self.supports and len(self.objects) == 1

    def label_image(self) -> NDArray[np.int64]:
        """Return the labels of the pixels, (H, W)."""
        return self.image.on_pixels(self.labels, NOTHING)

    def object_of(self, number: int) -> SceneObject:
        """Return an object by its number.

        Raises
        ------
        InputError
            If there is no object of this number; the message lists the objects.
        """
        raise NotImplementedError

    def object_at_pixel(self, u: float, v: float) -> SceneObject:
        """Return the object at column `u` and row `v` of the image.

        Raises
        ------
        InputError
            If the pixel is outside the image, or shows the support or nothing.
        """
        raise NotImplementedError

    def object_at(self, point: ArrayLike) -> SceneObject:
        """Return the object nearest to a point (3,) [m] of S.

        Raises
        ------
        InputError
            If no object is within 5 cm of the point.
        """
        raise NotImplementedError

    def cloud_of(self, number: int) -> PointCloud:
        """Return the points of an object as a cloud in S, with gravity, viewpoint and boundary.

        For `is_one_object`, that is the scene's own cloud.

        Raises
        ------
        InputError
            If there is no object of this number.
        """
        found = self.object_of(number)
        return replace(
            self.cloud,
            points=self.cloud.points[found.indices],
            up=self.gravity.up,
            up_is_known=True,
            boundary=found.boundary,
        )

    def to_record(self) -> dict[str, Any]:
        """Return gravity, supports and objects for result files; lengths in m, angles in deg."""
        raise NotImplementedError

    def summary(self) -> str:
        """Return the scene in lines: gravity, then one line for each support and object."""
        raise NotImplementedError
