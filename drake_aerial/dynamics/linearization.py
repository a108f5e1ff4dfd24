"""Analytic linearisation of the payload model on its error state, in batches.

The error state is that of `payload_model.retract`. In the chart at a state x the motion
x(t) = retract(x, delta(t)) obeys, to first order, delta' = rate + A delta + B (u - u_bar).
"""

from typing import NamedTuple

import numpy as np

from drake_aerial.dynamics.air_forces import air_jacobians
from drake_aerial.dynamics.payload_model import (
    PayloadDerivative,
    PayloadState,
    derivative,
    tangent_basis,
)
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.geometry import IDENTITY, Array, skew


class Linearization(NamedTuple):
    """The model linearised at a batch of states, on the core y of the error state.

    The core y is the error state without the position p and velocity v of the CoM.

    Attributes
    ----------
    rate : (B, nx) array
        Chart velocity delta' at delta = 0.
    A_v : (B, 3, ny) array
        Derivative of the CoM's acceleration with respect to y, ny = nx - 6. p' = v is not stored.
    A_y : (B, ny, ny) array
        Derivative of y'.
    B_F : (3 n,) array
        Diagonal of the derivative of F' with respect to u, which acts on nothing else [1/s].
    E : (B, n, 3, 2) array
        The tangent bases in which the cables' errors are expressed.
    by_v : (B, 3 + ny, 3) array or None
        Derivative of (v', y') with respect to v, by drag; None without air.
    """

    rate: Array
    A_v: Array
    A_y: Array
    B_F: Array
    E: Array
    by_v: Array | None = None

    def full(self) -> tuple[Array, Array]:
        """Return the dense A (B, nx, nx) and B (nx, 3 n)."""
        B, ny = self.A_y.shape[:2]
        nx, nu = ny + 6, len(self.B_F)
        A = np.zeros((B, nx, nx))
        A[:, 0:3, 3:6] = np.eye(3)
        A[:, 3:6, 6:] = self.A_v
        A[:, 6:, 6:] = self.A_y
        if self.by_v is not None:
            A[:, 3:, 3:6] = self.by_v
        G = np.zeros((nx, nu))
        G[nx - nu :] = np.diag(self.B_F)
        return A, G


def linearize(
    model: PayloadModelParameters,
    x: PayloadState,
    u: Array,
    E: Array | None = None,
    wrench: Array | None = None,
    wind: Array | None = None,
) -> Linearization:
    """Return the model linearised at a batch of states.

    Parameters
    ----------
    model : PayloadModelParameters
    x : PayloadState
        Batch B.
    u : (B, n, 3) array
        Commanded thrusts [N].
    E : (B, n, 3, 2) array, optional
        Tangent bases at x; computed if not given.
    wrench : (6,) array, optional
        As in `derivative`. It is constant in its axes, so it has no derivatives of its own.
    wind : (3,) array, optional
        As in `derivative`.
    """
    n, B, ny = model.n, len(x.p), 6 + 7 * model.n
    iA, iB = 6, 6 + 2 * n
    d = derivative(model, x, u, wrench, wind)
    E = tangent_basis(x.xi) if E is None else E
    tilt = np.empty_like(E)  # d xi / d alpha
    tilt[..., 0] = -E[..., 1]
    tilt[..., 1] = E[..., 0]
    turning = np.vecmat(d.q, tilt)
    spin = np.vecmat(x.w, E)
    air = None if d.air is None else air_jacobians(model, x, tilt, d.air)
    X, G = _acceleration_jacobians(model, x, d, E, tilt, turning, spin, air)

    # With air there are columns of v behind those of y.
    width = X.shape[2]
    constant, by_thrusts = model.constant_jacobians
    A_y = np.empty((B, ny, ny))
    A_y[:] = constant
    A_y[:, 0:3, 0:3] = -0.5 * skew(x.W)
    A_y[:, 3:6] = X[:, 0:3, :ny]
    q_y = G.reshape(B, n, 3, width) / model.cable_length[:, None, None]
    q_y[..., :ny] += by_thrusts
    if air is not None:
        q_y -= air[1] / (model.quadrotor_mass * model.cable_length)[:, None, None]
    own_blocks(q_y, iA, 2)[:] += skew(d.q) @ E
    by_cable = tilt.mT @ q_y
    # Transport of w along the sphere: the chart's curvature, of second order in the cable's rate.
    normal = np.empty((B, n, 2))
    normal[..., 0] = -spin[..., 1]
    normal[..., 1] = spin[..., 0]
    own_blocks(by_cable, iA, 2)[:] -= 0.5 * normal[..., :, None] * normal[..., None, :]
    by_cable = by_cable.reshape(B, 2 * n, width)
    A_y[:, iB : iB + 2 * n] = by_cable[:, :, :ny]
    by_v: Array | None = None
    if air is not None:
        by_v = np.zeros((B, 3 + ny, 3))
        by_v[:, 0:3], by_v[:, 6:9] = X[:, 3:6, ny:], X[:, 0:3, ny:]
        by_v[:, 3 + iB : 3 + iB + 2 * n] = by_cable[:, :, ny:]

    cables = (spin.reshape(B, 2 * n), turning.reshape(B, 2 * n))
    rate = np.concatenate([d.v, d.a, d.W, d.dW, *cables, d.dF.reshape(B, 3 * n)], axis=1)
    B_F = 1.0 / model.thrust_lag.ravel()
    return Linearization(rate, X[:, 3:6, :ny], A_y, B_F, E, by_v)


