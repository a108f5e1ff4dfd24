"""Distances of quadrotors from each other, and of them and their cables from the payload."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drake_aerial.dynamics.flatness import Reference
from drake_aerial.dynamics.path_demands import CROSSING, Demand, smallest
from drake_aerial.dynamics.path_limits import CarriedPayload, PathLimits
from drake_aerial.geometry import Array, cross
from drake_aerial.plant.triangles import closest_points

_FREE = 0.03
"""Part of a cable next to its contact that is not tested [m]: there it touches the payload."""
_ROUNDING = 0.02
"""Positions in L that are closer than this count as one for the clearance [m]."""
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


def free_distances(
    carried: CarriedPayload, limits: PathLimits, t: Array, reference: Reference
) -> Iterator[Demand]:
    """Yield the smallest free distance between two quadrotors."""
    n = carried.model.n
    if n < 2:
        return
    p_WQ = _quadrotors(carried, reference) @ np.swapaxes(reference.R, 1, 2)
    gap = np.linalg.norm(p_WQ[:, :, None] - p_WQ[:, None], axis=3)
    gap -= carried.guard_radius[:, None] + carried.guard_radius
    gap[:, np.arange(n), np.arange(n)] = np.inf
    free = gap.min(axis=2)
    yield smallest("distance", "m", t, free, _kept_distance(free[0], limits.distance))


def clearances(
    carried: CarriedPayload, limits: PathLimits, t: Array, reference: Reference
) -> list[Demand]:
    """Return the smallest distance of a rotor guard from the payload, and cables that cross it."""
    p_LQ, n = _quadrotors(carried, reference), carried.model.n
    low, high = carried.vertices.min(axis=0), carried.vertices.max(axis=0)
    outside = np.maximum(np.maximum(low - p_LQ, p_LQ - high), 0.0)
    # The distance from the bounding box is a lower bound.
    distance = np.linalg.norm(outside, axis=2)
    near = distance < (carried.guard_radius + limits.clearance)
    demands = []
    crossed: Demand | None = None
    for i in range(n):
        cells = np.round(p_LQ[:, i] / _ROUNDING).astype(int)
        first = np.unique(cells, axis=0, return_index=True)[1]
        exact = first[near[first, i]]
        if len(exact):
            found = surface_distances(carried.vertices, carried.faces, p_LQ[exact, i])
            distance[:, i] = np.where(near[:, i], np.inf, distance[:, i])
            distance[exact, i] = found
        contacts = np.broadcast_to(carried.model.p_LC[i], (len(first), 3))
        inside = cables_inside(carried.vertices, carried.faces, contacts, p_LQ[first, i])
        if inside.any() and crossed is None:
            when = float(t[first[inside]].min())
            crossed = Demand(CROSSING, 1.0, 0.0, "-", when, i + 1)
    gap = distance - carried.guard_radius
    demands.append(smallest("clearance", "m", t, gap, _kept_distance(gap[0], limits.clearance)))
    none = Demand(CROSSING, 0.0, 0.0, "-", 0.0, 1)
    return [*demands, crossed or none]


def _quadrotors(carried: CarriedPayload, reference: Reference) -> Array:
    """Return the positions (T, n, 3) of the quadrotors in L [m]."""
    model = carried.model
    up = -(reference.xi @ reference.R)
    positions: Array = model.p_LC + model.cable_length[:, None] * up
    return positions


def _kept_distance(at_rest: Array, limit: float) -> Array:
    """Return the limits (n,) of free distances: half of those at rest where these are small."""
    kept: Array = np.minimum(limit, 0.5 * np.maximum(at_rest, 0.0))
    return kept
