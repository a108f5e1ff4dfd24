"""Timing laws of moves: splines of the progress along a path, or a factor on its own timing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

_DEGREE = 5
_BEFORE = 4
"""Control points that repeat the first one, and the last one, beyond the ends."""


@dataclass(frozen=True)
class SplineLaw:
    """Timing law: progress along a path as a uniform B-spline of degree 5 over time.

    Beyond both ends the control points are constant, so the law starts and ends with zero
    velocity, acceleration, jerk and snap. It never goes back if the control points do not.

    Parameters
    ----------
    spacing : float
        Distance of the control points in time [s].
    points : tuple of float
        Control points: values of the progress, not decreasing.

    Raises
    ------
    InputError
        If the spacing is not positive or the control points decrease.
    """

    spacing: float
    points: tuple[float, ...]

    def __post_init__(self) -> None:
        points = np.asarray(self.points, float)
        if not (np.isfinite(self.spacing) and self.spacing > 0.0):
            raise InputError(f"`spacing` of a law must be positive [s], got {self.spacing!r}")
        if points.ndim != 1 or len(points) < 2 or not (np.diff(points) >= 0.0).all():
            raise InputError(
                "`points` of a law must be two or more numbers that do not decrease, got "
                f"{self.points}"
            )
        object.__setattr__(self, "points", tuple(points.tolist()))

    @property
    def duration(self) -> float:
        """Time from the first to the last progress [s]."""
        return (len(self.points) + 3) * self.spacing

    @cached_property
    def _spline(self) -> BSpline:
        first, last = [self.points[0]] * _BEFORE, [self.points[-1]] * _BEFORE
        coefficients = np.array([*first, *self.points, *last])
        knots = (np.arange(len(coefficients) + _DEGREE + 1) - _DEGREE) * self.spacing
        return BSpline(knots, coefficients, _DEGREE)

    def derivatives(self, t: Array) -> Array:
        """Return progress and its derivatives up to the fourth (5, B) at times t (B,) [s]."""
        t = np.clip(t, 0.0, self.duration)
        return np.stack([self._spline(t, nu=k) for k in range(5)])

    def slowed(self, factor: float) -> SplineLaw:
        """Return the law with all times multiplied by a factor."""
        return replace(self, spacing=factor * self.spacing)

    def time_of(self, progress: float) -> float:
        """Return the time at which the law reaches a progress [s]."""
        low, high = 0.0, self.duration
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._spline(middle) < progress else (low, middle)
        return high


Law = SplineLaw | float
"""Law of a move; a number is the factor by which the move's own timing is slowed."""


def duration_of(law: Law, own: float) -> float:
    """Return the duration of a move of `own` duration [s] under a law."""
    return law.duration if isinstance(law, SplineLaw) else law * own


def slowed(law: Law, factor: float) -> Law:
    """Return a law with all times multiplied by a factor."""
    return law.slowed(factor) if isinstance(law, SplineLaw) else factor * law


def composed(x: Array, s: Array) -> Array:
    """Return the time derivatives of x(s(t)) up to the fourth.

    Parameters
    ----------
    x : (5, B, 3) array
        Derivatives of x with respect to s.
    s : (5, B) array
        Time derivatives of s.
    """
    _, s1, s2, s3, s4 = s[:, :, None]
    _, x1, x2, x3, x4 = x
    return np.stack(
        [
            x[0],
            x1 * s1,
            x2 * s1**2 + x1 * s2,
            x3 * s1**3 + 3.0 * x2 * s1 * s2 + x1 * s3,
            x4 * s1**4 + 6.0 * x3 * s1**2 * s2 + x2 * (3.0 * s2**2 + 4.0 * s1 * s3) + x1 * s4,
        ]
    )
