"""Take-off: the mode of every controller from slack cables on the ground to a hanging payload.

The flight controllers' models hold for taut cables and a payload in the air. Before that, the
quadrotors fly on their own: they rise above their contacts until the cables are taut
("tightening"), take over the payload's weight ("tensioning"), and follow the reference upwards
until the payload hangs free ("lifting"). Then the flight controller takes over ("flying").
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.observation import Observation
from drake_aerial.geometry import Array, cross
from drake_aerial.io.records import NonNegative, Positive, record
from drake_aerial.references.trajectory import TrajectorySample
from drake_aerial.statics.gravity import GRAVITY


class FlightPhase(IntEnum):
    """Value of a controller's output port `phase`."""

    TIGHTENING = 0
    TENSIONING = 1
    LIFTING = 2
    FLYING = 3


_FLYING = float(FlightPhase.FLYING)  # comparing floats with an enum is slow


class TakeOffMemory(NamedTuple):
    """State of a take-off.

    Attributes
    ----------
    phase : float
        `FlightPhase`; negative before the first control step.
    since : float
        Time at which the phase began [s].
    p_WC : (n, 3) array
        Contacts at that time, in the world [m]. In "lifting", those of "tensioning".
    """

    phase: float
    since: float
    p_WC: Array

    @classmethod
    def initial(cls, n: int) -> TakeOffMemory:
        """Return the state before the first control step of n quadrotors."""
        return cls(-1.0, 0.0, np.zeros((n, 3)))

    @classmethod
    def unpack(cls, values: Array) -> TakeOffMemory:
        """Return the state in a vector (2 + 3 n,); its array is a view."""
        return cls(float(values[0]), float(values[1]), values[2:].reshape(-1, 3))

    def pack(self) -> Array:
        """Return the state as a vector (2 + 3 n,)."""
        return np.concatenate([[self.phase, self.since], self.p_WC.ravel()])

    @property
    def flying(self) -> bool:
        """True once the flight controller has taken over."""
        return self.phase >= _FLYING


