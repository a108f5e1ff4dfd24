"""The closed hull of a scan as a payload's shape, and the assumptions about its hidden part."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import QhullError, cKDTree

from drake_aerial.cloud.assumptions import Assumption, AssumptionKind
from drake_aerial.geometry import Array
from drake_aerial.plant import triangles
from drake_aerial.plant.mass_properties import solid_properties

# The hull is closed downwards if that adds this fraction of its volume, and if less than this
# fraction of what faces down above the lowest point has points.
_ADDED, _COVERED = 0.02, 0.5
# Facets face down below this component of their normal; facets this fraction of the height above
# the lowest point are not the bottom.
_DOWN, _ABOVE = -0.05, 0.02
_SAMPLES, _CELLS, _DIRECTIONS = 2000, 24, 16


def scan_hull(cloud: Any, depth: float) -> tuple[Array, Array, tuple[Assumption, ...]]:
    """Return vertices (V, 3) [m] and faces (F, 3) of a scan's closed hull, and what was assumed.

    The hull of a partial view is closed downwards: each point also stands for its projection onto
    the level of the lowest point. A scan whose underside has points is left as it is.

    Parameters
    ----------
    cloud : PointCloud or (N, 3) array
        The scan. Arrays, whose up direction is not known, are not closed downwards.
    depth : float
        Least thickness [m]; see `triangles.closed_hull`.
    """
    points = np.asarray(getattr(cloud, "points", cloud), dtype=float)
    up = getattr(cloud, "up", None)
    viewpoint = getattr(cloud, "viewpoint", None)
    away = -np.array([0.0, 0.0, 1.0]) if up is None else -np.asarray(up, dtype=float)
    if viewpoint is not None:
        away = points.mean(axis=0) - np.asarray(viewpoint, dtype=float)
    vertices, faces = triangles.closed_hull(points, depth, away)
    if up is None:
        return vertices, faces, ()
    up = np.asarray(up, dtype=float)
    heights = vertices @ up - (points @ up).min()
    down = vertices - np.maximum(heights, 0.0)[:, None] * up
    try:
        closed = triangles.convex_hull(np.concatenate([vertices, down]))
    except QhullError:
        return vertices, faces, ()
    seen, whole = (abs(solid_properties(*hull).volume) for hull in ((vertices, faces), closed))
    if whole < (1.0 + _ADDED) * seen or _underside_is_covered(points, vertices, faces, up):
        return vertices, faces, ()
    across, upright = _centre_bounds(vertices, faces, closed, up)
    text = (
        "the payload is the scan's convex hull, closed downwards to its lowest point; "
        f"{1.0 - seen / whole:.0%} of its volume is assumed, and its centre of mass may be off by "
        f"{100 * across:.1f} cm sideways and {100 * upright:.1f} cm in height; "
        "--payload gives another shape"
    )
    return *closed, (Assumption(AssumptionKind.UNSEEN, text),)


def _underside_is_covered(points: Array, vertices: Array, faces: Array, up: Array) -> bool:
    """Return whether most of the hull's area that faces down, above the bottom, has points."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    normals = np.cross(b - a, c - a)
    area = np.linalg.norm(normals, axis=1)
    height = (a + b + c) @ up / 3.0 - (vertices @ up).min()
    down = (normals @ up < _DOWN * area) & (height > _ABOVE * np.ptp(vertices @ up))
    if not area[down].sum() > 0.0:
        return True
    # Evenly spaced along the summed area, and at the barycentres of a regular pattern.
    steps = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    facet = np.searchsorted(np.cumsum(area[down]) / area[down].sum(), steps)
    u, v = np.sqrt((0.618033988749895 * np.arange(_SAMPLES)) % 1.0), (steps * 97.0) % 1.0
    corners = np.stack([a, b, c], axis=1)[down][np.minimum(facet, down.sum() - 1)]
    weights = np.stack([1.0 - u, u * (1.0 - v), u * v], axis=1)
    tree = cKDTree(points)
    spacing = float(np.median(tree.query(points[:: max(1, len(points) // 1000)], k=5)[0][:, -1]))
    near = tree.query(np.einsum("nk,nkd->nd", weights, corners))[0] < 2.0 * spacing
    return bool(near.mean() > _COVERED)


def _centre_bounds(
    vertices: Array, faces: Array, closed: tuple[Array, Array], up: Array
) -> tuple[float, float]:
    """Return how far the centre of mass may be off, sideways and in height [m].

    The largest over all shapes of uniform density that contain the scan's hull and are inside the
    closed one: a plane cuts off the assumed part that lies farthest in a direction.
    """
    low, high = closed[0].min(axis=0), closed[0].max(axis=0)
    axes = [np.linspace(a, b, 2 * _CELLS + 1)[1::2] for a, b in zip(low, high, strict=True)]
    cells = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    cells = cells[triangles.is_inside_hull(*closed, cells)]
    assumed = np.logical_not(triangles.is_inside_hull(vertices, faces, cells))
    if not len(cells):
        return 0.0, 0.0
    offset = cells - cells.mean(axis=0)
    side = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    side /= np.linalg.norm(side)
    angles = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    around = np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * np.cross(up, side)
    across = max(_largest_shift(offset @ direction, assumed) for direction in around)
    return across, max(_largest_shift(offset @ direction, assumed) for direction in (up, -up))


def _largest_shift(along: Array, assumed: Array) -> float:
    """Return the largest shift of the mean of `along` (N,) if assumed cells are left out."""
    removed = np.sort(along[assumed])  # the farthest against the shift are left out first
    count = len(along) - np.arange(len(removed) + 1)
    total = along.sum() - np.concatenate([[0.0], np.cumsum(removed)])
    return float(np.max(total[count > 0] / count[count > 0], initial=0.0))
