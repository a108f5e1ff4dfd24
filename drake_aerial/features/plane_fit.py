"""Plane fits to the neighbours of each point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from drake_aerial.features.neighbourhoods import BallNeighbourhoods, Batch
from drake_aerial.geometry import Array

_UPPER = np.triu_indices(3)


def fit_planes(
    points: Array, radius: float, min_neighbours: int
) -> tuple[BallNeighbourhoods, Array, NDArray[np.int64]] | None:
    """Fit planes to ball neighbourhoods, without the points that have too few neighbours.

    Parameters
    ----------
    points : (N, 3) array
        Points [m].
    radius : float
        Radius of the ball [m].
    min_neighbours : int
        Minimum number of points in a ball, its centre included.

    Returns
    -------
    balls : BallNeighbourhoods
        Neighbourhoods of the M points that are kept, in the given order.
    normals : (M, 3) array
        Unit normals of arbitrary sign: the directions of least spread.
    kept : (M,) int array
        Indices of the kept points.

    None if no points are kept.
    """
    balls = BallNeighbourhoods(points, radius)
    normals, count = _planes(balls)
    kept = np.arange(len(points))
    if count.min() >= min_neighbours:
        return balls, normals, kept
    # Removing points may leave others near them with too few neighbours.
    while count.min(initial=min_neighbours) < min_neighbours:
        enough = count >= min_neighbours
        left_out, points, count, kept = (
            cKDTree(points[~enough]),
            points[enough],
            count[enough],
            kept[enough],
        )
        count = count - left_out.query_ball_point(points, radius, return_length=True)
    if len(points) == 0:
        return None
    balls = BallNeighbourhoods(points, radius)
    return balls, _planes(balls)[0], kept


def _planes(balls: BallNeighbourhoods) -> tuple[Array, NDArray[np.int64]]:
    """Return a normal (N, 3) and the number of neighbours (N,) per point."""
    normals = np.empty_like(balls.points)
    count = np.empty(len(balls.points), dtype=np.int64)

    def fit(batch: Batch) -> None:
        p = batch.p_candidate
        values = np.empty((10, *p.shape[1:]))
        values[0], values[1:4] = 1.0, p
        for k, (i, j) in enumerate(zip(*_UPPER, strict=True)):
            np.multiply(p[i], p[j], out=values[4 + k])
        sums = batch.sums(values)
        mean = sums[:, 1:] / sums[:, :1]
        covariance = np.empty((len(sums), 3, 3))
        covariance[:, _UPPER[0], _UPPER[1]] = mean[:, 3:] - mean[:, _UPPER[0]] * mean[:, _UPPER[1]]
        covariance[:, _UPPER[1], _UPPER[0]] = covariance[:, _UPPER[0], _UPPER[1]]
        normals[batch.points] = np.linalg.eigh(covariance)[1][:, :, 0]
        count[batch.points] = sums[:, 0]

    balls.for_each(fit)
    return normals, count
