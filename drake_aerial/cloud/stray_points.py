"""Find stray points: invalid pixels of depth cameras, and points far from the rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from drake_aerial.geometry import Array

# Clouds of fewer points are not searched for stray points.
_MIN_POINTS = 200
# Points and neighbours from which the typical spacing is estimated.
_SAMPLE, _NEIGHBOURS = 1000, 8
# A gap is stray if it is wider than this multiple of the spacing and this fraction of the extent.
_GAP_SPACINGS, _GAP_EXTENT = 5.0, 0.1
# A separate group of points is stray up to this fraction of the cloud.
_GROUP = 0.01
_MAX_CUBES = 2**20


def stray_points(points: Array) -> NDArray[np.bool_]:
    """Return a mask (N,) that is True for the stray points in `points` (N, 3).

    Groups of points are separated by gaps of at least 10 % of the cloud's extent. Stray groups are
    those of at most 1 % of the points, and those whose points are all equal, as depth cameras
    give them for invalid pixels.
    """
    none = np.zeros(len(points), dtype=bool)
    if len(points) < _MIN_POINTS:
        return none
    group = _groups(points, _gap(points))
    if group is None:
        return none
    size = np.bincount(group)
    stray = size <= _GROUP * len(points)
    for k in np.flatnonzero(~stray):
        stray[k] = not np.ptp(points[group == k], axis=0).any()
    return none if stray.all() else stray[group]


def _gap(points: Array) -> float:
    """Return the smallest gap [m] between groups; 0 if the cloud has no typical spacing."""
    distinct = points[:: max(1, len(points) // 50000)]
    sample = distinct[:: max(1, len(distinct) // _SAMPLE)]
    distance = cKDTree(distinct).query(sample, k=_NEIGHBOURS + 1)[0][:, -1]
    distance = distance[distance > 0.0]
    if len(distance) == 0:
        return 0.0
    extent = float(np.ptp(np.percentile(sample, [10, 90], axis=0), axis=0).max())
    return max(_GAP_SPACINGS * float(np.median(distance)), _GAP_EXTENT * extent)


def _groups(points: Array, gap: float) -> NDArray[np.int32] | None:
    """Return the group of each point (N,); None if all points are one group.

    Points are in one group if their cubes of side `gap` touch.
    """
    if gap == 0.0:
        return None
    # Farther cubes than 2^20 share the last one, so that keys fit 64-bit integers.
    x, y, z = np.minimum((points - points.min(axis=0)) / gap, _MAX_CUBES).astype(np.int64).T
    base = _MAX_CUBES + 1
    key, inverse = np.unique((x * base + y) * base + z, return_inverse=True)
    cube = np.stack(np.unravel_index(key, (base,) * 3), axis=1)
    if len(cube) > len(points) // 2:
        return None
    pairs = cKDTree(cube).query_pairs(1.5, p=np.inf, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(cube),) * 2)
    count, part = connected_components(graph, directed=False)
    return None if count == 1 else part[inverse]
