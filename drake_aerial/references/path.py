"""Pieces of a reference path: timing laws, lines, arcs; with derivatives up to snap.

A derivative stack is an array whose first axis is the order of the time derivative, 0 to 4: value, velocity,
acceleration, jerk, snap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

TIMINGS = ("smooth", "quintic", "constant")
_POLYNOMIALS = {
    "smooth": np.polynomial.Polynomial(
        [0.0, 0.0, 0.0, 0.0, 0.0, 126.0, -420.0, 540.0, -315.0, 70.0]
    ),
    "quintic": np.polynomial.Polynomial([0.0, 0.0, 0.0, 10.0, -15.0, 6.0]),
}


def timing_law(timing: str, tau: Array) -> Array:
    """Return the progress s(tau) in [0, 1] and its derivatives with respect to tau.

    Parameters
    ----------
    timing : str
        "quintic" (velocity and acceleration vanish at both ends), "smooth" (jerk and snap do too, so that thrust
        directions have no step there), or "constant" (constant rate, which starts and ends with a velocity step).
    tau : (B,) array
        Normalised time in [0, 1].

    Returns
    -------
    (5, B) array
        Derivative stack.
    """
    if timing in _POLYNOMIALS:
        s = _POLYNOMIALS[timing]
        return np.stack([(s.deriv(k) if k else s)(tau) for k in range(5)])
    if timing == "constant":
        return np.stack([tau, np.ones_like(tau), *(np.zeros_like(tau) for _ in range(3))])
    raise InputError(f"timing {timing!r} is not known: give one of {', '.join(TIMINGS)}")


def _progress(timing: str, duration: float, t: Array) -> Array:
    return timing_law(timing, t / duration) / duration ** np.arange(5)[:, None]


@dataclass(frozen=True)
class Line:
    """A straight piece from `start` to `goal`, or a rest where both are equal."""

    phase: str
    duration: float
    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    timing: str = "quintic"

    def derivatives(self, t: Array) -> Array:
        """Return the derivative stack (5, B, 3) [m, s] at times t (B,) in [0, duration]."""
        s = _progress(self.timing, self.duration, t)
        stack = s[:, :, None] * (np.array(self.goal) - np.array(self.start))
        stack[0] += np.array(self.start)
        return stack

    @property
    def end(self) -> Array:
        """Return the last point (3,) [m]."""
        return np.array(self.goal, float)


@dataclass(frozen=True)
class Arc:
    """A horizontal circle about `centre`, from azimuth `azimuth` [rad], over `angle` [rad] (signed)."""

    phase: str
    duration: float
    centre: tuple[float, float, float]
    radius: float
    azimuth: float
    angle: float
    timing: str = "quintic"

    def derivatives(self, t: Array) -> Array:
        """Return the derivative stack (5, B, 3) [m, s] at times t (B,) in [0, duration]."""
        th, d1, d2, d3, d4 = self.angle * _progress(self.timing, self.duration, t)
        z = self.radius * np.exp(1j * (self.azimuth + th))
        # The derivatives of r exp(i theta(t)): polynomials in theta's derivatives times the value itself.
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
        """Return the last point (3,) [m]."""
        last = self.azimuth + self.angle
        return np.array(self.centre) + self.radius * np.array([np.cos(last), np.sin(last), 0.0])


Segment = Line | Arc
