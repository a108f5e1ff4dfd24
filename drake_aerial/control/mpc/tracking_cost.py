"""Deviation of model states from a reference, its Jacobian, and its quadratic cost.

The MPC weighs the deviation e (nx = 12 + 7 n): position and velocity of the tracked point, attitude
and angular velocity of the payload as vectors in the world, and the error-state entries of cables
and thrusts. With one cable the payload's yaw is not controllable, so only the direction of the
cable force counts.
"""

import numpy as np

from drake_aerial.control.controller_parameters import MpcWeights
from drake_aerial.control.mpc.horizon import Horizon
from drake_aerial.dynamics.discretization import discretize
from drake_aerial.dynamics.flatness import Reference, ReferenceTable
from drake_aerial.dynamics.linearization import linearize
from drake_aerial.dynamics.payload_model import PayloadState, rotation_log
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.geometry import IDENTITY, Array, skew, small_cross


def deviation(
    model: PayloadModelParameters, x: PayloadState, desired: Reference, E: Array
) -> Array:
    """Return e (B, nx) of states x from a reference; E (B, n, 3, 2) are the tangent bases at x."""
    B, n = x.xi.shape[:2]
    c = model.p_LLcm
    omega = np.matvec(x.R, x.W)
    arm = x.R @ c
    if n == 1:
        axis = np.vecmat(desired.pull, desired.R)  # of L, to be aligned with the pull
        theta = small_cross(desired.pull, np.matvec(x.R, axis))
    else:
        theta = np.matvec(desired.R, rotation_log(desired.R.mT @ x.R))
    turn, spin = np.vecmat(small_cross(desired.xi, x.xi), E), np.vecmat(x.w - desired.w, E)
    return np.concatenate(
        [
            x.p - arm - desired.p,
            x.v - small_cross(omega, arm) - desired.v,
            theta,
            omega - desired.omega,
            turn.reshape(B, 2 * n),
            spin.reshape(B, 2 * n),
            (x.F - desired.F).reshape(B, 3 * n),
        ],
        axis=1,
    )


def deviation_jacobian(model: PayloadModelParameters, x: PayloadState) -> Array:
    """Return the first twelve rows and columns (B, 12, 12) of de/d(error state) at x.

    The rest of the matrix is the identity.
    """
    C = np.zeros((len(x.p), 12, 12))
    C[:, 0:3, 0:3] = C[:, 3:6, 3:6] = IDENTITY
    levers = np.empty((len(x.p), 3, 3))
    levers[:, 0], levers[:, 1], levers[:, 2] = model.p_LLcm, small_cross(x.W, model.p_LLcm), -x.W
    turned = x.R[:, None] @ skew(levers)
    C[:, 0:3, 6:9] = C[:, 3:6, 9:12] = turned[:, 0]
    C[:, 3:6, 6:9] = turned[:, 1]
    C[:, 6:9, 6:9] = C[:, 9:12, 9:12] = x.R
    C[:, 9:12, 6:9] = turned[:, 2]
    return C


def hover_state(model: PayloadModelParameters, desired: Reference) -> PayloadState:
    """Return the model's state at a resting reference (batch of 1), at the world's origin."""
    zero = np.zeros((1, 3))
    return PayloadState(
        desired.R[0:1] @ model.p_LLcm,
        zero,
        desired.R[0:1],
        zero,
        desired.xi[0:1],
        np.zeros_like(desired.xi[0:1]),
        desired.F[0:1],
    )


