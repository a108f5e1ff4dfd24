"""Geometric evidence on a cloud: seen from the origin or not, and the tilt of its planes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError, cKDTree

from drake_aerial.geometry import Array

# Points of which the evidence is computed, and samples of their convex hull.
_POINTS, _HULL_SAMPLES = 4000, 3000
# In units of the spacing: radius of the tube about a ray, gap between two layers along it, and
# distance to a point up to which the hull is covered.
_TUBE, _GAP, _COVER = 1.5, 5.0, 1.5
# Offset of the layers' centres, in units of the tube's radius, at the rim of a hidden region.
_RIM_OFFSET = 0.6
# Parts of the hull seen at a smaller cosine do not count.
_MIN_COSINE = 0.1
# Neighbours of a plane fit, thickness of a plane relative to its width (variances), and the cone
# [deg] in which normals belong to one plane.
_NEIGHBOURS, _FLATNESS, _SAME_PLANE = 20, 0.15, 5.0
# Largest difference of tilt and of azimuth [deg] of the two sides of a roof.
_ROOF = 6.0


@dataclass(frozen=True)
class ViewEvidence:
    """What a cloud's geometry says about a sensor at the origin and about z as the vertical.

    Attributes
    ----------
    layered : float
        Fraction of the points with another layer of points on their ray from the origin. Nearly
        zero in one view from the origin; about half for a scan from all sides.
    rims : int
        Number of points at rims where one layer ends and another begins: as the origin sees it,
        nothing is missing and nothing hidden there.
    rim_fraction : float
        Their fraction among the points of `layered`.
    agreement : float
        Fraction of the convex hull's area that has points and faces the origin, or has none and
        faces away. About 0.9 for one view of a convex object from the origin, half for a plate.
    plane : float
        Fraction of the points on planes of the most frequent direction.
    plane_tilt : float
        Angle between the normal of these planes and the z axis [deg], up to 90.
    roof : float
        Fraction of the points on planes of the same tilt and the opposite azimuth.
    level : float
        Fraction of the points on planes within 6 deg of horizontal, if z is the vertical.
    """

    layered: float
    rims: int
    rim_fraction: float
    agreement: float
    plane: float
    plane_tilt: float
    roof: float
    level: float


def view_evidence(points: Array) -> ViewEvidence:
    """Compute the evidence of points (N, 3) [m], none of them at the origin."""
    rng = np.random.default_rng(0)
    if len(points) > _POINTS:
        points = points[rng.choice(len(points), _POINTS, replace=False)]
    tree = cKDTree(points)
    spacing = float(np.median(tree.query(points, k=5)[0][:, -1]))
    layered, rims, rim_fraction = _layers(points, spacing)
    agreement = _hull_agreement(points, tree, spacing, rng)
    return ViewEvidence(layered, rims, rim_fraction, agreement, *_planes(points, tree))


def _layers(points: Array, spacing: float) -> tuple[float, int, float]:
    """Return the fraction of layered points, the number at rims, and the fraction of those."""
    distance = np.linalg.norm(points, axis=1)
    direction = points / distance[:, None]
    tube = np.minimum(_TUBE * spacing / distance, 1.0)
    near = cKDTree(direction).query_ball_point(direction, tube)
    i = np.repeat(np.arange(len(points)), [len(indices) for indices in near])
    j = np.concatenate([np.asarray(indices, dtype=np.int64) for indices in near])
    order = np.lexsort((distance[j], i))
    i, j = i[order], j[order]
    # Layers are numbered through, nearest first, over all tubes; a tube starts with a new number.
    new = np.append(True, (i[1:] != i[:-1]) | (np.diff(distance[j]) > _GAP * spacing))
    layer = np.cumsum(new)
    own = np.zeros(len(points), dtype=np.int64)
    own[i[i == j]] = layer[i == j]
    other = layer != own[i]
    offset = (direction[j] - direction[i]) / tube[i][:, None]
    counts, centres = zip(
        *(_means(i[mask], offset[mask], len(points)) for mask in (~other, other)), strict=True
    )
    judged = (counts[0] >= 3) & (counts[1] >= 2)
    apart = np.linalg.norm(centres[1] - centres[0], axis=1)[judged] > _RIM_OFFSET
    return float((counts[1] > 0).mean()), int(apart.sum()), float(apart.mean()) if len(apart) else 0


def _means(index: NDArray[np.int64], values: Array, size: int) -> tuple[NDArray[np.int64], Array]:
    """Return the number (size,) and the mean (size, 3) of the values of each index."""
    count = np.bincount(index, minlength=size)
    sums = [np.bincount(index, values[:, k], size) for k in range(3)]
    return count, np.stack(sums, axis=1) / np.maximum(count, 1)[:, None]


def _hull_agreement(
    points: Array, tree: cKDTree, spacing: float, rng: np.random.Generator
) -> float:
    """Return the fraction of the hull that is covered and faces the origin, or neither."""
    centre = points.mean(axis=0)
    try:
        hull = ConvexHull(points - centre, qhull_options="QJ")
    except QhullError:
        return 0.5
    corners = hull.points[hull.simplices] + centre
    edges = corners[:, 1:] - corners[:, :1]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    if not area.sum() > 0.0:
        return 0.5
    facet = rng.choice(len(area), _HULL_SAMPLES, p=area / area.sum())
    weights = rng.dirichlet([1.0, 1.0, 1.0], _HULL_SAMPLES)
    sample = np.einsum("nk,nkd->nd", weights, corners[facet])
    covered = tree.query(sample)[0] < _COVER * spacing
    towards = -np.sum(hull.equations[facet, :3] * sample, axis=1) / np.linalg.norm(sample, axis=1)
    weight = np.where(np.abs(towards) > _MIN_COSINE, np.abs(towards), 0.0)
    return float(weight[covered == (towards > 0.0)].sum() / max(weight.sum(), 1e-300))


def _planes(points: Array, tree: cKDTree) -> tuple[float, float, float, float]:
    """Return `plane`, `plane_tilt`, `roof` and `level` of the evidence."""
    neighbours = points[tree.query(points, k=min(_NEIGHBOURS, len(points)))[1]]
    offsets = neighbours - neighbours.mean(axis=1, keepdims=True)
    variances, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", offsets, offsets))
    normals = axes[variances[:, 0] < _FLATNESS * variances[:, 1], :, 0]
    if not len(normals):
        return 0.0, 0.0, 0.0, 0.0
    normals = normals * np.where(normals[:, 2:] < 0.0, -1.0, 1.0)
    candidates = normals[:: max(1, len(normals) // 200)]
    same = np.abs(candidates @ normals.T) > np.cos(np.deg2rad(_SAME_PLANE))
    best = int(same.sum(axis=1).argmax())
    members = normals[same[best]]
    mean = (members * np.sign(members @ candidates[best])[:, None]).mean(axis=0)
    mean /= np.linalg.norm(mean)
    tilt = np.rad2deg(np.arccos(min(1.0, abs(mean[2]))))
    fractions = [
        np.count_nonzero(np.abs(normals @ axis) > np.cos(np.deg2rad(_ROOF)))
        for axis in (mean * [-1.0, -1.0, 1.0], np.array([0.0, 0.0, 1.0]))
    ]
    total = len(points)
    return len(members) / total, float(tilt), fractions[0] / total, fractions[1] / total
