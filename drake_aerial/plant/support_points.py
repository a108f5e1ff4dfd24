"""Contact spheres on which a payload stands on the ground in its scanned attitude."""

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from drake_aerial.geometry import Array

RADIUS = 0.004
"""Radius of the contact spheres [m]."""
_MAX_FEET = 6


def feet(vertices: Array, com: Array) -> tuple[Array, bool]:
    """Return the points on which a payload stands, and True if they are on its surface.

    If the lowest part of the shape (2 % of its height, at most 1 cm) supports the centre of mass,
    its corners are the feet. A payload that would topple, such as a bunny whose mass is at its
    neck, stands on a light cradle: the outline of its horizontal projection, moved down to the
    ground, and widened if the centre of mass is outside of that too.

    Parameters
    ----------
    vertices : (V, 3) array
        The shape, z up [m].
    com : (3,) array
        Centre of mass in the same frame [m].

    Returns
    -------
    feet : (K, 3) array
        Points at the height of the lowest vertex [m].
    stands_alone : bool
        Whether the feet are on the payload's own shape.
    """
    z = vertices[:, 2]
    low, height = z.min(), np.ptp(z)
    margin = 0.02 * float(np.ptp(vertices[:, :2], axis=0).max())
    base = vertices[z <= low + min(0.02 * height, 0.01) + 1e-9, :2]
    outline = _outline(base)
    own = outline is not None and _margin(outline, com[:2]) >= margin
    if not own:
        outline = _outline(vertices[:, :2])
        if outline is None:
            half = max(margin, 0.05) * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
            outline = com[:2] + half
        elif _margin(outline, com[:2]) < margin:
            outline = _outline(np.concatenate([outline, 2.0 * com[:2] - outline]))
            assert outline is not None
    assert outline is not None
    corners = _spread(outline, _MAX_FEET, com[:2], margin)
    return np.column_stack([corners, np.full(len(corners), low)]), own


def extremes(vertices: Array) -> Array:
    """Return the vertices (K, 3), K <= 14, that are furthest along the axes and diagonals."""
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    diagonals = np.array(
        [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float
    )
    directions = np.concatenate([diagonals, axes])
    return vertices[np.unique(np.argmax(vertices @ directions.T, axis=0))]


def _outline(points: Array) -> Array | None:
    """Return the corners (K, 2) of the convex hull, counter-clockwise; None if it has no area."""
    if len(points) < 3:
        return None
    try:
        return points[ConvexHull(points).vertices]
    except QhullError:
        return None


def _margin(outline: Array, point: Array) -> float:
    """Return the distance of a point from the outline [m], positive inside, negative outside."""
    edge = np.roll(outline, -1, axis=0) - outline
    normal = np.column_stack([-edge[:, 1], edge[:, 0]]) / np.linalg.norm(
        edge, axis=1, keepdims=True
    )
    return float(np.einsum("ij,ij->i", normal, point - outline).min())


def _spread(outline: Array, count: int, com: Array, margin: float) -> Array:
    """Return about `count` corners of an outline, with the centre of mass inside.

    The corner whose removal costs the least area is removed first.
    """
    while len(outline) > count:
        before, after = np.roll(outline, 1, axis=0), np.roll(outline, -1, axis=0)
        u, v = outline - before, after - outline
        order = np.argsort(np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]))
        for k in order:
            fewer = np.delete(outline, k, axis=0)
            if _margin(fewer, com) >= 0.5 * margin:
                outline = fewer
                break
        else:
            break
    return outline
