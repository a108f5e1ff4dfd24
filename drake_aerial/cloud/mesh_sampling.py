"""Uniform samples of a mesh's surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

# Steps of the two-dimensional additive recurrence 1/g, 1/g^2, with g^3 = g + 1 (Roberts 2018).
_STEPS = np.array([0.7548776662466927, 0.5698402909980532])


def sample_surface(vertices: Array, faces: NDArray[np.int64], count: int, seed: int = 0) -> Array:
    """Sample points uniformly by area over a triangle mesh; equal input gives equal points.

    Systematic sampling along the cumulative area selects the triangle. A low-discrepancy
    sequence selects the point in it. Independent draws would leave clumps and gaps.

    Parameters
    ----------
    vertices : (V, 3) array
        Vertices [m].
    faces : (F, 3) int array
        Triangles, as indices of vertices.
    count : int
        Number of points.
    seed : int
        Random seed of the offsets of both sequences.

    Returns
    -------
    (count, 3) array
        Points on the surface [m].

    Raises
    ------
    InputError
        If `count` is not positive, the mesh has no area, or a face has an index out of range.
    """
    if count < 1:
        raise InputError(f"`samples` must be positive, got {count}")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError(
            f"the mesh has {len(vertices)} vertices, but a face refers to vertex "
            f"{faces.max() if faces.min() >= 0 else faces.min()}"
        )
    corners = vertices[faces]
    areas = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    areas = np.where(np.isfinite(areas), areas, 0.0)
    total = areas.sum()
    if not total > 0.0:
        raise InputError("the mesh has no surface area: its triangles are degenerate or not finite")
    offsets = np.random.default_rng(seed).random(3)
    steps = np.arange(count)
    cumulative = np.cumsum(areas) / total
    chosen = np.searchsorted(cumulative, (steps + offsets[0]) / count, side="right")
    chosen = np.minimum(chosen, len(faces) - 1)
    uv = (offsets[1:] + steps[:, None] * _STEPS) % 1.0
    root = np.sqrt(uv[:, :1])
    a, b, c = (corners[chosen, i] for i in range(3))
    return (1.0 - root) * a + root * (1.0 - uv[:, 1:]) * b + root * uv[:, 1:] * c
