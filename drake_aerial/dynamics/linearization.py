"""Analytic linearisation of the payload model on its error state, and its discretisation; in batches.

The error state is that of `payload_model.retract`. In the chart at a state x the motion
x(t) = retract(x, delta(t)) obeys, to first order, delta' = rate + A delta + B (u - u_bar).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_aerial.dynamics.payload_model import (
    PayloadDerivative,
    PayloadState,
    derivative,
    tangent_basis,
)
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.geometry import IDENTITY, Array, skew, vee


class Linearization(NamedTuple):
    """The model about a batch of states, on the core y of the error state: all of it but p and v.

    Attributes
    ----------
    rate : (B, nx) array
        Chart velocity delta' at delta = 0.
    A_v : (B, 3, ny) array
        Derivative of the CoM's acceleration with respect to y; ny = nx - 6. p' = v is not stored.
    A_y : (B, ny, ny) array
        Derivative of y'.
    B_F : (3 n,) array
        Derivative of F' with respect to u, a diagonal; u acts on nothing else.
    E : (B, n, 3, 2) array
        The tangent bases in which the cables' errors are expressed.
    at : PayloadDerivative
        The time derivative of the states, for those who need accelerations or tensions.
    """

    rate: Array
    A_v: Array
    A_y: Array
    B_F: Array
    E: Array
    at: PayloadDerivative

    def full(self) -> tuple[Array, Array]:
        """Return the dense A (B, nx, nx) and B (nx, 3 n)."""
        B, ny = self.A_y.shape[:2]
        nx, nu = ny + 6, len(self.B_F)
        A = np.zeros((B, nx, nx))
        A[:, 0:3, 3:6] = np.eye(3)
        A[:, 3:6, 6:] = self.A_v
        A[:, 6:, 6:] = self.A_y
        G = np.zeros((nx, nu))
        G[nx - nu :] = np.diag(self.B_F)
        return A, G


def linearize(
    model: PayloadModelParameters,
    x: PayloadState,
    u: Array,
    E: Array | None = None,
    wrench: Array | None = None,
) -> Linearization:
    """Return the model linearised at states x (batch B) and commanded thrusts u (B, n, 3) [N].

    The tensions are differentiated implicitly: with T held fixed first, then along D dT = -d(residual).
    E are the tangent bases at x, where they are known already; `wrench` (6,) as in `derivative`: constant in its axes,
    it has no derivatives of its own.
    """
    n, B = model.n, len(x.p)
    a, m, l = model.arms, model.quadrotor_mass, model.cable_length
    ny = 6 + 7 * n
    iA, iB, iF = 6, 6 + 2 * n, 6 + 4 * n
    d = derivative(model, x, u, wrench)
    T = d.tension[:, :, None, None]
    E = tangent_basis(x.xi) if E is None else E
    tilt = np.empty_like(E)  # d xi / d alpha
    tilt[..., 0] = -E[..., 1]
    tilt[..., 1] = E[..., 0]
    RT = x.R.mT
    eta = x.xi @ x.R
    arm = model.arm_matrices
    pull = (T * arm) @ skew(eta)  # T [a]x [eta]x: minus its sum is d(moment)/d(theta)
    Wx = skew(x.W)

    # Moment about the CoM and acceleration of the CoM, tensions held fixed.
    X = np.zeros((B, 6, ny))
    N = X[:, 0:3]
    N[:, :, 0:3] = -pull.sum(1)
    N[:, :, 3:6] = skew(x.W @ model.inertia) - Wx @ model.inertia
    N[:, :, iA:iB] = np.swapaxes(pull @ (RT[:, None] @ E), 1, 2).reshape(B, 3, 2 * n)
    X[:, 0:3, :iB] = model.inertia_inverse @ N[:, :, :iB]
    X[:, 3:6, iA:iB] = np.swapaxes(tilt * (T / -model.mass), 1, 2).reshape(B, 3, 2 * n)
    X_T = np.empty((B, 6, n))
    S = np.matvec(arm, eta)
    X_T[:, 0:3] = -(S @ model.inertia_inverse).mT
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

    # How the tensions follow.
    residual = -(x.xi[:, :, None] @ G.reshape(B, n, 3, ny))[:, :, 0]
    turning = np.vecmat(d.q, tilt)
    by_tilt = turning * -l[:, None]
    spin = np.vecmat(x.w, E)
    by_spin = spin * (-2.0 * l[:, None])
    by_thrust = x.xi / m[:, None]
    own_blocks(residual[:, :, None], iA, 2)[:, :, 0] += by_tilt
    own_blocks(residual[:, :, None], iB, 2)[:, :, 0] += by_spin
    own_blocks(residual[:, :, None], iF, 3)[:, :, 0] += by_thrust
    dT = -(d.tension_inverse @ residual)
    X += X_T @ dT
    G += (lever @ X_T) @ dT

    constant, by_thrusts = model.constant_jacobians
    A_y = np.empty((B, ny, ny))
    A_y[:] = constant
    A_y[:, 0:3, 0:3] = -0.5 * Wx
    A_y[:, 3:6] = X[:, 0:3]
    q_y = G.reshape(B, n, 3, ny) / l[:, None, None] + by_thrusts
    own_blocks(q_y, iA, 2)[:] += skew(d.q) @ E
    tiltT = tilt.mT
    # Transport of w along the sphere: the chart's curvature, of second order in the cable's rate.
    normal = np.empty((B, n, 2))
    normal[..., 0] = -spin[..., 1]
    normal[..., 1] = spin[..., 0]
    by_cable = tiltT @ q_y
    own_blocks(by_cable, iA, 2)[:] -= 0.5 * normal[..., :, None] * normal[..., None, :]

    A_y[:, iB:iF] = by_cable.reshape(B, 2 * n, ny)

    rate = np.concatenate(
        [
            d.v,
            d.a,
            d.W,
            d.dW,
            spin.reshape(B, 2 * n),
            turning.reshape(B, 2 * n),
            d.dF.reshape(B, 3 * n),
        ],
        axis=1,
    )
    return Linearization(rate, X[:, 3:6], A_y, 1.0 / model.thrust_lag.ravel(), E, d)


class DiscreteModel(NamedTuple):
    """delta(h) = drift + Phi delta(0) + Gamma (u - u_bar), in the chart at the beginning of each step.

    Attributes
    ----------
    flow : (B, nx, 3 n + nx + 1) array
        Gamma, Phi and drift side by side.
    """

    flow: Array

    @property
    def Phi(self) -> Array:
        """(B, nx, nx), a view."""
        return self.flow[:, :, -1 - self.flow.shape[1] : -1]

    @property
    def Gamma(self) -> Array:
        """(B, nx, 3 n), a view."""
        return self.flow[:, :, : -1 - self.flow.shape[1]]

    @property
    def drift(self) -> Array:
        """(B, nx), a view."""
        return self.flow[:, :, -1]


def discretize(linear: Linearization, step: float) -> DiscreteModel:
    """Return the exact flow of the linearised model over `step` [s] with constant input.

    The matrix exponential and its integrals are Taylor series of the core y to the seventh order; p and v are
    integrals of y. Exact to 1e-3 for lags down to step/1.7.
    """
    B, ny = linear.A_y.shape[:2]
    nx, nu = ny + 6, len(linear.B_F)
    Z = step * linear.A_y
    Z2 = Z @ Z
    tail = Z * (1 / 720)
    tail += Z2 * (1 / 5040)
    S3 = Z2 @ tail
    S3 += Z * (1 / 24)
    S3 += Z2 * (1 / 120)
    _diagonal(S3)[:] += 1 / 6
    S2 = Z @ S3
    _diagonal(S2)[:] += 0.5
    S1 = Z @ S2
    _diagonal(S1)[:] += 1.0
    # By how much each rate of y moves y, v and p: what the inputs and the drift have in common.
    flow = np.zeros((B, nx, nu + nx + 1))
    sources = np.zeros((B, ny, nu + 1))
    sources.reshape(B, -1)[:, (ny - nu) * (nu + 1) :: nu + 2] = linear.B_F
    sources[:, :, nu] = linear.rate[:, 6:]
    Gamma, Phi, drift = flow[:, :, :nu], flow[:, :, nu:-1], flow[:, :, -1]
    v = (step * linear.A_v) @ S1
    Phi[:, 3:6, 6:] = v
    np.matmul(Z, S1, out=Phi[:, 6:, 6:])
    A2 = (step**2 * linear.A_v) @ S2
    Phi[:, 0:3, 6:] = A2
    moved = np.concatenate([(step**3 * linear.A_v) @ S3, A2, step * S1], axis=1) @ sources
    Gamma[:] = moved[:, :, :nu]
    drift[:] = moved[:, :, nu]
    f_v = step * linear.rate[:, 3:6]
    drift[:, 0:3] += step * linear.rate[:, 0:3] + 0.5 * step * f_v
    drift[:, 3:6] += f_v
    flow.reshape(B, -1)[:, nu :: nu + nx + 2] += 1.0
    Phi[:, 0:3, 3:6] = step * IDENTITY
    return DiscreteModel(flow)


def repeated(discrete: DiscreteModel, times: Array) -> DiscreteModel:
    """Return steps that are `times` (B,) as long: each taken so often in its own chart, with the same input.

    The matrices given are changed in place.
    """
    flow, longest = discrete.flow, int(times.max())
    nu = flow.shape[2] - flow.shape[1] - 1
    once = flow.copy() if longest > 2 else flow
    for k in range(1, longest):
        more = _run(np.flatnonzero(times > k))
        step = once[more]
        after = step[:, :, nu:-1] @ flow[more]
        after[:, :, :nu] += step[:, :, :nu]
        after[:, :, -1] += step[:, :, -1]
        flow[more] = after
    return discrete


def _run(index: NDArray[np.intp]) -> slice | NDArray[np.intp]:
    """Return an ascending index as a slice, where it is one: what it takes is not copied."""
    first, end = int(index[0]), int(index[-1]) + 1
    return slice(first, end) if end - first == len(index) else index


def own_blocks(rows: Array, first: int, width: int) -> Array:
    """Return, of rows (B, n, k, m) of n cables, each cable's own columns (B, n, k, width), to be written to.

    Those of cable i begin at first + i width. `rows` is contiguous.
    """
    B, n, k, m = rows.shape
    size = rows.itemsize
    strides = (n * k * m * size, (k * m + width) * size, m * size, size)
    return np.ndarray((B, n, k, width), rows.dtype, rows, first * size, strides)


def _diagonal(matrices: Array) -> Array:
    """Return the diagonals (B, k) of contiguous matrices (B, k, k), to be written to."""
    return matrices.reshape(len(matrices), -1)[:, :: matrices.shape[-1] + 1]


def change_chart(
    discrete: DiscreteModel, x: PayloadState, E: Array, y: PayloadState, E_y: Array
) -> DiscreteModel:
    """Return the steps that start in the charts at x, with their results expressed in the charts at y.

    The matrices given are changed in place.

    Parameters
    ----------
    discrete : DiscreteModel
        Steps in the charts at x (batch B).
    x, y : PayloadState
        Where each step starts, and about where it ends: the distance from y enters to first order.
    E, E_y : (B, n, 3, 2) arrays
        Tangent bases at x and y.
    """
    B, n = x.xi.shape[:2]
    flow, drift, c = discrete.flow, discrete.drift, 12 + 2 * n
    drift[:, 0:3] += x.p - y.p
    drift[:, 3:6] += x.v - y.v
    drift[:, 9:12] += x.W - y.W
    drift[:, c + 2 * n :] += (x.F - y.F).reshape(B, 3 * n)
    # exp(d) = exp(phi) exp(c) with phi the rotation from x to y: c = J_r(phi) (d - phi) near y.
    turned = x.R.mT @ y.R
    phi = _arc(vee(turned))
    K = skew(phi)
    turn = K @ K
    turn /= 6
    turn -= 0.5 * K
    _diagonal(turn)[:] += 1.0
    drift[:, 6:9] -= phi
    flow[:, 6:9] = turn @ flow[:, 6:9]
    # Cables: where y lies in the chart at x, and how the bases turn on the way there (along the shortest arc from one to the other).
    to_y = np.vecmat(y.xi, E)
    to_x = np.vecmat(x.xi, E_y)
    cosine = np.vecdot(x.xi, y.xi)[:, :, None]
    frame = E_y.mT @ E
    frame -= to_x[..., :, None] * (to_y / (1.0 + cosine))[..., None, :]
    place = np.empty_like(to_y)
    place[..., 0] = -to_y[..., 1]
    place[..., 1] = to_y[..., 0]
    drift[:, 12:c] -= _arc(place).reshape(B, 2 * n)
    drift[:, c : c + 2 * n] += np.vecmat(x.w, E).reshape(B, 2 * n)
    block = flow[:, 12 : c + 2 * n].reshape(B, 2, n, 2, -1)
    np.matmul(frame[:, None], block.copy(), out=block)
    drift[:, c : c + 2 * n] -= np.vecmat(y.w, E_y).reshape(B, 2 * n)
    return discrete


def _arc(sine: Array) -> Array:
    """Return rotation vectors (..., 3) of which `sine` has the axis times the sine, for angles well below one."""
    s = np.vecdot(sine, sine)[..., None]
    return sine * (1.0 + s * (1 / 6 + s * (3 / 40 + s * (15 / 336))))
