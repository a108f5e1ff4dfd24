"""References of the whole payload model, with cables and thrusts, by differential flatness."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.dynamics.air_forces import payload_wrench
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.geometry import (
    Array,
    cross,
    matrix_from_quat,
    quat_about_axis,
    quat_conjugate,
    quat_from_two_vectors,
    quat_log,
    quat_multiply,
    rotate,
)
from drake_aerial.plant.air import rotor_drag
from drake_aerial.references.trajectory import Trajectory
from drake_aerial.statics.gravity import GRAVITY

GRID = 0.005
"""Spacing of the reference table [s]."""
SMOOTHING = 0.12
"""Width of the window that averages accelerations before they are differentiated [s].

A trajectory's jerk may jump between its segments (with constant timing its velocity too); the
cables' reference must be smooth.
"""
SWING_SMOOTHING = 0.6
"""Width of the window that averages the accelerations caused by the attitude's own motion [s].

The attitude depends on them by a resonance, the swing of the payload about its contact. Only
motions slower than the swing can be followed.
"""
CORRECTIONS = 1
"""Number of corrections of the attitude for its own acceleration."""
STATICS_IN_AIR = 3
"""Number of corrections of the attitude before that for drag and buoyancy, which depend on it."""
_MARGIN = 200
"""Grid points at rest before and after the trajectory."""


class Reference(NamedTuple):
    """Reference of the model at a batch of times.

    Attributes
    ----------
    p, v : (B, 3) arrays
        Position and velocity of L's origin in the world [m, m/s], equal to the trajectory's.
    R : (B, 3, 3) array
        Attitude R_WL that the cables can produce. With one cable its yaw is nominal.
    omega : (B, 3) array
        Angular velocity of L in the world [rad/s].
    xi, w : (B, n, 3) arrays
        Cable directions and their angular velocities in the world [-, rad/s].
    F, u : (B, n, 3) arrays
        Thrusts and commanded thrusts in the world [N].
    pull : (B, 3) array
        Unit direction of the total cable force in the world.
    mu : (B, n, 3) array
        Forces of the cables on the payload in the world [N].
    moment : (B, 3) array
        Their moment about the CoM in the axes of L [N m].
    """

    p: Array
    v: Array
    R: Array
    omega: Array
    xi: Array
    w: Array
    F: Array
    u: Array
    pull: Array
    mu: Array
    moment: Array


def _differentiate(values: Array) -> Array:
    """Return time derivatives of values (T, ...) on the grid, by differences of fourth order.

    Beyond both ends the values are constant.
    """
    padded = np.concatenate([values[:1]] * 2 + [values] + [values[-1:]] * 2)
    return (8.0 * (padded[3:-1] - padded[1:-3]) - (padded[4:] - padded[:-4])) / (12.0 * GRID)


def _smooth(values: Array, width: float) -> Array:
    """Return values (T, 3) on the grid, averaged over a Hann window of `width` [s]."""
    half = int(round(width / GRID / 2))
    window = np.hanning(2 * half + 3)[1:-1]
    window /= window.sum()
    padded = np.concatenate(
        [np.repeat(values[:1], half, 0), values, np.repeat(values[-1:], half, 0)]
    )
    return np.stack(
        [np.convolve(padded[:, k], window, "valid") for k in range(values.shape[1])], axis=1
    )


def producible_attitude(
    model: PayloadModelParameters, yaw: float, force: Array, moment: Array
) -> Array:
    """Return the attitudes q_WL (T, 4) closest to level at which the cables can apply a wrench.

    Parameters
    ----------
    model : PayloadModelParameters
    yaw : float
        Yaw of the upright attitude [rad].
    force : (T, 3) array
        Total cable force in the world [N].
    moment : (T, 3) array
        Moment about the CoM in the axes of L [N m].

    Notes
    -----
    One cable applies no moment about itself, and its force must pass the CoM at the lever of the
    moment. Contacts on a line apply no moment about that line. All other formations apply any
    wrench in any attitude.
    """
    upright = np.array([np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)])
    q = np.broadcast_to(upright, (len(force), 4))
    centred = model.p_LC - model.p_LC.mean(0)
    singular = np.linalg.svd(centred)[1] if model.n > 1 else np.zeros(3)
    size = np.linalg.norm(force, axis=1, keepdims=True)
    if singular[0] < 1e-6:
        a = model.arms.mean(0)
        if np.linalg.norm(a) < 1e-6:
            return q
        across = cross(moment, a[None]) / (a @ a)
        along = np.sqrt(np.maximum(size**2 - (across**2).sum(-1, keepdims=True), (0.1 * size) ** 2))
        f = across + along * a / np.linalg.norm(a)
        f = rotate(upright, f / np.linalg.norm(f, axis=1, keepdims=True))
        return quat_multiply(quat_from_two_vectors(f, force / size), upright)
    if len(singular) < 2 or singular[1] < 1e-6:
        line = np.linalg.svd(centred)[2][0]
        c = model.arms.mean(0) - line * (model.arms.mean(0) @ line)
        if np.linalg.norm(c) < 1e-6:
            return q
        f = rotate(quat_conjugate(upright), force)
        now = np.arctan2(cross(c[None], f) @ line, f @ c)
        lever = np.linalg.norm(c) * np.linalg.norm(f - (f @ line)[:, None] * line, axis=1)
        wanted = np.arcsin(np.clip((moment @ line) / np.maximum(lever, 1e-9), -0.95, 0.95))
        return quat_multiply(q, quat_about_axis(np.broadcast_to(line, f.shape), now - wanted))
    return q


def _tabulate(
    model: PayloadModelParameters, trajectory: Trajectory, wind: Array | None
) -> Reference:
    t = np.arange(-_MARGIN, int(round(trajectory.duration / GRID)) + _MARGIN + 1) * GRID
    sample = trajectory.sample(t)
    a_L = _smooth(sample.a, SMOOTHING)
    v_L = sample.v if model.air is None else _smooth(sample.v, SMOOTHING)
    T, n = len(t), model.n
    gravity = np.array([0.0, 0.0, GRAVITY])
    moment, a_cm = np.zeros((T, 3)), a_L
    air, R, W = np.zeros((T, 6)), np.zeros((T, 3, 3)), np.zeros((T, 3))
    swing = SWING_SMOOTHING if model.air is None else _swing_smoothing(model)
    statics = 0 if model.air is None else STATICS_IN_AIR
    for k in range(1 + CORRECTIONS + statics):
        force = model.mass * (a_cm + gravity)
        if model.air is not None:
            if k == 0:
                R[:] = matrix_from_quat(quat_about_axis(np.array([0.0, 0.0, 1.0]), trajectory.yaw))
            v = v_L + _turning(R, W, model.p_LLcm)
            air = payload_wrench(model, R, W, v, wind).wrench
            force = force - air[:, 0:3]
            moment = moment - _smooth(air[:, 3:6], swing)
        q = producible_attitude(model, trajectory.yaw, force, moment)
        step = quat_multiply(quat_conjugate(q[:-1]), q[1:])
        angle = np.concatenate([np.zeros((1, 3)), np.cumsum(quat_log(step), axis=0)])
        W = _differentiate(angle)
        dW = _differentiate(W)
        R, moment = matrix_from_quat(q), np.zeros((T, 3))
        if k >= statics:
            moment = _smooth(dW @ model.inertia + cross(W, W @ model.inertia), swing)
            a_cm = a_L + _smooth(_of_body(R, W, dW, model.p_LLcm), swing)
    if model.air is not None:
        moment = moment - _smooth(air[:, 3:6], swing)
    wrench = np.concatenate([(force[:, None] @ R)[:, 0], moment], axis=1)
    mu = (wrench @ model.grasp_inverse.T).reshape(T, n, 3) @ np.swapaxes(R, 1, 2)
    xi = -mu / np.linalg.norm(mu, axis=-1, keepdims=True)
    xi_dot = _differentiate(xi)
    a_C = np.stack([a_L + _of_body(R, W, dW, c) for c in model.p_LC], axis=1)
    l, m = model.cable_length[:, None], model.quadrotor_mass[:, None]
    F = mu + m * (a_C + gravity - l * _differentiate(xi_dot))
    if model.air is not None:
        v_C = np.stack([v_L + _turning(R, W, c) for c in model.p_LC], axis=1)
        F = _against_rotor_drag(model.air.rotor_drag, F, v_C - l * xi_dot, wind)
    u = F + model.thrust_lag * _differentiate(F)
    omega = (R @ W[:, :, None])[:, :, 0]
    pull = force / np.linalg.norm(force, axis=1, keepdims=True)
    return Reference(sample.p, sample.v, R, omega, xi, cross(xi, xi_dot), F, u, pull, mu, moment)


def _swing_smoothing(model: PayloadModelParameters) -> float:
    """Return the width of the window for the attitude's own motion [s], at least the default one.

    The air that moves along slows the swing of a payload about its contacts. The default is 0.73 of
    the period of the paper's box on one cable.
    """
    lever = float(np.linalg.norm(model.arms.mean(0)))
    period = (
        2.0
        * np.pi
        * np.sqrt(
            float(np.linalg.eigvalsh(model.inertia)[1])
            / (GRAVITY * model.hanging_mass * max(lever, 0.01))
        )
    )
    return float(np.clip(0.73 * period, SWING_SMOOTHING, 2.0 * SWING_SMOOTHING))


def _turning(R: Array, W: Array, point: Array) -> Array:
    """Return the velocity of a point fixed in L relative to L's origin, in the world (T, 3)."""
    return (R @ cross(W, np.broadcast_to(point, W.shape))[:, :, None])[:, :, 0]


