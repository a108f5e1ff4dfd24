"""The distance between neighbouring points of a cloud along its surface."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from drake_aerial.geometry import Array

# Points at which the distance is measured.
_SAMPLE = 400
# Neighbours are searched up to this multiple of the radius.
_REACH = 3.0


def sampling_distance(points: Array, radius: float) -> float:
    """Return the median distance [m] between neighbours in the most sparsely sampled direction.

    LiDAR scans are dense along a ring and sparse across: the nearest neighbour would not show it.
    Around a point, the tangent plane is divided into four sectors, of which one has the nearest
    neighbour in its middle. The distance is that to the nearest point of a sector, the second
    largest of the four, since one may be empty at a rim.

    Parameters
    ----------
    points : (N, 3) array
        Points [m].
    radius : float
        Radius of the feature neighbourhoods [m]; distances are limited to three times as much.
    """
    tree = cKDTree(points)
    reach = _REACH * radius
    sample = np.unique(np.linspace(0, len(points) - 1, _SAMPLE).astype(int))
    distances = np.full(len(sample), reach)
    for k, neighbours in enumerate(tree.query_ball_point(points[sample], reach)):
        offset = points[neighbours] - points[sample[k]]
        length = np.linalg.norm(offset, axis=1)
        offset, length = offset[length > 0.0], length[length > 0.0]
        if len(offset) < 3:
            continue
        axes = np.linalg.eigh(offset.T @ offset)[1]
        plane = offset @ axes[:, 1:]
        direction = np.arctan2(plane[:, 1], plane[:, 0])
        turn = direction - direction[np.argmin(length)]
        sector = np.round(turn / (0.5 * np.pi)).astype(int) % 4
        nearest = np.full(4, reach)
        np.minimum.at(nearest, sector, length)
        distances[k] = np.sort(nearest)[2]
    return float(np.median(distances))
