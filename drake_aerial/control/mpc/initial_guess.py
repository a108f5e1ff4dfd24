"""Initial guess of a plan: the time-shifted previous plan, with the measured state in front."""

from __future__ import annotations

import numpy as np

from drake_aerial.control.mpc.horizon import Horizon, normalized, unpack
from drake_aerial.control.mpc.mpc_memory import MpcMemory
from drake_aerial.dynamics.flatness import Reference
from drake_aerial.dynamics.payload_model import PayloadState
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.disturbance_observer import Disturbance
from drake_aerial.estimation.observation import Observation
from drake_aerial.geometry import Array, cross


def measured_state(
    model: PayloadModelParameters, observation: Observation, thrust: Array
) -> PayloadState:
    """Return the measured state of the model (batch of 1).

    The thrust of a quadrotor is the part of its command (n, 3) [N] along its thrust axis.
    """
    o, c = observation, model.p_LLcm
    F = (thrust * o.z_WQ).sum(-1, keepdims=True) * o.z_WQ
    p, v = o.p + o.R @ c, o.v + o.R @ cross(o.W, c)
    return PayloadState(*(field[None] for field in (p, v, o.R, o.W, o.xi, o.w, F)))


def initial_guess(
    horizon: Horizon,
    memory: MpcMemory,
    now: PayloadState,
    desired: Reference,
    disturbance: Disturbance | None,
) -> tuple[PayloadState, Array, float]:
    """Return states (batch N + 1) and inputs (N, n, 3) [N] to linearise along, and an error.

    The error is that of the previous plan's prediction of the CoM's position [m].

    Parameters
    ----------
    horizon : Horizon
    memory : MpcMemory
        With the previous plan. Without one, the guess is the state `now` under the thrusts of the
        reference.
    now : PayloadState
        Measured state (batch of 1). Its velocities and thrusts are extrapolated along the previous
        plan by the age of the samples.
    desired : Reference
        At the states of the plan.
    disturbance : Disturbance or None
        Its forces on the quadrotors are added to the measured thrusts.
    """
    N, n = len(horizon), now.xi.shape[1]
    if memory.begun:
        u = (horizon.shift_inputs @ memory.inputs).reshape(N, n, 3)
        x = normalized(unpack(horizon.shift_states @ memory.states, n))
        lag_change = unpack((horizon.lag_change @ memory.states)[None], n)
        now = now._replace(
            v=now.v + lag_change.v,
            W=now.W + lag_change.W,
            w=now.w + lag_change.w,
            F=now.F + lag_change.F,
        )
    if disturbance is not None:
        now = now._replace(F=now.F + disturbance.on_quadrotors)
    if not memory.begun:
        u = desired.F[:N].copy()
        x = PayloadState(*(np.repeat(field, N + 1, axis=0) for field in now))
    prediction_error = float(np.abs(x.p[0] - now.p[0]).max())
    for field, measured in zip(x, now):
        field[0] = measured[0]
    return x, u, prediction_error