def _against_rotor_drag(
    coefficient: Array, force: Array, velocity: Array, wind: Array | None
) -> Array:
    """Return the thrusts (T, n, 3) [N] that make a total force with the rotor drag.

    The drag depends on the thrust's direction; it is small beside the thrust, so that a few
    repetitions suffice.
    """
    relative = -velocity if wind is None else wind - velocity
    F = force
    for _ in range(4):
        axis = F / np.linalg.norm(F, axis=-1, keepdims=True)
        F = force - rotor_drag(coefficient, axis, relative)
    return F


def _of_body(R: Array, W: Array, dW: Array, point: Array) -> Array:
    """Return the acceleration of a point fixed in L relative to L's origin, in the world (T, 3)."""
    point = np.broadcast_to(point, W.shape)
    body = cross(dW, point) + cross(W, cross(W, point))
    return (R @ body[:, :, None])[:, :, 0]


class ReferenceTable:
    """Reference of a model along a trajectory, tabulated once and interpolated linearly.

    Parameters
    ----------
    model : PayloadModelParameters
    trajectory : Trajectory
    wind : (3,) array, optional
        Constant velocity of the air in the world [m/s], for a model with air; None for still air.

    Attributes
    ----------
    inputs : slice
        Columns of u in a row.
    """

    def __init__(
        self,
        model: PayloadModelParameters,
        trajectory: Trajectory,
        wind: ArrayLike | None = None,
    ):
        table = _tabulate(model, trajectory, None if wind is None else np.asarray(wind, float))
        shapes = [field.shape[1:] for field in table]
        self._rows = np.concatenate([field.reshape(len(table.p), -1) for field in table], axis=1)
        splits = np.cumsum([0] + [int(np.prod(s)) for s in shapes]).tolist()
        self._fields = [(slice(a, b), shape) for a, b, shape in zip(splits, splits[1:], shapes)]
        self.inputs = self._fields[Reference._fields.index("u")][0]

    def at(self, t: ArrayLike) -> Reference:
        """Return the reference at times t (B,) [s]; beyond the table it is at rest."""
        return self.unpack(self.rows(t))

    def rows(self, t: ArrayLike) -> Array:
        """Return the reference at times t (B,) [s] as rows, for `unpack`."""
        last = len(self._rows) - 1.0
        place = np.minimum(np.maximum(np.asarray(t, float) * (1.0 / GRID) + _MARGIN, 0.0), last)
        low = np.minimum(place.astype(int), len(self._rows) - 2)
        rows = self._rows[low]
        rows += (place - low)[:, None] * (self._rows[low + 1] - rows)
        return rows

    def unpack(self, rows: Array) -> Reference:
        """Return the reference in rows of the table."""
        return Reference(*[rows[:, part].reshape(-1, *shape) for part, shape in self._fields])


@lru_cache(maxsize=32)
def reference_table(model: PayloadModelParameters, trajectory: Trajectory) -> ReferenceTable:
    """Return the table of a model along a trajectory, cached by the model's identity."""
    return ReferenceTable(model, trajectory)
