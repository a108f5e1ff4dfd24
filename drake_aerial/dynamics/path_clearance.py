"""Distances of quadrotors and cables from the payload that hangs below them."""

import numpy as np

from drake_aerial.geometry import Array, cross
from drake_aerial.plant.triangles import closest_points

_FREE = 0.03
"""Part of a cable next to its contact that is not tested [m]: there it touches the payload."""
_AT_ONCE = 2_000_000
"""Pairs of cable and triangle that are tested at once, which bounds the memory."""


def surface_distances(vertices: Array, faces: Array, points: Array) -> Array:
    """Return the distances (B,) [m] of points (B, 3) from a surface."""
    return closest_points(vertices, faces, points)[2]


def cables_inside(vertices: Array, faces: Array, contacts: Array, ends: Array) -> Array:
    """Return which straight cables cross a surface, (B,).

    The first 3 cm from the contact do not count.

    Parameters
    ----------
    vertices, faces : (V, 3) array [m], (F, 3) int array
        Surface.
    contacts, ends : (B, 3) arrays
        Lower and upper ends of the cables [m].

    Notes
    -----
    Segments and triangles are intersected by the algorithm of Moeller and Trumbore (1997).
    """
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    first, second = b - a, c - a
    length = np.linalg.norm(ends - contacts, axis=1)
    free = np.minimum(_FREE / np.maximum(length, 1e-9), 1.0)
    found = np.zeros(len(contacts), dtype=bool)
    size = max(1, _AT_ONCE // max(len(faces), 1))
    for begin in range(0, len(contacts), size):
        part = slice(begin, begin + size)
        origin, along = contacts[part, None], (ends - contacts)[part, None]
        p = cross(along, second[None])
        determinant = np.einsum("fi,bfi->bf", first, p)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / determinant
            s = origin - a
            u = np.einsum("bfi,bfi->bf", s, p) * inverse
            q = cross(s, np.broadcast_to(first, s.shape))
            v = (along * q).sum(-1) * inverse
            t = np.einsum("fi,bfi->bf", second, q) * inverse
            hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > free[part, None]) & (t < 1.0)
        found[part] = hit.any(axis=1)
    return found
