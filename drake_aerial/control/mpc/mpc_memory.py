"""Memory of the MPC between two plans, and the initial guess that it gives."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drake_aerial.control.mpc.horizon import Horizon, normalized, unpack
from drake_aerial.dynamics.flatness import Reference
from drake_aerial.dynamics.payload_model import PayloadState
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.disturbance_observer import Disturbance
from drake_aerial.estimation.observation import Observation
from drake_aerial.geometry import Array, cross

_SCALARS = 7


class MpcMemory(NamedTuple):
    """State of the MPC between control steps; all zeros at the start of the flight.

    Thrusts and inputs of the plan include the observed forces on the quadrotors.

    Attributes
    ----------
    begun : float
        1 once a plan exists.
    iterations, active_bounds : float
        QP iterations of the last plan, and how many of its bounds are active.
    prediction_error : float
        Difference of the CoM's measured position from that of the last plan [m].
    correction : float
        Size of the last change of the plan's first input [N].
    limited_steps : float
        Number of control steps in which the observed disturbance was at a limit.
    age : float
        Control steps since the plan was made.
    shift : (3,) array
        Shift of the reference by integral action, in the world [m].
    inputs : (N, 3 n) array
        Inputs of the plan, in the world [N].
    states : (N + 1, 18 + 9 n) array
        States of the plan, as rows (`horizon.pack`).
    observer : array
        Memory of the disturbance observer; empty without one.
    """

    begun: float
    iterations: float
    active_bounds: float
    prediction_error: float
    correction: float
    limited_steps: float
    age: float
    shift: Array
    inputs: Array
    states: Array
    observer: Array

    @staticmethod
    def size(N: int, n: int, observer: int) -> int:
        """Return the length of the vector for N steps, n quadrotors and the observer's memory."""
        return _SCALARS + 3 + N * 3 * n + (N + 1) * (18 + 9 * n) + observer

    @classmethod
    def unpack(cls, values: Array, N: int, n: int) -> MpcMemory:
        """Return the memory in a vector; its arrays are views."""
        inputs = _SCALARS + 3
        states = inputs + N * 3 * n
        observer = states + (N + 1) * (18 + 9 * n)
        arrays = (
            values[_SCALARS:inputs],
            values[inputs:states].reshape(N, -1),
            values[states:observer].reshape(N + 1, -1),
            values[observer:],
        )
        return cls._make([*values[:_SCALARS].tolist(), *arrays])

    @classmethod
    def count_step(cls, values: Array) -> tuple[float, float]:
        """Add a control step to the age in a vector, in place, and return `begun` and `age`."""
        begun, age = cls._fields.index("begun"), cls._fields.index("age")
        values[age] += 1.0
        return float(values[begun]), float(values[age])

    def pack(self) -> Array:
        """Return the memory as a vector."""
        arrays = (self.shift, self.inputs.ravel(), self.states.ravel(), self.observer)
        return np.concatenate([self[:_SCALARS], *arrays])


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
    """Return states (batch N + 1), inputs (N, n, 3) [N] to linearise along, and a position error.

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
