"""Checks of a cloud's points: their size, units, precision and shape."""

from __future__ import annotations

import numpy as np

from drake_aerial.cloud.assumptions import Assumption, AssumptionKind
from drake_aerial.cloud.raw_geometry import as_points
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

MAX_EXTENT = 50.0
MIN_EXTENT = 1e-3
# A cloud is a line if its second principal spread is below this fraction of the first.
LINE_RATIO = 1e-3
# Sizes [m] of payloads. Others are probably in another unit.
_PLAUSIBLE = (0.02, 5.0)
_UNITS = {"millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254, "feet": 0.3048}
# Largest rounding step of 32-bit coordinates [m] at which surface features are accurate.
_MAX_STEP = 2e-3


def check_points(points: Array, label: str) -> None:
    """Check that points (N, 3) span a surface of plausible size in metres.

    Raises
    ------
    InputError
        If they are equal, on a line, too large, too small, or rounded to steps above 2 mm.
    """
    points = as_points(points, label)
    largest = float(np.ptp(points, axis=0).max())
    step = rounding_step(points)
    if step > _MAX_STEP:
        raise InputError(
            f"{label}: coordinates up to {np.abs(points).max():.3g} m are 32-bit floats, rounded "
            f"to steps of {step:.2g} m; subtract an offset before saving, or save 64-bit floats"
        )
    if largest == 0.0:
        raise InputError(f"{label}: all {len(points)} points are equal; a surface is needed")
    if largest > MAX_EXTENT:
        raise InputError(
            f"{label}: the cloud is {largest:.4g} m large, more than {MAX_EXTENT:g} m; "
            f"{unit_hint(largest)}"
        )
    if largest < MIN_EXTENT:
        raise InputError(
            f"{label}: the cloud is {largest:.3g} m large, less than 1 mm; are its units metres?"
        )
    spread = np.linalg.eigvalsh(np.cov((points - points.mean(axis=0)).T))
    if spread[1] <= LINE_RATIO**2 * spread[2]:
        raise InputError(f"{label}: all {len(points)} points lie on a line; a surface is needed")


def rounding_step(points: Array) -> float:
    """Return the step [m] of 32-bit floats at the largest coordinate of points (N, 3).

    Zero if some coordinate is not a 32-bit float.
    """
    largest = float(np.abs(points).max())
    if largest > 1e30 or not np.array_equal(points.astype(np.float32).astype(np.float64), points):
        return 0.0
    if np.array_equal(np.round(points), points) and largest < 2**24:
        return 0.0  # whole numbers are exact
    return float(np.spacing(np.float32(largest)))


def unit_hint(extent: float) -> str:
    """Return a question that names the likely length unit of a cloud of this extent."""
    low, high = _PLAUSIBLE
    likely = [
        f"{name} (then it is {extent * factor:.3g} m)"
        for name, factor in _UNITS.items()
        if low <= extent * factor <= high
    ]
    units = " or ".join(likely) or "metres"
    return f"are its units {units}? Convert the coordinates to metres"


def size_assumption(points: Array) -> list[Assumption]:
    """Return an assumption on the unit if points (N, 3) are implausibly large for metres."""
    extent = float(np.ptp(points, axis=0).max())
    if extent <= _PLAUSIBLE[1]:
        return []
    text = f"metres, by which the cloud is {extent:.3g} m large; {unit_hint(extent)}"
    return [Assumption(AssumptionKind.UNITS, text)]