def _acceleration_jacobians(
    model: PayloadModelParameters,
    x: PayloadState,
    d: PayloadDerivative,
    E: Array,
    tilt: Array,
    turning: Array,
    spin: Array,
    air: tuple[Array, Array] | None = None,
) -> tuple[Array, Array]:
    """Return derivatives with respect to y of the payload's and the contacts' accelerations.

    With air, width = ny + 3 and the last columns are derivatives with respect to v; else width =
    ny.

    The tensions are differentiated implicitly: first all terms with T held fixed, then along
    D dT = -d(residual).

    Parameters
    ----------
    model, x, d, E :
        The model, its states (batch B), their derivative and tangent bases.
    tilt : (B, n, 3, 2) array
        Derivative of the cables' directions with respect to their errors.
    turning, spin : (B, n, 2) arrays
        Angular accelerations and rates of the cables, in the tangent bases.
    air : pair of arrays, optional
        Result of `air_jacobians`.

    Returns
    -------
    X : (B, 6, width) array
        Of the angular acceleration in the axes of L and the CoM's acceleration in the world.
    G : (B, 3 n, width) array
        Of the contacts' accelerations in the world.
    """
    n, B, ny = model.n, len(x.p), 6 + 7 * model.n
    width = ny if air is None else ny + 3
    a, l = model.arms, model.cable_length
    iA, iB, iF = 6, 6 + 2 * n, 6 + 4 * n
    T = d.tension[:, :, None, None]
    eta = x.xi @ x.R
    arm = model.arm_matrices
    pull = (T * arm) @ skew(eta)  # T [a]x [eta]x: minus its sum is d(moment)/d(theta)
    Wx = skew(x.W)

    # Moment about the CoM and acceleration of the CoM, tensions held fixed.
    X = np.zeros((B, 6, width))
    N = X[:, 0:3]
    N[:, :, 0:3] = -pull.sum(1)
    N[:, :, 3:6] = skew(x.W @ model.inertia) - Wx @ model.inertia
    N[:, :, iA:iB] = np.swapaxes(pull @ (x.R.mT[:, None] @ E), 1, 2).reshape(B, 3, 2 * n)
    X[:, 0:3, :iB] = model.inertia_inverse @ N[:, :, :iB]
    X[:, 3:6, iA:iB] = np.swapaxes(tilt * (T / -model.mass), 1, 2).reshape(B, 3, 2 * n)
    if air is not None:
        by_air = model.mobility @ air[0]
        X[:, :, 0:6] += by_air[:, :, 0:6]
        X[:, :, ny:] += by_air[:, :, 6:9]
    X_T = np.empty((B, 6, n))
    X_T[:, 0:3] = -(np.matvec(arm, eta) @ model.inertia_inverse).mT
    X_T[:, 3:6] = x.xi.mT / -model.mass

    # Accelerations of the contacts: G_i = a_cm + R (W' x a_i + W x (W x a_i)).
    levers = np.empty((B, n, 3, 6))
    levers[..., 0:3] = -(x.R[:, None] @ arm)
    levers[..., 3:6] = IDENTITY
    lever = levers.reshape(B, 3 * n, 6)
    own = np.empty((B, n, 3, 6))
    own[..., 0:3] = skew(d.arm_acceleration)
    own[..., 3:6] = skew((Wx @ a.T).swapaxes(1, 2)) + Wx[:, None] @ arm
    own = -x.R[:, None] @ own
    G = lever @ X
    G[:, :, 0:6] += own.reshape(B, 3 * n, 6)

    # Change of the tensions, and what it adds to both.
    residual = -(x.xi[:, :, None] @ G.reshape(B, n, 3, width))
    own_blocks(residual, iA, 2)[:, :, 0] += turning * -l[:, None]
    own_blocks(residual, iB, 2)[:, :, 0] += spin * (-2.0 * l[:, None])
    own_blocks(residual, iF, 3)[:, :, 0] += x.xi / model.quadrotor_mass[:, None]
    if air is not None:
        by_mass = x.xi / model.quadrotor_mass[:, None]
        residual += by_mass[:, :, None] @ air[1]
    dT = -(d.tension_inverse @ residual[:, :, 0])
    X += X_T @ dT
    G += (lever @ X_T) @ dT
    return X, G


def own_blocks(rows: Array, first: int, width: int) -> Array:
    """Return a writable view of each cable's own columns, (B, n, k, width), in rows (B, n, k, m).

    The columns of cable i begin at first + i width. `rows` must be contiguous.
    """
    B, n, k, m = rows.shape
    size = rows.itemsize
    strides = (n * k * m * size, (k * m + width) * size, m * size, size)
    return np.ndarray((B, n, k, width), rows.dtype, rows, first * size, strides)
