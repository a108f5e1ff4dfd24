"""The smallest upright box around an object, and the maps between two such boxes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.geometry import Array, Pose, quat_about_axis, quat_multiply, rotate

# Smallest half side, so that a flat object has box coordinates too [m].
_MIN_HALF = 1e-4
_Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class UprightBox:
    """The upright box around points whose footprint is the rectangle of the least area.

    Attributes
    ----------
    centre : (3,) array
        Centre [m].
    half : (3,) array
        Half sides [m]: the longer horizontal one, the shorter one, the vertical one.
    yaw : float
        Yaw of the longer horizontal side [rad].
    """

    centre: Array
    half: Array
    yaw: float

    @classmethod
    def of_points(cls, points: ArrayLike, hull: HorizontalHull) -> UprightBox:
        """Return the box of points (N, 3) [m] with the given hull, in a frame whose z is up."""
        edge = np.roll(hull.vertices, -1, axis=0) - hull.vertices
        yaws = np.arctan2(edge[:, 1], edge[:, 0])
        along = np.column_stack([np.cos(yaws), np.sin(yaws)])
        across = np.column_stack([-np.sin(yaws), np.cos(yaws)])
        sides = np.column_stack([hull.width(along), hull.width(across)])
        best = int(np.argmin(sides[:, 0] * sides[:, 1]))
        axes = np.stack([along[best], across[best]])
        reach = hull.vertices @ axes.T
        height = np.asarray(points, float)[:, 2]
        lower, upper = np.append(reach.min(0), height.min()), np.append(reach.max(0), height.max())
        middle, half = 0.5 * (lower + upper), np.maximum(0.5 * (upper - lower), _MIN_HALF)
        centre, yaw = np.append(middle[:2] @ axes, middle[2]), float(yaws[best])
        if half[1] > half[0]:
            half, yaw = half[[1, 0, 2]], yaw + 0.5 * np.pi
        return cls(centre, half, yaw)

    @property
    def size(self) -> float:
        """The longest side [m]."""
        return float(2.0 * self.half.max())

    def coordinates(self, p: ArrayLike) -> Array:
        """Return box coordinates (..., 3) of points p (..., 3) [m]: -1 to 1 inside the box."""
        back = quat_about_axis(_Z, -self.yaw)
        return rotate(back, np.asarray(p, float) - self.centre) / self.half

    def points(self, coordinates: ArrayLike) -> Array:
        """Return the points (..., 3) [m] with box coordinates (..., 3)."""
        return self.centre + rotate(
            quat_about_axis(_Z, self.yaw), np.asarray(coordinates, float) * self.half
        )


@dataclass(frozen=True, eq=False)
class BoxMap:
    """The affine map that carries one upright box into another, after quarter turns.

    Attributes
    ----------
    source, target : UprightBox
        The boxes.
    quarter_turns : int
        Number of quarter turns about the vertical, 0 to 3.
    """

    source: UprightBox
    target: UprightBox
    quarter_turns: int

    @property
    def yaw(self) -> float:
        """Yaw between the boxes, quarter turns included [rad]."""
        return self.target.yaw - self.source.yaw + 0.5 * np.pi * self.quarter_turns

    def points(self, p: ArrayLike) -> Array:
        """Return where points p (..., 3) of the source [m] are carried."""
        turn = quat_about_axis(_Z, 0.5 * np.pi * self.quarter_turns)
        return self.target.points(rotate(turn, self.source.coordinates(p)))

    def poses(self, X: Pose) -> Pose:
        """Return poses X (...) with carried positions, turned about the vertical as the box is."""
        return Pose(self.points(X.p), quat_multiply(quat_about_axis(_Z, self.yaw), X.q))
