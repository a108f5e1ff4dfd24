"""The distance between neighbouring points of a cloud along its surface."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from drake_aerial.cloud.assumptions import Assumption, AssumptionKind
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.cloud.validation import size_assumption, unit_hint
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

# Points at which the distance is measured.
_SAMPLE = 400
# Neighbours are searched up to this multiple of the radius.
_REACH = 3.0

_FEW_POINTS = 50


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


def check_sampling(
    cloud: PointCloud, rho: float, min_neighbours: int, voxel: float
) -> tuple[Assumption, ...]:
    """Return the assumption that a sparse cloud is dense enough for balls of radius `rho` [m].

    Raises
    ------
    InputError
        If the cloud is too sparse for any curvature.
    """
    # Large voxels are a user's choice; tiny clouds are refused by their numbers of neighbours.
    if voxel > rho / 3.0 or len(cloud) < _FEW_POINTS:
        return ()
    distance = sampling_distance(cloud.points, rho)
    spacing = f"neighbouring points are {100 * distance:.2g} cm apart"
    # At this distance, a ball holds as many points as are needed, its centre included.
    limit = rho * np.sqrt(np.pi / (min_neighbours + 1))
    if distance > limit:
        raise InputError(
            f"the scan is too sparse: {spacing}, at most {100 * limit:.2g} cm are needed for "
            f"rho = {rho:g} m; {remedy(cloud)}"
        )
    if distance <= 0.5 * rho:
        return ()
    text = f"the scan is sparse: {spacing}, {50 * rho:.2g} cm or less are better"
    return (Assumption(AssumptionKind.SPACING, text),)


def remedy(cloud: PointCloud) -> str:
    """Return the advice for a cloud that is too sparse: by its size, it may be in another unit."""
    extent = float(cloud.extent.max())
    if size_assumption(cloud.points):
        return f"the cloud is {extent:.3g} m large; {unit_hint(extent)}"
    return "scan more densely, or learn the skill with a larger rho"