def terminal_cost(
    model: PayloadModelParameters,
    desired: Reference,
    Q: Array,
    R: Array,
    step: float,
    sweeps: int = 400,
) -> Array:
    """Return P (nx, nx) such that e^T P e is the cost-to-go of hovering, by Riccati sweeps from Q.

    The algebraic Riccati equation has no solution if a mode is neither controllable nor weighed
    (the payload's yaw with one cable). The recursion converges anyway.

    Parameters
    ----------
    model : PayloadModelParameters
    desired : Reference
        At rest, batch of 1.
    Q, R : (nx,), (nu,) arrays
        Weights per step on e and on the commanded thrusts.
    step : float
        [s]
    sweeps : int
        Number of steps to go.
    """
    x = hover_state(model, desired)
    linear = linearize(model, x, desired.F[0:1])
    discrete = discretize(linear, step)
    nx = len(Q)
    C = np.eye(nx)
    C[:12, :12] = deviation_jacobian(model, x)[0]
    A = C @ discrete.Phi[0] @ np.linalg.inv(C)
    B = C @ discrete.Gamma[0]
    P = np.diag(Q)
    for _ in range(sweeps):
        PA, PB = P @ A, P @ B
        gain = np.linalg.solve(np.diag(R) + B.T @ PB, B.T @ PA)
        P = np.diag(Q) + A.T @ PA - (PB.T @ A).T @ gain
        P = 0.5 * (P + P.T)
    return P


class TrackingCost:
    """Quadratic cost on the deviations of a plan, with the cost-to-go of hovering at its end.

    Parameters
    ----------
    model : PayloadModelParameters
    weights : MpcWeights
    horizon : Horizon

    Attributes
    ----------
    input_weights : (N, 3 n) array
        Weights of the commanded thrusts [1/N^2].
    """

    def __init__(self, model: PayloadModelParameters, weights: MpcWeights, horizon: Horizon):
        n, w, step = model.n, weights, horizon.step
        attitude, rate = [w.attitude] * 3, [w.rate] * 3
        if n == 1:
            attitude, rate = [w.swing, w.swing, 0.0], [w.swing_rate, w.swing_rate, 0.0]
        cables = np.repeat([w.direction, w.direction_rate, w.thrust], [2 * n, 2 * n, 3 * n])
        tracking = np.repeat([w.position, w.velocity], 3)
        self._model, self._horizon = model, horizon
        self._Q = step * np.concatenate([tracking, attitude, rate, cables])
        self._R = step * np.full(3 * n, w.input)
        self._state_weights = horizon.shares[:, None, None] * np.diag(self._Q)
        self.input_weights = np.repeat(horizon.units, 3 * n).reshape(-1, 3 * n) * self._R
        self._terminal: dict[float, Array] = {}

    def terminal(self, table: ReferenceTable, yaw: float) -> Array:
        """Return the cost-to-go (nx, nx) of hovering at `yaw` [rad], computed once per yaw."""
        if yaw not in self._terminal:
            hover = table.at(np.array([np.inf]))
            self._terminal[yaw] = terminal_cost(
                self._model, hover, self._Q, self._R, self._horizon.step
            )
        return self._terminal[yaw]

    def quadratic(
        self, x: PayloadState, u: Array, E: Array, desired: Reference, P: Array
    ) -> tuple[Array, Array, Array]:
        """Return the cost as a quadratic function of error states and changes of inputs.

        Parameters
        ----------
        x : PayloadState
            States of the plan (batch N + 1).
        u : (N, n, 3) array
            Its inputs [N].
        E : (N + 1, n, 3, 2) array
            Tangent bases at x.
        desired : Reference
            At the states of the plan.
        P : (nx, nx) array
            Cost-to-go at the end.

        Returns
        -------
        Q, q : (N + 1, nx, nx), (N + 1, nx) arrays
            Hessians and gradients by the error states.
        r : (N, 3 n) array
            Gradients by the inputs; the Hessians are diag(`input_weights`).
        """
        N, shares = len(self._horizon), self._horizon.shares
        e = deviation(self._model, x, desired, E)
        C = deviation_jacobian(self._model, x)
        CT = C.mT
        Q, q = self._state_weights.copy(), shares[:, None] * self._Q * e
        Q[:N, :12, :12] = CT[:N] @ ((shares[:N, None] * self._Q[:12])[:, :, None] * C[:N])
        Q[N], q[N] = P, P @ e[N]
        Q[N, :12] = CT[N] @ P[:12]
        Q[N, :, :12] = Q[N, :, :12] @ C[N]
        q[:, :12] = np.vecmat(q[:, :12], C)
        return Q, q, self.input_weights * (u - desired.u[:N]).reshape(N, -1)
