"""Cost of a plan: squared deviations from the reference and from its inputs, over the horizon."""

from __future__ import annotations

import numpy as np

from drake_aerial.control.controller_parameters import MpcWeights
from drake_aerial.control.mpc.horizon import Horizon
from drake_aerial.control.mpc.tracking_error import deviation, deviation_jacobian, terminal_cost
from drake_aerial.dynamics.flatness import Reference, ReferenceTable
from drake_aerial.dynamics.payload_model import PayloadState
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.geometry import Array


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
