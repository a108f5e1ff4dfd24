"""The outline of an object whose boundary in the image is known: seen, hidden or cut."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_aerial.cloud.boundary import Boundary, BoundaryKind
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array

# Depth of the band along the outline in which its nature is counted, in radii of the features'
# neighbourhood.
_BAND = 0.5
# Distance between points of the perimeter, and half width of the strip behind each [m].
_STEP, _CELL = 0.005, 0.01
# Cosine above which a surface shows that the object ends in a direction.
_MIN_COSINE = 0.9
# Number of hidden points per seen point in the band from which on a direction is hidden.
_MIN_HIDDEN = 1.5
# Distance from a hidden boundary point, in radii, within which a rim is not the object's own.
_RIM_REACH = 0.8
# Largest angle between the normals of straight sides, and of round ones, that are continued until
# they meet [deg].
_MAX_CORNER, _MAX_ROUND = 125.0, 90.0
# Range of directions in which a straight side is looked for beside a hidden corner [deg], and how
# much longer than the outline beside the corner it must be.
_SIDE_RANGE, _SIDE_LENGTH = 60, 3.0


@dataclass(frozen=True, eq=False)
class KnownOutline:
    """The outline of an object seen from above, as far as it is known.

    Attributes
    ----------
    open : (D,) bool array
        Whether the object may go on in each of D equally spaced directions, the first along x.
    hull : HorizontalHull
        The hull, with hidden corners completed: the seen sides are continued until they meet.
    hidden : (N,) bool array
        Whether the boundary of the view, not the object, made each feature a rim.
    cut : bool
        Whether the image's border, not another thing, hides most of what is open.
    """

    open: np.ndarray
    hull: HorizontalHull
    hidden: np.ndarray
    cut: bool

    @classmethod
    def find(
        cls, features: SurfaceFeatures, hull: HorizontalHull, boundary: Boundary, directions: int
    ) -> KnownOutline:
        """Find the outline of an object.

        Parameters
        ----------
        features : SurfaceFeatures
            Features of the object, in a frame whose z is up.
        hull : HorizontalHull
            Their hull.
        boundary : Boundary
            The object's boundary in the view, in the same frame.
        directions : int
            Number D of directions.
        """
        rims = _hidden_rims(features, boundary)
        angle = 2.0 * np.pi * np.arange(directions) / directions
        perimeter = _Perimeter.of(features, hull, boundary)
        counts = [perimeter.counts(_unit(a), _BAND * features.rho) for a in angle]
        unknown = np.array([a >= 2 and a > _MIN_HIDDEN * b for a, b in counts])
        is_open = np.zeros(directions, bool)
        corners = []
        for run in _runs(unknown):
            corner = _corner(perimeter, hull, 0.5 * _BAND * features.rho, angle, run)
            if corner is None:
                is_open[run] = True
            else:
                corners.append(corner)
        if corners:
            hull = HorizontalHull.of_points(np.vstack([hull.vertices, *corners]))
        hidden = boundary.kind != BoundaryKind.SEEN
        t = np.column_stack([np.cos(angle), np.sin(angle)])[is_open].sum(axis=0)
        outer = hidden & (boundary.points[:, :2] @ t > hull.centroid @ t)
        cut = 2 * np.count_nonzero(boundary.kind[outer] == BoundaryKind.CUT) > outer.sum()
        return cls(is_open, hull, rims, bool(cut))


def _hidden_rims(features: SurfaceFeatures, boundary: Boundary) -> np.ndarray:
    """Return which features are rims, and nearer to a hidden boundary point than to a seen one."""
    from scipy.spatial import cKDTree

    seen = boundary.kind == BoundaryKind.SEEN
    if seen.all():
        return np.zeros(len(features), bool)
    to_hidden, _ = cKDTree(boundary.points[~seen]).query(features.p)
    to_seen = np.full(len(features), np.inf)
    if seen.any():
        to_seen, _ = cKDTree(boundary.points[seen]).query(features.p)
    return features.rim & (to_hidden < _RIM_REACH * features.rho) & (to_hidden < to_seen)


@dataclass(frozen=True, eq=False)
class _Perimeter:
    """Points along a hull, (K, 2), and which of them are hidden, (K,)."""

    points: Array
    hidden: np.ndarray

    @classmethod
    def of(cls, features: SurfaceFeatures, hull: HorizontalHull, boundary: Boundary) -> _Perimeter:
        """Return the perimeter of a hull, each point judged by what ends the view behind it."""
        from scipy.spatial import cKDTree

        start, end = hull.vertices, np.roll(hull.vertices, -1, axis=0)
        length = np.linalg.norm(end - start, axis=1)
        counts = np.maximum(np.ceil(length / _STEP).astype(int), 1)
        side = np.repeat(np.arange(len(start)), counts)
        share = (np.concatenate([np.arange(n) for n in counts]) + 0.5) / counts[side]
        points = start[side] + share[:, None] * (end - start)[side]
        along = ((end - start) / length[:, None])[side]
        outward = np.column_stack([along[:, 1], -along[:, 0]])
        hidden = np.zeros(len(points), bool)
        for k in range(len(points)):
            offset = boundary.points[:, :2] - points[k]
            beside = np.flatnonzero(np.abs(offset @ along[k]) < _CELL)
            if len(beside):
                depth = offset[beside] @ outward[k]
                outer = beside[depth > depth.max() - _CELL]
                hidden[k] = np.mean(boundary.kind[outer] != BoundaryKind.SEEN) > 0.5
        # A face that looks outward shows the object's end, whatever hides its lower part.
        faces = ~features.rim & (np.linalg.norm(features.normal[:, :2], axis=1) > _MIN_COSINE)
        if faces.any():
            tree = cKDTree(features.p[faces, :2])
            for k, near in enumerate(tree.query_ball_point(points, 2.0 * _CELL)):
                facing = features.normal[faces][near, :2] @ outward[k] > _MIN_COSINE
                hidden[k] &= not facing.any()
        return cls(points, hidden)

    def counts(self, t: Array, depth: float) -> tuple[int, int]:
        """Return the numbers of hidden and of seen points within a depth [m] of the end along t."""
        along = self.points @ t
        band = along > along.max() - depth
        return int((band & self.hidden).sum()), int((band & ~self.hidden).sum())


def _runs(flags: np.ndarray) -> list[np.ndarray]:
    """Return the indices of each run of set flags on a circle, in order."""
    if flags.all():
        return [np.arange(len(flags))]
    first = int(np.argmin(flags))
    index = (first + np.arange(len(flags))) % len(flags)
    change = np.flatnonzero(np.diff(flags[index].astype(int), prepend=0, append=0))
    return [index[a:b] for a, b in change.reshape(-1, 2)]


def _corner(
    perimeter: _Perimeter, hull: HorizontalHull, depth: float, angle: Array, run: np.ndarray
) -> Array | None:
    """Return the point (2,) where the sides beside a hidden corner meet; None if they do not.

    The corner is hidden in the directions `angle[run]`.
    """
    sides, straight = [], True
    for edge, sense in ((angle[run[0] - 1], -1.0), (angle[(run[-1] + 1) % len(angle)], 1.0)):
        angles = edge + sense * np.deg2rad(np.arange(_SIDE_RANGE + 1))
        lengths = [perimeter.counts(_unit(a), depth)[1] for a in angles]
        best = int(np.argmax(lengths))
        longest = lengths[best] > _SIDE_LENGTH * lengths[0]
        sides.append(angles[best if longest else 0])
        straight &= longest
    between = np.rad2deg((sides[1] - sides[0]) % (2.0 * np.pi))
    if not 20.0 < between < (_MAX_CORNER if straight else _MAX_ROUND):
        return None
    T = np.array([_unit(side) for side in sides])
    corner = np.linalg.solve(T, np.max(hull.vertices @ T.T, axis=0))
    size = np.ptp(hull.vertices, axis=0).max()
    return corner if np.linalg.norm(corner - hull.centroid) < size else None


def _unit(angle: float) -> Array:
    return np.array([np.cos(angle), np.sin(angle)])
