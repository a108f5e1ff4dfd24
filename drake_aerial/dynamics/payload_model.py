"""The dynamics of a payload on taut cables, batched over states.

State: payload CoM position p and velocity v in the world, attitude R = R_WL, angular velocity W in the axes
of L; per cable its direction xi (unit, from quadrotor to contact) and angular velocity w (perpendicular to
xi), in the world; per quadrotor the thrust vector F in the world. Input u: the commanded thrust vectors.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.geometry import (
    IDENTITY,
    Array,
    quat_from_matrix,
    quat_log,
    skew,
    small_cross,
    vee,
)
from drake_aerial.statics.gravity import GRAVITY

_TINY = 1e-30
"""Below the rounding of any squared angle that matters [rad^2]."""


class PayloadState(NamedTuple):
    """A batch of states of the model.

    Attributes
    ----------
    p, v : (B, 3) arrays
        CoM position and velocity in the world [m, m/s].
    R : (B, 3, 3) array
        Attitude R_WL.
    W : (B, 3) array
        Angular velocity of the payload in the axes of L [rad/s].
    xi, w : (B, n, 3) arrays
        Cable directions (unit, quadrotor to contact) and their angular velocities [rad/s], in the world.
    F : (B, n, 3) array
        Thrust vectors in the world [N].
    """

    p: Array
    v: Array
    R: Array
    W: Array
    xi: Array
    w: Array
    F: Array


class PayloadDerivative(NamedTuple):
    """Time derivatives of a batch of states, and the tensions that act.

    Attributes
    ----------
    v, a : (B, 3) arrays
        Velocity and acceleration of the CoM in the world.
    W, dW : (B, 3) arrays
        Angular velocity (R' = R [W]x) and its derivative, in the axes of L.
    xi, w : (B, n, 3) arrays
        Directions and angular velocities of the cables (xi' = w x xi) in the world.
    dF : (B, n, 3) array
        Derivatives of the thrust vectors [N/s].
    tension : (B, n) array
        Cable tensions [N]; negative where the cable would have to push.
    q : (B, n, 3) array
        (contact acceleration + g e3 - F/m) / l, of which dw = xi x q.
    arm_acceleration : (B, n, 3) array
        W' x a + W x (W x a), in the axes of L.
    tension_inverse : (B, n, n) array
        Inverse of the matrix of the linear system in the tensions [kg].
    """

    v: Array
    a: Array
    W: Array
    dW: Array
    xi: Array
    w: Array
    dF: Array
    tension: Array
    q: Array
    arm_acceleration: Array
    tension_inverse: Array

    @property
    def dw(self) -> Array:
        """Derivatives of the cables' angular velocities, (B, n, 3) in the world."""
        return small_cross(self.xi, self.q)


def derivative(
    model: PayloadModelParameters, x: PayloadState, u: Array, wrench: Array | None = None
) -> PayloadDerivative:
    """Return the time derivative of states x (batch B) under commanded thrusts u (B, n, 3) [N].

    One linear system in the n tensions per state, then accelerations by substitution. A `wrench` (6,) pushes on the
    payload besides: a force on its CoM in the world [N], and a moment in the axes of L [N m].
    """
    M, J, Jinv, a = model.mass, model.inertia, model.inertia_inverse, model.arms
    m, l = model.quadrotor_mass, model.cable_length
    eta = x.xi @ x.R
    S = np.matvec(model.arm_matrices, eta)
    Wx = skew(x.W)
    gyro = -np.matvec(Wx, x.W @ J)
    if wrench is not None:
        gyro = gyro + wrench[3:6]
    centripetal = (Wx @ (Wx @ a.T)).mT
    D = x.xi @ x.xi.mT / M + (S @ Jinv) @ S.mT + model.inverse_masses
    rhs = (
        l * np.vecdot(x.w, x.w)
        - np.vecdot(x.xi, x.F) / m
        + np.vecdot(eta, centripetal)
        + np.matvec(S, gyro @ Jinv)
    )
    if wrench is not None:
        rhs += x.xi @ (wrench[0:3] / M)
    # Well conditioned: 1/m is on the diagonal of D.
    inverse = np.linalg.inv(D).astype(float, copy=False) if model.n > 1 else 1.0 / D
    T = np.matvec(inverse, rhs)
    acceleration = np.vecmat(T, x.xi) / -M
    if wrench is not None:
        acceleration += wrench[0:3] / M
    dW = (gyro - np.vecmat(T, S)) @ Jinv
    arm = (skew(dW) @ a.T).mT + centripetal
    q = (acceleration[:, None] + arm @ x.R.mT - x.F / m[:, None]) / l[:, None]
    acceleration[:, 2] -= GRAVITY
    return PayloadDerivative(
        x.v, acceleration, x.W, dW, x.xi, x.w, (u - x.F) / model.thrust_lag, T, q, arm, inverse
    )


def rotation_exp(theta: Array) -> Array:
    """Return the rotation matrices (B, 3, 3) of rotation vectors (B, 3) [rad]."""
    K = skew(theta)
    # What is added keeps the quotients of zero by zero at their limit, 1.
    angle = np.sqrt(np.vecdot(theta, theta) + _TINY)[:, None, None]
    half = 0.5 * angle
    return IDENTITY + np.sin(angle) / angle * K + 0.5 * (np.sin(half) / half) ** 2 * (K @ K)


def rotation_log(R: Array) -> Array:
    """Return the rotation vectors (B, 3) [rad] of rotation matrices (B, 3, 3)."""
    axis = vee(R)
    sine = np.sqrt(np.vecdot(axis, axis))
    cosine = 0.5 * (R[:, 0, 0] + R[:, 1, 1] + R[:, 2, 2] - 1.0)
    if cosine.min(initial=1.0) < -0.5:  # too near a half turn for the antisymmetric part
        return quat_log(quat_from_matrix(R))
    return (
        axis
        * np.where(sine > 1e-9, np.arctan2(sine, cosine) / np.maximum(sine, 1e-300), 1.0)[:, None]
    )


def tangent_basis(xi: Array) -> Array:
    """Return E (..., 3, 2) with (E1, E2, xi) orthonormal and right-handed; smooth unless xi = e3."""
    x, y, z = xi[..., 0], xi[..., 1], xi[..., 2]
    s = 1.0 / np.maximum(1.0 - z, 1e-12)
    E = np.empty((*xi.shape, 2))
    E[..., 0, 0] = 1.0 - x * x * s
    E[..., 0, 1] = E[..., 1, 0] = x * y * s
    E[..., 1, 1] = y * y * s - 1.0
    E[..., 1, 0] *= -1.0
    E[..., 2, 0] = x
    E[..., 2, 1] = -y
    return E


def transport(a: Array, b: Array, vector: Array) -> Array:
    """Rotate `vector` (..., 3) by the smallest rotation that takes unit a (..., 3) to unit b (..., 3)."""
    c = small_cross(a, b)
    cv = small_cross(c, vector)
    return vector + cv + small_cross(c, cv) / (1.0 + (a * b).sum(-1))[..., None]


def retract(x: PayloadState, delta: Array, E: Array | None = None) -> PayloadState:
    """Return x moved by error states delta (B, nx); E are the tangent bases at x, where they are known already.

    Order of the error: p, v, rotation vector of R in L's axes, W (3 each); rotation of each direction about E
    (2 n); change of each w along the transported E (2 n); F (3 n). nx = 12 + 7 n.
    """
    B, n = x.xi.shape[:2]
    E = tangent_basis(x.xi) if E is None else E
    turn = delta[:, 12 : 12 + 2 * n].reshape(B, n, 2)
    angle = np.sqrt(np.vecdot(turn, turn) + _TINY)[:, :, None]
    across = np.empty((B, n, 2))  # rho x xi for rho = E turn, E being right-handed
    across[:, :, 0] = turn[:, :, 1]
    across[:, :, 1] = -turn[:, :, 0]
    cosine = np.cos(angle)
    xi = cosine * x.xi + np.sin(angle) / angle * np.matvec(E, across)
    w = x.w + np.matvec(E, delta[:, 12 + 2 * n : 12 + 4 * n].reshape(B, n, 2))
    # Transported with the direction; shorter than `transport`, since w is perpendicular to x.xi.
    w -= np.vecdot(xi, w)[:, :, None] / (1.0 + cosine) * (x.xi + xi)
    return PayloadState(
        x.p + delta[:, 0:3],
        x.v + delta[:, 3:6],
        x.R @ rotation_exp(delta[:, 6:9]),
        x.W + delta[:, 9:12],
        xi,
        w,
        x.F + delta[:, 12 + 4 * n :].reshape(B, n, 3),
    )


def difference(x: PayloadState, y: PayloadState, E: Array | None = None) -> Array:
    """Return the error states (B, nx) that `retract` x to y; E are the tangent bases at x, where known."""
    B, n = x.xi.shape[:2]
    ET = np.swapaxes(tangent_basis(x.xi) if E is None else E, -1, -2)
    c = small_cross(x.xi, y.xi)
    sine = np.sqrt((c * c).sum(-1, keepdims=True))
    angle = np.arctan2(sine, (x.xi * y.xi).sum(-1, keepdims=True))
    rho = c * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-300), 1.0)
    dw = transport(y.xi, x.xi, y.w) - x.w
    theta = rotation_log(np.swapaxes(x.R, 1, 2) @ y.R)
    return np.concatenate(
        [
            y.p - x.p,
            y.v - x.v,
            theta,
            y.W - x.W,
            (ET @ rho[..., None]).reshape(B, 2 * n),
            (ET @ dw[..., None]).reshape(B, 2 * n),
            (y.F - x.F).reshape(B, 3 * n),
        ],
        axis=1,
    )


