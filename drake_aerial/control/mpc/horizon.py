"""Horizon of a plan: its steps of unequal length, and the time shift of a plan."""

import itertools
from collections.abc import Sequence

import numpy as np

from drake_aerial.dynamics.payload_model import PayloadState
from drake_aerial.geometry import Array

STAGES = (1,) * 4 + (2,) * 8
"""Default steps of the horizon, in units of the shortest."""


class Horizon:
    """N steps from the current time.

    Parameters
    ----------
    stages : int or sequence of int
        Lengths of the steps in units of `step`; a number N means N steps of one unit.
    step : float
        Shortest step h [s].
    ahead : float
        Time from one plan to the next [s].
    lag : float
        Age of the samples at the beginning of a plan [s], at most `ahead`.

    Attributes
    ----------
    units : (N,) int array
        Lengths of the steps in units of `step`.
    ends : (N + 1,) int array
        Times of the states in units of `step`, from 0.
    shares : (N + 1,) array
        Quadrature weights of the states in units of `step` (trapezoidal rule); 1 at both ends.
    means : (N, ends[-1]) array
        Matrix from inputs at every unit to their means over the steps.
    shift_states, shift_inputs : (N + 1, N + 1), (N, N) arrays
        Matrices from a plan's states and inputs to those `ahead` later.
    lag_change : (N + 1,) array
        Row from a plan's states to their change within `lag`, at the time `ahead`.
    """

    def __init__(self, stages: int | Sequence[int], step: float, ahead: float, lag: float = 0.0):
        units = np.ones(stages, int) if isinstance(stages, int) else np.array(stages)
        self.units, self.step = units, step
        self.ends = np.concatenate([[0], np.cumsum(units)])
        self.shares = np.concatenate([[1.0], 0.5 * (units[:-1] + units[1:]), [1.0]])
        self.means = np.zeros((len(units), self.ends[-1]))
        for k, (begin, end) in enumerate(itertools.pairwise(self.ends)):
            self.means[k, begin:end] = 1.0 / (end - begin)
        self.shift_states = shifting(self.ends.astype(float), ahead / step)
        self.lag_change = (
            self.shift_states[0] - shifting(self.ends.astype(float), (ahead - lag) / step)[0]
        )
        self.shift_inputs = shifting(self.means @ np.arange(self.ends[-1]), ahead / step)

    def __len__(self) -> int:
        """Return N."""
        return len(self.units)


def shifting(times: Array, ahead: float) -> Array:
    """Return the matrix (B, B) that shifts samples at `times` (B,) [s] by `ahead` [s].

    Samples are interpolated linearly, and extrapolated beyond the end.
    """
    B = len(times)
    place = times + ahead
    low = np.clip(np.searchsorted(times, place, side="right") - 1, 0, B - 2)
    share = (place - times[low]) / (times[low + 1] - times[low])
    M = np.zeros((B, B))
    M[np.arange(B), low] = 1.0 - share
    M[np.arange(B), low + 1] = share
    return M


def pack(x: PayloadState) -> Array:
    """Return states (batch B) as rows (B, 18 + 9 n)."""
    return np.concatenate([field.reshape(len(field), -1) for field in x], axis=1)


def unpack(rows: Array, n: int) -> PayloadState:
    """Return the states in rows (B, 18 + 9 n), as views."""
    B, c = len(rows), 18 + 3 * n
    return PayloadState(
        rows[:, 0:3],
        rows[:, 3:6],
        rows[:, 6:15].reshape(B, 3, 3),
        rows[:, 15:18],
        rows[:, 18:c].reshape(B, n, 3),
        rows[:, c : c + 3 * n].reshape(B, n, 3),
        rows[:, c + 3 * n :].reshape(B, n, 3),
    )


def normalized(x: PayloadState) -> PayloadState:
    """Return interpolated states, projected back onto their manifold."""
    R = 1.5 * x.R - 0.5 * x.R @ x.R.mT @ x.R
    xi = x.xi / np.sqrt(np.vecdot(x.xi, x.xi))[:, :, None]
    w = x.w - xi * np.vecdot(xi, x.w)[:, :, None]
    return x._replace(R=R, xi=xi, w=w)
