"""Solids for the generated shapes: unions of convex parts, their surface samples and top points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import trimesh
from scipy.spatial import ConvexHull

# Points closer than this to a part's surface are not inside it [m].
_SKIN = 1e-4
_RING = 40


@dataclass(frozen=True, eq=False)
class Part:
    """A convex solid: the hull of `points` (N, 3) [m]."""

    points: np.ndarray

    @cached_property
    def hull(self) -> ConvexHull:
        """The convex hull of the points."""
        return ConvexHull(self.points)

    def inside(self, points: np.ndarray) -> np.ndarray:
        """Return whether points (N, 3) are strictly inside, by more than a skin of 0.1 mm."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        near = np.flatnonzero(np.all((points > low) & (points < high), axis=1))
        mask = np.zeros(len(points), bool)
        if len(near):
            planes = np.unique(np.round(self.hull.equations, 9), axis=0)
            level = points[near] @ planes[:, :3].T + planes[:, 3]
            mask[near] = np.all(level < -_SKIN, axis=1)
        return mask

    def top(self, xy: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the height [m] of the upper surface at xy (2,), or -inf, and its normal (3,)."""
        planes = self.hull.equations
        level = -(planes[:, :2] @ xy + planes[:, 3])
        up, down = planes[:, 2] > 1e-9, planes[:, 2] < -1e-9
        wall = ~(up | down)
        height = level[up] / planes[up, 2]
        least = np.max(level[down] / planes[down, 2])
        if np.any(level[wall] < 0.0) or height.min() < least:
            return -np.inf, np.array([0.0, 0.0, 1.0])
        return float(height.min()), planes[up][np.argmin(height), :3]


def block(x: tuple, y: tuple, z: tuple) -> Part:
    """Return the box between two coordinates along each axis [m]."""
    return Part(np.array([[a, b, c] for a in x for b in y for c in z], float))


def centred(size: tuple, at: tuple = (0.0, 0.0, 0.0)) -> Part:
    """Return a box of a size whose bottom has its centre at a point [m]."""
    (sx, sy, sz), (x, y, z) = size, at
    return block((x - sx / 2, x + sx / 2), (y - sy / 2, y + sy / 2), (z, z + sz))


def frustum(radii: tuple, at: tuple, height: float, axis: int = 2, count: int = 48) -> Part:
    """Return a cone's frustum from its base centre along an axis; equal radii make a cylinder."""
    angle = 2.0 * np.pi * np.arange(count) / count
    circle = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)])
    points = np.vstack([radii[0] * circle, radii[1] * circle + [0.0, 0.0, height]])
    return Part(np.roll(points, axis + 1, axis=1) + np.asarray(at, float))


def bent_bar(path: np.ndarray, section: tuple, across: tuple = (0.0, 1.0, 0.0)) -> list[Part]:
    """Return the segments of a bar along a path (K, 3) in the plane normal to `across`.

    `section` has the bar's half width along `across` and in the plane [m]. The section is an
    ellipse where both are equal, else a rectangle.
    """
    across = np.asarray(across, float)
    if section[0] == section[1]:
        angle = 2.0 * np.pi * np.arange(16) / 16
        outline = np.column_stack([np.cos(angle), np.sin(angle)])
    else:
        outline = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    parts = []
    for a, b in pairwise(path):
        along = (b - a) / np.linalg.norm(b - a)
        side = np.cross(along, across)
        ring = section[0] * outline[:, :1] * across + section[1] * outline[:, 1:] * side
        # Segments overlap, so that no end face stays inside the bar.
        reach = 0.3 * section[1] * along
        parts.append(Part(np.vstack([ring + a - reach, ring + b + reach])))
    return parts


def arc(centre: tuple, radii: tuple, degrees: tuple, count: int = 14) -> np.ndarray:
    """Return points (count + 1, 3) on an ellipse in the vertical plane y = centre[1]."""
    angle = np.deg2rad(np.linspace(*degrees, count + 1))
    points = np.column_stack(
        [radii[0] * np.cos(angle), np.zeros(count + 1), radii[1] * np.sin(angle)]
    )
    return np.asarray(centre, float) + points


def ring_wall(radius: float, thickness: float, z: tuple, count: int = 28) -> list[Part]:
    """Return the segments of an upright pipe's wall around the z axis."""
    parts = []
    for k in range(count):
        angle = 2.0 * np.pi * (k + np.array([-0.05, 1.05])) / count
        edge = np.column_stack([np.cos(angle), np.sin(angle)])
        flat = np.vstack([radius * edge, (radius - thickness) * edge])
        parts.append(Part(np.vstack([np.column_stack([flat, np.full(4, h)]) for h in z])))
    return parts


@dataclass(frozen=True, eq=False)
class Shape:
    """One object: parts, and its sites.

    A site is the set (M, 2) of equivalent places, seen from above [m]; each stands for the topmost
    point there.
    """

    parts: list[Part]
    sites: dict[str, np.ndarray]

    @cached_property
    def corners(self) -> np.ndarray:
        """All corners (N, 3) of the parts [m]."""
        return np.vstack([part.points for part in self.parts])

    @property
    def size(self) -> float:
        """Largest extent along the shape's own axes [m]."""
        return float(np.ptp(self.corners, axis=0).max())

    @cached_property
    def mesh(self) -> trimesh.Trimesh:
        """The parts' surfaces as one mesh, hidden faces included."""
        return trimesh.util.concatenate(
            [trimesh.Trimesh(part.points, part.hull.simplices) for part in self.parts]
        )

    @cached_property
    def area(self) -> float:
        """Surface of all parts, hidden faces included [m^2]."""
        return float(sum(part.hull.area for part in self.parts))

    def places(self, site: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the places (M, 3) [m] of a site and the surface's normals (M, 3) there."""
        found = []
        for xy in np.atleast_2d(self.sites[site]):
            found.append(max((part.top(xy) for part in self.parts), key=lambda top: top[0]))
            if not np.isfinite(found[-1][0]):
                raise ValueError(f"site {site!r} at {xy} is beside the shape")
        z, normal = (np.array(column) for column in zip(*found, strict=True))
        return np.column_stack([np.atleast_2d(self.sites[site]), z]), normal

    def sample(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return about `count` points (N, 3), uniform over the union's surface [m]."""
        triangles = np.vstack([part.points[part.hull.simplices] for part in self.parts])
        owner = np.repeat(np.arange(len(self.parts)), [len(p.hull.simplices) for p in self.parts])
        area = 0.5 * np.linalg.norm(
            np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
        )
        points = np.empty((0, 3))
        while len(points) < count:
            chosen = rng.choice(len(area), count, p=area / area.sum())
            u = np.sqrt(rng.random((count, 1)))
            v = rng.random((count, 1))
            a, b, c = triangles[chosen].transpose(1, 0, 2)
            drawn = (1 - u) * a + u * (1 - v) * b + u * v * c
            hidden = np.zeros(count, bool)
            for k, part in enumerate(self.parts):
                hidden |= part.inside(drawn) & (owner[chosen] != k)
            points = np.vstack([points, drawn[~hidden]])
        return points[:count]