def integrate(
    model: PayloadModelParameters, x: PayloadState, u: Array, step: float, steps: int = 1
) -> PayloadState:
    """Return the states after `steps` steps of 4th-order Runge-Kutta, `step` [s] long, u constant."""

    def flow(rate: PayloadState | None, scale: float) -> PayloadState:
        if rate is None:
            return x
        xi = x.xi + scale * rate.xi
        return PayloadState(
            x.p + scale * rate.p,
            x.v + scale * rate.v,
            x.R @ rotation_exp(scale * rate.R),
            x.W + scale * rate.W,
            xi / np.linalg.norm(xi, axis=-1, keepdims=True),
            x.w + scale * rate.w,
            x.F + scale * rate.F,
        )

    def rates(before: PayloadState | None, scale: float) -> PayloadState:
        at = flow(before, scale)
        d = derivative(model, at, u)
        # The rotation is integrated in the exponential chart at x, where theta' is this series of W.
        theta = np.zeros_like(d.W) if before is None else scale * before.R
        half = small_cross(theta, d.W)
        theta_dot = d.W + half / 2 + small_cross(theta, half) / 12
        return PayloadState(d.v, d.a, theta_dot, d.dW, small_cross(at.w, at.xi), d.dw, d.dF)

    for _ in range(steps):
        k1 = rates(None, 0.0)
        k2 = rates(k1, step / 2)
        k3 = rates(k2, step / 2)
        k4 = rates(k3, step)
        x = flow(
            PayloadState(*((a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4))), step
        )
        x = x._replace(w=x.w - x.xi * (x.w * x.xi).sum(-1, keepdims=True))
    return x
