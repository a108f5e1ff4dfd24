"""Split polygons into triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_aerial.geometry import Array, cross

Indices = NDArray[np.int64]


def triangulate(vertices: Array, counts: Indices, corners: Indices) -> Indices | None:
    """Return the triangles (F, 3) of polygons, in their order; None if there are none.

    Convex polygons become fans, concave ones are split by ear clipping. Polygons of fewer than
    three corners are skipped.

    Parameters
    ----------
    vertices : (V, 3) array
        Vertices [m].
    counts : (P,) int array
        Number of corners of each polygon.
    corners : (sum of counts,) int array
        Vertex indices of all polygons, one after the other; they must be valid.
    """
    starts = np.cumsum(counts) - counts
    triangles, owners = [], []
    for count in np.unique(counts[counts >= 3]):
        at = np.flatnonzero(counts == count)
        polygons = corners[starts[at, None] + np.arange(count)]
        fan = np.stack(
            [
                np.broadcast_to(polygons[:, :1], (len(at), count - 2)),
                polygons[:, 1:-1],
                polygons[:, 2:],
            ],
            axis=-1,
        )
        if count > 3:
            for k in np.flatnonzero(~_convex(vertices[polygons])):
                fan[k] = polygons[k][_clip_ears(vertices[polygons[k]])]
        triangles.append(fan.reshape(-1, 3))
        owners.append(np.repeat(at, count - 2))
    if not triangles:
        return None
    return np.concatenate(triangles)[np.argsort(np.concatenate(owners), kind="stable")]


def _convex(points: Array) -> NDArray[np.bool_]:
    """Return a mask (P,) of the polygons (P, n, 3) whose corners all turn to the same side."""
    edge = np.roll(points, -1, axis=1) - points
    normal = cross(points - points[:, :1], np.roll(points, -1, axis=1) - points[:, :1]).sum(axis=1)
    turn = np.einsum("pni,pi->pn", cross(np.roll(edge, 1, axis=1), edge), normal)
    convex: NDArray[np.bool_] = np.all(
        turn >= -1e-9 * np.abs(turn).max(axis=1, keepdims=True), axis=1
    )
    return convex


def _clip_ears(points: Array) -> Indices:
    """Return n - 2 triangles (n - 2, 3) of a simple polygon (n, 3), as indices of its corners."""
    normal = cross(points - points[0], np.roll(points, -1, axis=0) - points[0]).sum(axis=0)
    drop = int(np.argmax(np.abs(normal)))
    flat = np.delete(points, drop, axis=1)
    # Without coordinate `drop`, the polygon is counter-clockwise if this sign is positive.
    sign = np.sign(normal[drop]) * (-1.0 if drop == 1 else 1.0)
    left, triangles = list(range(len(points))), []
    while len(left) > 3:
        for k in range(len(left)):
            a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
            others = flat[[i for i in left if i not in (a, b, c)]]
            if sign * _area(flat[a], flat[b], flat[c]) > 0.0 and not _inside(
                others, flat[a], flat[b], flat[c], sign
            ):
                break
        else:  # the polygon intersects itself
            k = 1
            a, b, c = left[0], left[1], left[2]
        triangles.append((a, b, c))
        left.pop(k)
    return np.array([*triangles, tuple(left)], dtype=np.int64)


def _area(a: Array, b: Array, c: Array) -> Array:
    """Return twice the signed area (...) of triangles in the plane, from points (..., 2)."""
    u, v = b - a, c - a
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]


def _inside(points: Array, a: Array, b: Array, c: Array, sign: float) -> bool:
    """Return whether any of the points (N, 2) is inside the triangle or on its edge."""
    inside = (
        (sign * _area(a, b, points) >= 0.0)
        & (sign * _area(b, c, points) >= 0.0)
        & (sign * _area(c, a, points) >= 0.0)
    )
    # A corner that is repeated, as on a slit, does not count.
    inside &= ~((points == a).all(-1) | (points == b).all(-1) | (points == c).all(-1))
    return bool(inside.any())
