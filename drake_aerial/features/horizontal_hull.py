"""The horizontal hull of a cloud, which normalises positions (docs/method.md)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array


@dataclass(frozen=True, eq=False)
class HorizontalHull:
    """The convex hull of a cloud's projection along gravity, in a frame with z up.

    Attributes
    ----------
    vertices : (V, 2) array
        Corners, counter-clockwise [m].
    """

    vertices: Array

    @classmethod
    def of_points(cls, points: ArrayLike) -> HorizontalHull:
        """Return the hull of the x and y of points (N, 2) or (N, 3) [m].

        Raises
        ------
        InputError
            If the projection has no area.
        """
        from scipy.spatial import ConvexHull, QhullError

        xy = np.asarray(points, float)[:, :2]
        try:
            hull = ConvexHull(xy)
        except (QhullError, ValueError) as error:
            raise InputError(
                f"the {len(xy)} points of the cloud lie on a line when seen from above; "
                "check `up`, or give a scan with a horizontal extent"
            ) from error
        return cls(xy[hull.vertices])

    @property
    def area(self) -> float:
        """Area [m^2]."""
        x, y = self.vertices.T
        return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))

    @property
    def centroid(self) -> Array:
        """Area centroid m, shape (2,) [m]."""
        # Relative to a vertex, for precision far from the origin.
        v = self.vertices - self.vertices[0]
        w = np.roll(v, -1, axis=0)
        twice = v[:, 0] * w[:, 1] - w[:, 0] * v[:, 1]
        return self.vertices[0] + ((v + w) * twice[:, None]).sum(axis=0) / (3.0 * twice.sum())

    def support(self, direction: ArrayLike) -> Array:
        """Return h(t) = max of t . (x - m) over the hull [m], for unit directions t (..., 2)."""
        offset = self.vertices - self.centroid
        return np.max(np.asarray(direction, float) @ offset.T, axis=-1)

    def width(self, direction: ArrayLike) -> Array:
        """Return W(e) = h(e) + h(-e) [m], shape (...), for unit directions e (..., 2)."""
        across = np.asarray(direction, float) @ (self.vertices - self.vertices[0]).T
        return across.max(axis=-1) - across.min(axis=-1)

    def contains(self, points: ArrayLike, margin: float = 0.0) -> np.ndarray:
        """Return whether points (..., 2) are inside the hull, grown by `margin` [m]."""
        edge = np.roll(self.vertices, -1, axis=0) - self.vertices
        outward = np.column_stack([edge[:, 1], -edge[:, 0]]) / np.linalg.norm(
            edge, axis=1, keepdims=True
        )
        level = np.sum(outward * self.vertices, axis=1) + margin
        return np.all(np.asarray(points, float) @ outward.T <= level, axis=-1)
