"""Momentum of a payload over smooth windows: equations that are linear in its parameters."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_aerial.errors import InputError
from drake_aerial.estimation.inertial_parameters import inertia_columns
from drake_aerial.geometry import Array, cross, skew
from drake_aerial.statics.gravity import GRAVITY


def _down() -> Array:
    return np.array([0.0, 0.0, -GRAVITY])


@dataclass(frozen=True, eq=False)
class PayloadMotion:
    """Motion of a payload and the forces on it, T samples at a constant interval.

    The force of cable i on the payload is `force` less the rate of `momentum`. With a measured
    tension, `force` is the tension along the cable and `momentum` is zero. Without one, a
    quadrotor's own balance gives it: `force` is thrust and weight of the quadrotor, `momentum`
    that of the quadrotor.

    Attributes
    ----------
    time : (T,) array
        [s]
    p_WL, v_WL : (T, 3) arrays
        Position [m] and velocity [m/s] of L's origin in the world.
    R_WL : (T, 3, 3) array
    W_L : (T, 3) array
        Angular velocity of the payload in the axes of L [rad/s].
    p_LC : (n, 3) array
        Contacts in L [m].
    force : (T, n, 3) array
        In the world [N].
    momentum : (T, n, 3) array
        In the world [kg m/s].
    attached : (T, n) bool array
        Whether the gripper holds. A window with a release is left out.
    carried : (T,) bool array
        Whether only the cables and `other` act on the payload; False on the ground.
    other : (T, 6) array
        Other known force in the world and its moment about L's origin in the world [N, N m], such
        as drag.
    gravity : (3,) array
        In the world [m/s^2].
    """

    time: Array
    p_WL: Array
    v_WL: Array
    R_WL: Array
    W_L: Array
    p_LC: Array
    force: Array
    momentum: Array
    attached: NDArray[np.bool_]
    carried: NDArray[np.bool_]
    other: Array
    gravity: Array = field(default_factory=_down)

    def __post_init__(self) -> None:
        T, n = len(self.time), len(self.p_LC)
        shapes = {
            "p_WL": (T, 3),
            "v_WL": (T, 3),
            "R_WL": (T, 3, 3),
            "W_L": (T, 3),
            "force": (T, n, 3),
            "momentum": (T, n, 3),
            "attached": (T, n),
            "carried": (T,),
            "other": (T, 6),
        }
        for name, shape in shapes.items():
            value = getattr(self, name)
            if value.shape != shape:
                raise InputError(f"`{name}` must have shape {shape}, got {value.shape}")
            if not np.isfinite(value).all():
                raise InputError(f"`{name}` must be finite, but some values are NaN or infinite")
        steps = np.diff(self.time)
        if T < 3 or not (steps > 0.0).all() or np.ptp(steps) > 1e-3 * steps.mean():
            raise InputError(
                f"`time` must have at least 3 samples at a constant interval, got {T} samples"
            )


class WindowEquations(NamedTuple):
    """Equations A phi = b of K windows: change of momentum, then of angular momentum, per second.

    Attributes
    ----------
    A : (K, 6, 10) array
    b : (K, 6) array
        Mean force [N], mean moment about a point near the payload [N m].
    mean_pull : float
        Mean upward pull of the cables over all windows [N].
    """

    A: Array
    b: Array
    mean_pull: float


def window_equations(motion: PayloadMotion, length: float) -> WindowEquations:
    """Return the equations of all windows in which the payload is carried.

    A window function f = cos^4 is zero with its first three derivatives at both ends. With the
    momentum P, linear in phi, and the applied force F, the equation of motion P' = F + m g becomes
    - int f' P dt - int f m g dt = int f F dt. The same holds for the angular momentum about a
    fixed point, for which the payload's mean position in the window is taken.

    Parameters
    ----------
    motion : PayloadMotion
    length : float
        Of a window [s]; windows overlap by half.
    """
    f, slope = _window_functions(motion, length)
    R, W, v = motion.R_WL, motion.W_L, motion.v_WL
    r, g = motion.p_WL - motion.p_WL.mean(axis=0), motion.gravity
    momentum, weight = np.zeros((2, len(r), 6, 10))
    spin = R @ skew(W)
    momentum[:, 0:3, 0] = v
    momentum[:, 0:3, 1:4] = spin
    momentum[:, 3:6, 0] = cross(r, v)
    momentum[:, 3:6, 1:4] = skew(r) @ spin - skew(v) @ R
    momentum[:, 3:6, 4:10] = R @ inertia_columns(W)
    weight[:, 0:3, 0] = g
    weight[:, 3:6, 0] = cross(r, g)
    weight[:, 3:6, 1:4] = -skew(g) @ R
    A = -_contract(slope, momentum) - _contract(f, weight)
    force = motion.force * motion.attached[..., None]
    of_rotors = motion.momentum * motion.attached[..., None]
    arm = r[:, None] + np.einsum("tij,nj->tni", R, motion.p_LC)
    rate = v[:, None] + np.einsum("tij,tnj->tni", R, cross(W[:, None], motion.p_LC))
    other, moment_of_other = motion.other[:, 0:3], motion.other[:, 3:6]
    pull = f @ force.sum(axis=1) + slope @ of_rotors.sum(axis=1)
    moment = f @ (cross(arm, force) + cross(rate, of_rotors)).sum(axis=1)
    moment += slope @ cross(arm, of_rotors).sum(axis=1)
    moment += f @ (cross(r, other) + moment_of_other)
    b = np.concatenate([pull + f @ other, moment], axis=1)
    # Moments about the payload's mean position in each window.
    shift = skew(f @ r)
    A[:, 3:6] -= shift @ A[:, 0:3]
    b[:, 3:6] -= np.matvec(shift, b[:, 0:3])
    upward = -(pull @ g) / np.linalg.norm(g)
    return WindowEquations(A, b, float(upward.mean()) if len(upward) else 0.0)


def _window_functions(motion: PayloadMotion, length: float) -> tuple[Array, Array]:
    """Return the windows (K, T), each of sum 1, and their rates [1/s]."""
    dt = float(motion.time[-1] - motion.time[0]) / (len(motion.time) - 1)
    half = max(2, round(0.5 * length / dt))
    s = np.arange(-half, half + 1) / half
    bump = np.cos(0.5 * np.pi * s) ** 4
    slope = -2.0 * np.pi * np.cos(0.5 * np.pi * s) ** 3 * np.sin(0.5 * np.pi * s) / (half * dt)
    starts = []
    for first in range(0, len(motion.time) - 2 * half, half):
        part = slice(first, first + 2 * half + 1)
        attached = motion.attached[part]
        if motion.carried[part].all() and (attached == attached[0]).all():
            starts.append(first)
    windows, rates = np.zeros((2, len(starts), len(motion.time)))
    for k, first in enumerate(starts):
        windows[k, first : first + 2 * half + 1] = bump / bump.sum()
        rates[k, first : first + 2 * half + 1] = slope / bump.sum()
    return windows, rates


def _contract(windows: Array, values: Array) -> Array:
    """Return the sums (K, ...) of values (T, ...) over windows (K, T)."""
    return np.tensordot(windows, values, axes=1)
