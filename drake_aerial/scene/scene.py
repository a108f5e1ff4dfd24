"""A scene: gravity, the supports, and the objects that stand on them.

Longer than 300 lines, since it documents every value of a scene.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_aerial.cloud.boundary import Boundary, BoundaryKind
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.scene.scene_image import SceneImage

NOTHING, SUPPORT, FIRST_OBJECT = 0, 1, 2
"""Labels: neither support nor object (background, walls, stray points); supports; objects."""
# A point names the object at most this far away [m].
_NEAR = 0.05


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
    """Upright box around an object; its footprint is the smallest rectangle seen from above.

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

    def to_record(self) -> dict[str, Any]:
        """Return box, distance and seen shares for result files; lengths in m."""
        return {
            "number": self.number,
            "points": len(self.indices),
            "box": {
                "center": self.box.center.tolist(),
                "axes": self.box.axes.tolist(),
                "size": self.box.size.tolist(),
            },
            "distance": self.distance,
            "outline": {kind.name.lower(): self.boundary.share(kind) for kind in BoundaryKind},
            "touches_border": self.touches_border,
            "support": self.support,
        }

    def summary(self) -> str:
        """Return one line: size, distance, points and how much of the outline is seen."""
        length, width, height = 100.0 * self.box.size
        line = (
            f"object {self.number}: {length:.1f} x {width:.1f} x {height:.1f} cm, "
            f"{self.distance:.2f} m away, {len(self.indices)} points"
        )
        if len(self.boundary):
            shares = [
                f"{100.0 * self.boundary.share(k):.0f} % {k.name.lower()}" for k in BoundaryKind
            ]
            line += f"; outline {', '.join(shares)}"
        return line + ("; cut by the image's border" if self.touches_border else "")


@dataclass(frozen=True, eq=False)
class Scene:
    """A cloud segmented into supports and objects.

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

    Examples
    --------
    >>> import numpy as np
    >>> from drake_aerial import PointCloud, find_scene
    >>> rng = np.random.default_rng(0)
    >>> floor = rng.uniform(-1.0, 1.0, (40000, 3)) * [1.0, 1.0, 0.0]
    >>> top = rng.uniform(-0.2, 0.2, (3000, 3)) * [1.0, 1.0, 0.0] + [0.0, 0.0, 0.3]
    >>> scene = find_scene(PointCloud.read(np.vstack([floor, top])))
    >>> len(scene.supports), [found.number for found in scene.objects]
    (1, [2])
    >>> len(scene.cloud_of(2)) > 2500, scene.object_at([0.0, 0.0, 0.3]).number
    (True, 2)
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
        for found in self.objects:
            if found.number == number:
                return found
        numbers = ", ".join(str(found.number) for found in self.objects)
        raise InputError(f"there is no object {number}; the scene has the objects {numbers}")

    def object_at_pixel(self, u: float, v: float) -> SceneObject:
        """Return the object at column `u` and row `v` of the image.

        Raises
        ------
        InputError
            If the pixel is outside the image, or shows the support or nothing.
        """
        height, width = self.image.shape
        row, column = round(v), round(u)
        if not (0 <= row < height and 0 <= column < width):
            raise InputError(f"pixel {u:g} {v:g} is outside the image of {width} x {height} pixels")
        index = int(self.image.index[row, column])
        label = NOTHING if index < 0 else int(self.labels[index])
        if label < FIRST_OBJECT:
            shown = "the support" if label == SUPPORT else "no object"
            raise InputError(f"pixel {u:g} {v:g} shows {shown}; give a pixel on the object")
        return self.object_of(label)

    def object_at(self, point: ArrayLike) -> SceneObject:
        """Return the object nearest to a point (3,) [m] of S.

        Raises
        ------
        InputError
            If no object is within 5 cm of the point.
        """
        place = np.asarray(point, dtype=np.float64)
        if place.shape != (3,) or not np.isfinite(place).all():
            raise InputError(f"the point must be three finite numbers, got {point!r}")
        on_objects = np.flatnonzero(self.labels >= FIRST_OBJECT)
        distance = np.linalg.norm(self.cloud.points[on_objects] - place, axis=1)
        nearest = int(np.argmin(distance))
        if distance[nearest] > _NEAR:
            raise InputError(
                f"no object is at {place.round(3).tolist()}: the nearest is "
                f"{distance[nearest]:.3f} m away; give a point on the object, in the scan's axes"
            )
        return self.object_of(int(self.labels[on_objects[nearest]]))

    def cloud_of(self, number: int) -> PointCloud:
        """Return the points of an object as a cloud in S, with gravity, viewpoint and boundary.

        For `is_one_object`, that is the scene's own cloud.

        Raises
        ------
        InputError
            If there is no object of this number.
        """
        found = self.object_of(number)
        if self.is_one_object:
            return self.cloud
        return replace(
            self.cloud,
            points=self.cloud.points[found.indices],
            up=self.gravity.up,
            up_is_known=True,
            boundary=found.boundary,
        )

    def to_record(self) -> dict[str, Any]:
        """Return gravity, supports and objects for result files; lengths in m, angles in deg."""
        gravity = self.gravity
        record: dict[str, Any] = {
            "gravity": {
                "up": gravity.up.tolist(),
                "source": str(gravity.source),
                "uncertainty_deg": gravity.uncertainty_deg,
            },
            "supports": [
                {
                    "normal": support.normal.tolist(),
                    "offset": support.offset,
                    "uncertainty_deg": support.uncertainty_deg,
                    "points": len(support.indices),
                }
                for support in self.supports
            ],
            "objects": [found.to_record() for found in self.objects],
        }
        if gravity.disagreement_deg is not None:
            record["gravity"]["disagreement_deg"] = gravity.disagreement_deg
        if gravity.warning is not None:
            record["gravity"]["warning"] = gravity.warning
        return record

    def summary(self) -> str:
        """Return the scene in lines: gravity, then one line for each support and object."""
        gravity = self.gravity
        lines = [
            f"gravity: up {_numbers(gravity.up)}, {_SOURCES[gravity.source]}, "
            f"uncertainty {gravity.uncertainty_deg:.1f} deg"
        ]
        if gravity.warning is not None:
            lines.append(f"warning: {gravity.warning}")
        lines += [
            f"support: {len(support.indices)} points, normal {_numbers(support.normal)}"
            for support in self.supports
        ]
        return "\n".join([*lines, *(found.summary() for found in self.objects)])


_SOURCES = {
    GravitySource.GIVEN: "as given",
    GravitySource.IMU: "from the IMU",
    GravitySource.SUPPORT: "from the support's normal",
}


def _numbers(vector: Array) -> str:
    return " ".join(f"{value:.3f}" for value in vector)
