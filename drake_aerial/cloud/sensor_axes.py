"""Detect clouds from a single depth image that are still in camera axes."""

from __future__ import annotations

import numpy as np

from drake_aerial.geometry import Array

_MIN_POINTS = 200
# Tangent of the largest angle between a pixel's ray and the optical axis, as of wide depth cameras.
_MAX_TANGENT = 1.8
# On a lattice, the gaps within columns of pixels sum up to less than this fraction of the width,
# and there are several points for each column.
_MAX_SPREAD, _MIN_SHARED = 0.05, 4


def camera_axes(points: Array) -> str | None:
    """Return "z forward" or "z backward" for points (N, 3) in camera axes, else None.

    The rays from the origin through the points then form a lattice: x/z has one value for each
    column of pixels, y/z one for each row. Points on a lattice in x and y themselves, such as a
    height map, are not a camera's. Points with range noise, crops and random subsets are found;
    clouds that were averaged in voxels are not.
    """
    if len(points) < _MIN_POINTS:
        return None
    x, y, z = points.T
    if not (z.min() > 0.0 or z.max() < 0.0):
        return None
    u, v = x / z, y / z
    if max(np.abs(u).max(), np.abs(v).max()) > _MAX_TANGENT:
        return None
    if not (_is_lattice(u) and _is_lattice(v)) or (_is_lattice(x) and _is_lattice(y)):
        return None
    return "z forward" if z[0] > 0.0 else "z backward"


def lattice_step(values: Array) -> float | None:
    """Return the distance of the few equidistant numbers that values (N,) are close to, or None."""
    gaps = np.sort(np.diff(np.sort(values)))
    width = gaps.sum()
    if not width > 0.0:
        return None
    # Half of the width is made of gaps that are at least as wide as a step.
    step = float(gaps[np.searchsorted(np.cumsum(gaps), 0.5 * width)])
    small = gaps < 0.25 * step
    columns = len(gaps) - int(np.count_nonzero(small)) + 1
    spread = float(gaps[small].sum()) / width
    return step if spread < _MAX_SPREAD and columns * _MIN_SHARED <= len(values) else None


def _is_lattice(values: Array) -> bool:
    """Return whether values (N,) are close to a few equidistant ones."""
    return lattice_step(values) is not None
