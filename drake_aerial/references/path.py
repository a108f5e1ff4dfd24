"""Segments of a reference path: timing laws, lines, arcs; with derivatives up to snap.

The first axis of a derivative stack is the order of the time derivative, 0 to 4: value, velocity,
acceleration, jerk, snap.
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

Point = tuple[float, float, float]
TIMINGS = ("smooth", "quintic", "constant")


def _derivatives(coefficients: list[float]) -> Array:
    """Return the coefficients of a polynomial and of four derivatives: (N, 5, 1), lowest first."""
    polynomial = np.polynomial.Polynomial(coefficients)
    table = np.zeros((len(coefficients), 5, 1))
    for k in range(5):
        derivative = polynomial.deriv(k) if k else polynomial
        table[: len(derivative), k, 0] = derivative.coef
    return table


_COEFFICIENTS = {
    "smooth": _derivatives([0.0, 0.0, 0.0, 0.0, 0.0, 126.0, -420.0, 540.0, -315.0, 70.0]),
    "quintic": _derivatives([0.0, 0.0, 0.0, 10.0, -15.0, 6.0]),
}


def timing_law(timing: str, tau: Array) -> Array:
    """Return the progress s(tau) in [0, 1] and its derivatives with respect to tau.

    Parameters
    ----------
    timing : str
        "quintic" (velocity and acceleration vanish at both ends), "smooth" (jerk and snap vanish
        too, so thrust directions have no step) or "constant" (a velocity step at both ends).
    tau : (B,) array
        Normalised time in [0, 1].

    Returns
    -------
    (5, B) array
        Derivative stack.

    Raises
    ------
    InputError
        If the timing is unknown.
    """
    if timing in _COEFFICIENTS:
        coefficients = _COEFFICIENTS[timing]
        # Horner's scheme, for all derivatives at once.
        stack = coefficients[-1] + np.zeros_like(tau)
        for row in coefficients[-2::-1]:
            stack = row + stack * tau
        return stack
    if timing == "constant":
        return np.stack([tau, np.ones_like(tau), *(np.zeros_like(tau) for _ in range(3))])
    raise InputError(f"`timing` must be one of {', '.join(TIMINGS)}, got {timing!r}")


def _progress(timing: str, duration: float, t: Array) -> Array:
    return timing_law(timing, t / duration) / duration ** np.arange(5)[:, None]


@dataclass(frozen=True)
class Line:
    """Straight segment from `start` to `goal`, or a rest if both are equal."""

    phase: str
    duration: float
    start: Point
    goal: Point
    timing: str = "quintic"

    def derivatives(self, t: Array) -> Array:
        """Return the derivative stack (5, B, 3) [m, s] at times t (B,) in [0, duration]."""
        s = _progress(self.timing, self.duration, t)
        stack = s[:, :, None] * (np.array(self.goal) - np.array(self.start))
        stack[0] += np.array(self.start)
        return stack

    @property
    def end(self) -> Array:
        """Last point (3,) [m]."""
        return np.array(self.goal, float)


@dataclass(frozen=True)
class Arc:
    """Horizontal arc about `centre` [m], from `azimuth` [rad] over the signed `angle` [rad]."""

    phase: str
    duration: float
    centre: Point
    radius: float
    azimuth: float
    angle: float
    timing: str = "quintic"

    def derivatives(self, t: Array) -> Array:
        """Return the derivative stack (5, B, 3) [m, s] at times t (B,) in [0, duration]."""
        th, d1, d2, d3, d4 = self.angle * _progress(self.timing, self.duration, t)
        z = self.radius * np.exp(1j * (self.azimuth + th))
        # Derivatives of r exp(i theta(t)): polynomials in theta's derivatives times the value.
        factors = [
            np.ones_like(z),
            1j * d1,
            1j * d2 - d1**2,
            1j * (d3 - d1**3) - 3 * d1 * d2,
            1j * (d4 - 6 * d1**2 * d2) - 3 * d2**2 - 4 * d1 * d3 + d1**4,
        ]
        stack = np.zeros((5, len(t), 3))
        for k, factor in enumerate(factors):
            stack[k, :, 0], stack[k, :, 1] = (factor * z).real, (factor * z).imag
        stack[0] += np.array(self.centre)
        return stack

    @property
    def end(self) -> Array:
        """Last point (3,) [m]."""
        last = self.azimuth + self.angle
        return np.array(self.centre) + self.radius * np.array([np.cos(last), np.sin(last), 0.0])


class Segment(Protocol):
    """Part of a path: `Line`, `Arc`, or a class of your own with these members."""

    @property
    def phase(self) -> str:
        """Name of the phase that it belongs to."""

    @property
    def duration(self) -> float:
        """Time that it takes [s]."""

    def derivatives(self, t: Array) -> Array:
        """Return the derivative stack (5, B, 3) [m, s] at times t (B,) in [0, duration]."""

    @property
    def end(self) -> Array:
        """Last point (3,) [m]."""


def take_off(
    start: Point, ground_time: float, lift_time: float, lift_height: float
) -> tuple[list[Segment], Array]:
    """Return the segments of a rest on the ground and a lift, and their end (3,) [m].

    A time of 0 s skips a segment.
    """
    chain: list[Segment] = []
    if number("ground_time", ground_time) > 0.0:
        chain.append(rest("ground", ground_time, start))
    if number("lift_time", lift_time) > 0.0:
        top = (start[0], start[1], start[2] + number("lift_height", lift_height))
        chain.append(Line("lift", lift_time, start, top, "smooth"))
    return chain, chain[-1].end if chain else np.array(start)


def rest(phase: str, duration: float, here: Any) -> Line:
    """Return a rest of `duration` [s], parameter `<phase>_time`, at the point `here` (3,) [m]."""
    return Line(phase, number(f"{phase}_time", duration), tuple(here), tuple(here))


def number(name: str, value: Any, low: float = 0.0) -> float:
    """Return a value as a float.

    Raises
    ------
    InputError
        If it is not a finite number of at least `low`.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise InputError(f"`{name}` must be a number, got {value!r}")
    if not np.isfinite(value) or value < low:
        bound = f"[{low:g}" if np.isfinite(low) else "(-inf"
        raise InputError(f"`{name}` must be in {bound}, inf), got {value!r}")
    return float(value)


def point(name: str, value: Any) -> Point:
    """Return a value as a point.

    Raises
    ------
    InputError
        If it is not three finite numbers.
    """
    try:
        p = np.asarray(value, float)
    except (TypeError, ValueError):
        p = np.zeros(0)
    if p.shape != (3,) or not np.isfinite(p).all():
        raise InputError(f"`{name}` must be three finite numbers (x, y, z) [m], got {value!r}")
    return (float(p[0]), float(p[1]), float(p[2]))
