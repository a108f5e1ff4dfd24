"""From slack cables on the ground to a hanging payload: the mode in which every controller begins.

The models behind the flight controllers hold for taut cables and a payload in the air. Until then the quadrotors
fly on their own: they rise above their contacts until the cables are taut ("tightening"), take over the payload's
weight ("tensioning"), and follow the reference upwards ("lifting") until the payload surely hangs; then the flight
controller takes over ("flying").
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np

from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.observation import Observation
from drake_aerial.geometry import Array
from drake_aerial.references.trajectory import TrajectorySample
from drake_aerial.statics.gravity import GRAVITY

PHASE_NAMES = ("tightening", "tensioning", "lifting", "flying")


class FlightPhase(IntEnum):
    """The value of a controller's output port `phase`; `PHASE_NAMES` has the names."""

    TIGHTENING = 0
    TENSIONING = 1
    LIFTING = 2
    FLYING = 3


@dataclass(frozen=True)
class TakeOff:
    """How to take off.

    Parameters
    ----------
    position_gain, velocity_gain : (3,) tuples
        Of a quadrotor flying on its own [1/s^2, 1/s]; the paper's table, rows "pos" and "vel" of the controller.
    reach : float
        How far beyond the cable's length a quadrotor aims while it tightens its cable [m].
    slack : float
        A cable shorter than its length by less than this counts as taut [m].
    max_error : float
        Position errors are limited to this, which limits the speed of the rise [m].
    ramp_time : float
        Time over which the payload's weight is taken over [s].
    clearance : float
        Height that the contacts must have gained, beyond what it takes the payload to swing upright, before the
        flight controller takes over [m].
    """

    position_gain: tuple[float, float, float] = (6.0, 6.0, 10.0)
    velocity_gain: tuple[float, float, float] = (3.0, 3.0, 6.0)
    reach: float = 0.03
    slack: float = 0.02
    max_error: float = 0.15
    ramp_time: float = 0.8
    clearance: float = 0.05

    def size(self, n: int) -> int:
        """Return the length of the memory: phase, the time it began, and the contacts (3 n) at that time."""
        return 2 + 3 * n

    def begin(self, n: int) -> Array:
        """Return the memory before the first tick."""
        return np.array([-1.0, 0.0] + [0.0] * (3 * n))

    def next_phase(
        self,
        model: PayloadModelParameters,
        memory: Array,
        t: float,
        seen: Observation,
        grounded: bool,
        noise: float = 0.0,
    ) -> Array:
        """Return the memory after a tick at time t [s].

        Parameters
        ----------
        model : PayloadModelParameters
        memory : (2 + 3 n,) array
        t : float
        seen : Observation
        grounded : bool
            Whether the reference begins on the ground; without it, taut cables at the first tick mean flight.
        noise : float
            Standard deviation of the payload's position at the first tick, which nothing has filtered yet [m].
        """
        if memory[0] == FlightPhase.FLYING:
            return memory
        contacts = seen.p + model.p_LC @ seen.R.T
        gap = np.linalg.norm(contacts - seen.p_WQ, axis=1)
        phase, since = int(memory[0]), memory[1]
        taut = bool((gap > model.cable_length - self.slack).all())
        if phase < 0:
            # A payload that hangs would fall if one bad sample made its cables look slack.
            hangs = bool((gap > model.cable_length - self.slack - 5.0 * noise).all())
            phase = FlightPhase.FLYING if hangs and not grounded else FlightPhase.TIGHTENING
        elif phase == FlightPhase.TIGHTENING:
            calm = np.linalg.norm(seen.v_WQ, axis=1).max() < 0.1
            if not (taut and calm):
                return memory
            phase = FlightPhase.TENSIONING
        elif phase == FlightPhase.TENSIONING and t - since >= self.ramp_time:
            return np.concatenate([[FlightPhase.LIFTING, t], memory[2:]])
        elif phase == FlightPhase.LIFTING:
            gained = (contacts - memory[2:].reshape(-1, 3))[:, 2].min()
            if gained < self.clearance + self.swing_height(model):
                return memory
            phase = FlightPhase.FLYING
        else:
            return memory
        return np.concatenate([[phase, t], contacts.ravel()])

    def swing_height(self, model: PayloadModelParameters) -> float:
        """Return how far a single contact must rise for the payload to swing below it without dragging [m]."""
        if model.n > 1:
            return 0.0
        arm = model.arms[0]
        return float(2.0 * (np.linalg.norm(arm) - arm[2]))

    def thrust(
        self,
        model: PayloadModelParameters,
        memory: Array,
        t: float,
        seen: Observation,
        reference: TrajectorySample,
        rise: Array,
    ) -> Array:
        """Return the commanded thrusts (n, 3) [N] of a phase before flight.

        Parameters
        ----------
        model, memory, t, seen :
            As in `next_phase`.
        reference : TrajectorySample
            At time t; its velocity and acceleration are followed while lifting.
        rise : (3,) array
            How far the reference has gone from where it started [m].
        """
        phase = int(memory[0])
        m, l = model.quadrotor_mass[:, None], model.cable_length[:, None]
        contacts = (
            seen.p + model.p_LC @ seen.R.T
            if phase == FlightPhase.TIGHTENING
            else memory[2:].reshape(-1, 3)
        )
        target = contacts + (l + self.reach) * np.array([0.0, 0.0, 1.0])
        velocity = acceleration = np.zeros(3)
        share: Any = 0.0
        if phase >= FlightPhase.TENSIONING:
            share = 1.0 if phase > FlightPhase.TENSIONING else (t - memory[1]) / self.ramp_time
        if phase == FlightPhase.LIFTING:
            target = target + rise
            velocity, acceleration = reference.v, reference.a
        error = target - seen.p_WQ
        size = np.linalg.norm(error, axis=1, keepdims=True)
        error = error * np.minimum(1.0, self.max_error / np.maximum(size, 1e-9))
        push = (
            error * self.position_gain + (velocity - seen.v_WQ) * self.velocity_gain + acceleration
        )
        push[:, 2] += GRAVITY
        thrust = m * push
        thrust[:, 2] += share * self.weight_share(model)
        return thrust

    def weight_share(self, model: PayloadModelParameters) -> Array:
        """Return the vertical force (n,) [N] with which each cable carries the payload at rest, none negative."""
        if model.n == 1:
            return np.array([model.mass * GRAVITY])
        wrench = np.array([0.0, 0.0, model.mass * GRAVITY, 0.0, 0.0, 0.0])
        share = (np.linalg.pinv(model.grasp_matrix) @ wrench)[2::3]
        return np.maximum(share, 0.0)