@record(frozen=True)
class TakeOff:
    """Take-off from the ground: phases, gains and thresholds."""

    position_gain: tuple[NonNegative, NonNegative, NonNegative] = (6.0, 6.0, 10.0)
    """Position gain of a quadrotor that flies on its own, along x, y, z [1/s^2]: row "pos" of the
    paper's table."""
    velocity_gain: tuple[NonNegative, NonNegative, NonNegative] = (3.0, 3.0, 6.0)
    """Velocity gain of a quadrotor that flies on its own, along x, y, z [1/s]: row "vel" of the
    paper's table."""
    reach: NonNegative = 0.03
    """Distance beyond the cable's length at which a quadrotor aims while it tightens its cable
    [m]."""
    slack: NonNegative = 0.02
    """Cable length less the distance of its ends below which a cable counts as taut [m]."""
    max_error: Positive = 0.15
    """Limit of the position error, which limits the speed of the rise [m]."""
    ramp_time: Positive = 0.8
    """Time over which the quadrotors take over the payload's weight [s]."""
    clearance: NonNegative = 0.05
    """Height that the contacts gain, beyond what the payload needs to swing upright, before the
    flight controller takes over [m]."""

    def next_phase(
        self,
        model: PayloadModelParameters,
        memory: TakeOffMemory,
        t: float,
        observation: Observation,
        grounded: bool,
        noise: float = 0.0,
    ) -> TakeOffMemory:
        """Return the state after a control step.

        Parameters
        ----------
        model : PayloadModelParameters
        memory : TakeOffMemory
        t : float
            [s]
        observation : Observation
        grounded : bool
            Whether the reference begins on the ground. If not, taut cables at the first control
            step mean flight.
        noise : float
            Standard deviation of the payload's position at the first control step, which is not
            filtered yet [m].
        """
        if memory.flying:
            return memory
        phase = int(memory.phase)
        p_WC = observation.p + model.p_LC @ observation.R.T
        gap = np.linalg.norm(p_WC - observation.p_WQ, axis=1)
        taut = bool((gap > model.cable_length - self.slack).all())
        if phase < 0:
            # A payload that hangs would fall if one noisy sample made its cables look slack.
            hangs = bool((gap > model.cable_length - self.slack - 5.0 * noise).all())
            phase = FlightPhase.FLYING if hangs and not grounded else FlightPhase.TIGHTENING
        elif phase == FlightPhase.TIGHTENING:
            calm = np.linalg.norm(observation.v_WQ, axis=1).max() < 0.1
            if not (taut and calm):
                return memory
            phase = FlightPhase.TENSIONING
        elif phase == FlightPhase.TENSIONING and t - memory.since >= self.ramp_time:
            return memory._replace(phase=FlightPhase.LIFTING, since=t)
        elif phase == FlightPhase.LIFTING:
            gained = (p_WC - memory.p_WC)[:, 2].min()
            if gained < self.clearance + self.swing_height(model):
                return memory
            phase = FlightPhase.FLYING
        else:
            return memory
        return TakeOffMemory(phase, t, p_WC)

    def swing_height(self, model: PayloadModelParameters) -> float:
        """Return the rise of a single contact at which the payload swings free [m]."""
        if model.n > 1:
            return 0.0
        arm = model.p_LC[0] - model.p_LLhang
        return float(2.0 * (np.linalg.norm(arm) - arm[2]))

    def compute_thrusts(
        self,
        model: PayloadModelParameters,
        memory: TakeOffMemory,
        t: float,
        observation: Observation,
        reference: TrajectorySample,
        rise: Array,
    ) -> Array:
        """Return the commanded thrusts (n, 3) [N] of a phase before "flying".

        Parameters
        ----------
        model, memory, t, observation :
            As in `next_phase`.
        reference : TrajectorySample
            At time t. Its velocity and acceleration are followed in "lifting".
        rise : (3,) array
            Displacement of the reference since its start [m].
        """
        phase = int(memory.phase)
        m, l = model.quadrotor_mass[:, None], model.cable_length[:, None]
        p_WC = memory.p_WC
        if phase == FlightPhase.TIGHTENING:
            p_WC = observation.p + model.p_LC @ observation.R.T
        target = p_WC + (l + self.reach) * np.array([0.0, 0.0, 1.0])
        velocity = acceleration = np.zeros(3)
        share = 0.0
        if phase >= FlightPhase.TENSIONING:
            share = 1.0 if phase > FlightPhase.TENSIONING else (t - memory.since) / self.ramp_time
        if phase == FlightPhase.LIFTING:
            target = target + rise
            velocity, acceleration = reference.v, reference.a
        error = self.limited_error(target - observation.p_WQ)
        damping = (velocity - observation.v_WQ) * self.velocity_gain
        push = error * self.position_gain + damping + acceleration
        push[:, 2] += GRAVITY
        thrust = m * push
        thrust[:, 2] += share * self.weight_share(model)
        return thrust

    def limited_error(self, error: Array) -> Array:
        """Return position errors (n, 3) [m] shortened to `max_error`."""
        size = np.linalg.norm(error, axis=1, keepdims=True)
        return error * np.minimum(1.0, self.max_error / np.maximum(size, 1e-9))

    def weight_share(self, model: PayloadModelParameters) -> Array:
        """Return the vertical force (n,) [N] of each cable on the payload at rest, at least 0."""
        if model.n == 1:
            return np.array([model.hanging_mass * GRAVITY])
        weight = np.array([0.0, 0.0, model.hanging_mass * GRAVITY])
        wrench = np.concatenate([weight, cross(model.p_LLhang - model.p_LLcm, weight)])
        share = (np.linalg.pinv(model.grasp_matrix) @ wrench)[2::3]
        return np.maximum(share, 0.0)
