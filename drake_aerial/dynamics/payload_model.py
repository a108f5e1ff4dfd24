"""Dynamics of a payload on taut cables, batched over states.

State: position p and velocity v of the payload's CoM in the world, attitude R = R_WL, angular
velocity W in the axes of L; per cable its direction xi (unit, from quadrotor to contact) and its
angular velocity w (perpendicular to xi), in the world; per quadrotor the thrust vector F in the
world. Input u: the commanded thrust vectors.
"""

from typing import NamedTuple

import numpy as np

from drake_aerial.dynamics.air_forces import AirForces, air_forces
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.dynamics.payload_state import PayloadState
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
"""Smaller than the rounding error of any relevant squared angle [rad^2]."""


class PayloadDerivative(NamedTuple):
    """Time derivatives of a batch of states, and the cable tensions.

    Attributes
    ----------
    v, a : (B, 3) arrays
        Velocity and acceleration of the CoM in the world [m/s, m/s^2].
    W, dW : (B, 3) arrays
        Angular velocity (R' = R [W]x) and its derivative, in the axes of L [rad/s, rad/s^2].
    xi, w : (B, n, 3) arrays
        Directions and angular velocities of the cables (xi' = w x xi) in the world [-, rad/s].
    dF : (B, n, 3) array
        Derivatives of the thrust vectors [N/s].
    tension : (B, n) array
        Cable tensions [N]; negative if the cable would have to push.
    q : (B, n, 3) array
        (contact acceleration + g e3 - F/m) / l [rad/s^2], so that dw = xi x q.
    arm_acceleration : (B, n, 3) array
        W' x a + W x (W x a) of each contact, in the axes of L [m/s^2].
    tension_inverse : (B, n, n) array
        Inverse of the matrix of the linear system in the tensions [kg].
    air : AirForces or None
        Forces of the air; None for a model without air.
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
    air: AirForces | None = None

    @property
    def dw(self) -> Array:
        """Derivatives of the cables' angular velocities (B, n, 3) in the world [rad/s^2]."""
        return small_cross(self.xi, self.q)


def derivative(
    model: PayloadModelParameters,
    x: PayloadState,
    u: Array,
    wrench: Array | None = None,
    wind: Array | None = None,
) -> PayloadDerivative:
    """Return the time derivative of a batch of states.

    Each state has one linear system in its n tensions; accelerations follow by substitution.

    Parameters
    ----------
    model : PayloadModelParameters
    x : PayloadState
        Batch B.
    u : (B, n, 3) array
        Commanded thrusts [N].
    wrench : (6,) array, optional
        External force on the payload's CoM in the world [N], and moment in the axes of L [N m].
    wind : (3,) array, optional
        Velocity of the air in the world [m/s], of a model with air.
    """
    M, J, Jinv, a = model.mass, model.inertia, model.inertia_inverse, model.arms
    m, l = model.quadrotor_mass, model.cable_length
    eta = x.xi @ x.R
    S = np.matvec(model.arm_matrices, eta)
    Wx = skew(x.W)
    turning = (Wx @ a.T).mT
    F, air = x.F, None
    if model.air is not None:
        air = air_forces(model, x, turning, wind)
        wrench = air.payload.wrench if wrench is None else air.payload.wrench + wrench
        F = F + air.on_quadrotors
    gyro = -np.matvec(Wx, x.W @ J)
    if wrench is not None:
        gyro = gyro + wrench[..., 3:6]
    centripetal = (Wx @ turning.mT).mT
    D = x.xi @ x.xi.mT / M + (S @ Jinv) @ S.mT + model.inverse_masses
    rhs = (
        l * np.vecdot(x.w, x.w)
        - np.vecdot(x.xi, F) / m
        + np.vecdot(eta, centripetal)
        + np.matvec(S, gyro @ Jinv)
    )
    if wrench is not None:
        rhs += np.matvec(x.xi, wrench[..., 0:3] / M)
    # Well conditioned: 1/m is on the diagonal of D.
    inverse = np.linalg.inv(D).astype(float, copy=False) if model.n > 1 else 1.0 / D
    T = np.matvec(inverse, rhs)
    acceleration = np.vecmat(T, x.xi) / -M
    if wrench is not None:
        acceleration += wrench[..., 0:3] / M
    dW = (gyro - np.vecmat(T, S)) @ Jinv
    arm = (skew(dW) @ a.T).mT + centripetal
    q = (acceleration[:, None] + arm @ x.R.mT - F / m[:, None]) / l[:, None]
    acceleration[:, 2] -= GRAVITY
    dF = (u - x.F) / model.thrust_lag
    return PayloadDerivative(x.v, acceleration, x.W, dW, x.xi, x.w, dF, T, q, arm, inverse, air)


def rotation_exp(theta: Array) -> Array:
    """Return the rotation matrices (B, 3, 3) of rotation vectors (B, 3) [rad]."""
    K = skew(theta)
    # _TINY keeps the quotients below at their limit, 1, for the angle zero.
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
    """Return E (..., 3, 2) with (E1, E2, xi) orthonormal and right-handed; smooth for xi != e3."""
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


def retract(x: PayloadState, delta: Array, E: Array | None = None) -> PayloadState:
    """Return states moved by error states.

    Order of the error: p, v, rotation vector of R in L's axes, W (3 each); rotation of each cable
    about E (2 n); change of each w along the transported E (2 n); F (3 n). nx = 12 + 7 n.

    Parameters
    ----------
    x : PayloadState
        Batch B.
    delta : (B, nx) array
    E : (B, n, 3, 2) array, optional
        Tangent bases at x; computed if not given.
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
    # Parallel transport along the arc from x.xi to xi; w is perpendicular to x.xi.
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
