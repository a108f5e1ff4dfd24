"""Ball neighbourhoods of all points, computed by products of small dense matrices.

Space is divided into cubes a little larger than the ball's radius. The points of one cube, at most
some tens, form a tile: all their neighbours are among the points of the 27 cubes around it. Tiles
of similar size form batches. Distances, masks and sums of a batch are a few matrix products each.
Batches are independent and run in parallel.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_aerial.geometry import Array
from drake_aerial.parallel import for_each

# Minimum and maximum number of points in a tile of a crowded cube.
_MIN_ROWS, _MAX_ROWS = 8, 32
# Cubes are enlarged until they hold this many points on average.
_MIN_SHARED = 3.0
# Pairs of point and candidate in a batch: limits its memory, and fits the cache.
_PAIRS = 200_000
# Side of a cube over the radius; below 1, neighbours would lie outside the 27 cubes.
_SIDE = 1.0 + 1e-6
# A squared distance beyond any radius; unlike infinity, it may be multiplied by zero.
_FAR = 1e100
# Maximum number of cubes along an axis, so that their numbers fit 64-bit integers.
_MAX_CUBES = 2**20


@dataclass(frozen=True, eq=False)
class Batch:
    """The neighbourhoods of some points: T tiles of up to m points, which share c candidates each.

    Attributes
    ----------
    rows : (T, m) int array
        The points, as indices in the cloud. Tiles of fewer than m repeat one.
    used : (T, m) bool array
        False for the repeated ones.
    candidates : (T, c) int array
        Points that may be neighbours. Tiles of fewer than c repeat one.
    p_row, p_candidate : (3, T, m) and (3, T, c) arrays
        Their positions from an origin near the tile [m], coordinate by coordinate.
    inside : (T, m, c) bool array
        Which candidates are a point's neighbours, itself included.
    """

    rows: NDArray[np.int64]
    used: NDArray[np.bool_]
    candidates: NDArray[np.int64]
    p_row: Array
    p_candidate: Array
    inside: NDArray[np.bool_]

    @property
    def points(self) -> NDArray[np.int64]:
        """The points, each once, as indices in the cloud, (M,)."""
        return self.rows[self.used]

    def sums(self, values: Array, inside: NDArray[np.bool_] | None = None) -> Array:
        """Return sums (M, D) of the candidates' values (D, T, c) over each point's neighbours.

        `inside` (T, m, c), if given, replaces the neighbours.
        """
        mask = (self.inside if inside is None else inside).astype(np.float64)
        return (mask @ values.transpose(1, 2, 0))[self.used]


class BallNeighbourhoods:
    """The neighbours within a radius of every point of a cloud.

    Parameters
    ----------
    points : (N, 3) array
        Points [m].
    radius : float
        Radius of the ball [m].
    """

    def __init__(self, points: Array, radius: float) -> None:
        self.points = points
        self.radius = radius
        extent = float(np.ptp(points, axis=0).max())
        side = max(_SIDE * radius, extent / _MAX_CUBES)
        first, number, size = self._cubes(side)
        while _shared(first, len(points)) < _MIN_SHARED and side < extent:
            side *= 2.0
            first, number, size = self._cubes(side)
        self._sorted = np.ascontiguousarray(points[self._order].T)
        bounds = np.append(first, len(points))
        # Three cubes in a row along z are one run of sorted points; there are nine runs.
        shift = ((np.arange(3)[:, None] - 1) * size[1] + np.arange(3) - 1).ravel() * size[2]
        begin = bounds[np.searchsorted(number, number[:, None] + shift - 1, "left")]
        end = bounds[np.searchsorted(number, number[:, None] + shift + 1, "right")]
        around = (end - begin).sum(axis=1)

        # Cubes with many points or many candidates are split into several tiles.
        count = np.diff(bounds)
        parts = -(-count // np.clip(_PAIRS // around, _MIN_ROWS, _MAX_ROWS))
        cube_of = np.repeat(np.arange(len(count)), parts)
        share = -(-count // parts)[cube_of]
        start = (
            first[cube_of]
            + (np.arange(len(cube_of)) - np.repeat(np.cumsum(parts) - parts, parts)) * share
        )
        stop = np.minimum(start + share, bounds[cube_of + 1])
        like = np.lexsort((start, stop - start, around[cube_of]))
        like = like[(stop > start)[like]]
        self._start, self._stop = start[like], stop[like]
        self._begin, self._end = begin[cube_of[like]], end[cube_of[like]]
        self._batches = self._batched(around[cube_of[like]])

    def _cubes(self, side: float) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Sort the points by cube; return the cubes' starts, numbers, and counts along the axes."""
        number, size = _cube_numbers(self.points, side)
        self._order = np.argsort(number, kind="stable")
        number = number[self._order]
        first = np.flatnonzero(np.append(True, np.diff(number) != 0))
        return first, number[first], size

    @staticmethod
    def _batched(around: NDArray[np.int64]) -> list[slice]:
        """Return slices of the tiles with about equal numbers of pairs."""
        batches, start = [], 0
        while start < len(around):
            stop = start + max(1, _PAIRS // (_MAX_ROWS * int(around[start])))
            batches.append(slice(start, min(stop, len(around))))
            start = stop
        return batches

    def for_each(self, function: Callable[[Batch], None]) -> None:
        """Call a function with every batch, in parallel; it may write to its own points only."""
        for_each(lambda tiles: function(self._batch(tiles)), self._batches)

    def _batch(self, tiles: slice) -> Batch:
        start, stop, begin, end = (
            self._start[tiles],
            self._stop[tiles],
            self._begin[tiles],
            self._end[tiles],
        )
        steps = np.arange((stop - start).max())
        used = steps < (stop - start)[:, None]
        rows = np.where(used, start[:, None] + steps, start[:, None])
        length = end - begin
        total = length.sum(axis=1)
        places = np.arange(total.max())
        real = places < total[:, None]
        # Candidate k of a tile is at the same offset in the run that contains k.
        jump = begin - (np.cumsum(length, axis=1) - length)
        candidates = np.repeat(start[:, None], len(places), axis=1)
        candidates[real] = (
            np.repeat(jump.ravel(), length.ravel()) + np.broadcast_to(places, real.shape)[real]
        )

        origin = self._sorted[:, start, None]
        p_row, p_candidate = self._sorted.take(rows, axis=1), self._sorted.take(candidates, axis=1)
        p_row -= origin
        p_candidate -= origin
        # |a - b|^2 as one product: [-2 a, |a|^2, 1] . [b, 1, |b|^2].
        left, right = np.empty((5, *rows.shape)), np.empty((5, *candidates.shape))
        np.multiply(p_row, -2.0, out=left[:3])
        left[3], left[4] = dot(p_row, p_row), 1.0
        right[:3], right[3] = p_candidate, 1.0
        right[4] = np.where(real, dot(p_candidate, p_candidate), _FAR)
        inside = left.transpose(1, 2, 0) @ right.transpose(1, 0, 2) <= self.radius**2
        return Batch(self._order[rows], used, self._order[candidates], p_row, p_candidate, inside)


def order_by_place(points: Array, side: float) -> NDArray[np.int64]:
    """Return an order (N,) of points (N, 3) by cubes of about `side` [m].

    In this order, neighbours are near each other in memory.
    """
    side = max(side, float(np.ptp(points, axis=0).max()) / _MAX_CUBES)
    return np.argsort(_cube_numbers(points, side)[0], kind="stable")


def _cube_numbers(points: Array, side: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return each point's cube number (N,), and the number of cubes along each axis (3,)."""
    # One empty cube on every side: a neighbouring cube's number is this one's plus a constant.
    cube = ((points - points.min(axis=0)) / side).astype(np.int64) + 1
    size = cube.max(axis=0) + 2
    return (cube[:, 0] * size[1] + cube[:, 1]) * size[2] + cube[:, 2], size


def dot(a: Array, b: Array) -> Array:
    """Return dot products (...) of vectors (3, ...); faster than a sum over the last axis."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _shared(first: NDArray[np.int64], count: int) -> float:
    """Return the number of points in the cube of a point, on average over points."""
    return float(np.sum(np.diff(np.append(first, count)) ** 2) / count)
