"""Control of a team after gripper losses.

The remaining quadrotors hold the payload where it was. The freed ones hover out of their way.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drake_aerial.control.take_off import TakeOff
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.observation import Observation
from drake_aerial.geometry import Array
from drake_aerial.references.trajectory import HoverTrajectory, Trajectory
from drake_aerial.statics.gravity import GRAVITY

Flags = NDArray[np.bool_]


class FlightLaw(Protocol):
    """A control law for the payload in the air; `PayloadController` documents the methods."""

    def initial_memory(self) -> Array:
        """Return the initial memory."""

    def holds_plan(self, memory: Array) -> bool:
        """Return True if the previous command is kept at this control step."""

    def compute_thrusts(
        self,
        t: float,
        observation: Observation,
        reference: Trajectory,
        thrust: Array,
        memory: Array,
    ) -> Array:
        """Return the thrusts (n, 3) [N]."""


@dataclass(frozen=True)
class GripperLosses:
    """Lost grippers, and the positions to hold since the loss.

    Attributes
    ----------
    lost : (n,) bool array
    p_WQ : (n, 3) array
        Hover position of each quadrotor that flies on its own [m].
    p_WL : (3,) array
        Where the remaining team holds L's origin [m].
    """

    lost: Flags
    p_WQ: Array
    p_WL: Array

    @staticmethod
    def size(n: int) -> int:
        """Return the length of the vector for n quadrotors; zeros mean no losses."""
        return 4 * n + 3

    @classmethod
    def unpack(cls, values: Array) -> GripperLosses:
        """Return the losses in a vector."""
        n = (len(values) - 3) // 4
        return cls(values[:n] > 0.5, values[n : 4 * n].reshape(n, 3), values[4 * n :])

    def pack(self) -> Array:
        """Return the losses as a vector."""
        return np.concatenate([self.lost.astype(float), self.p_WQ.ravel(), self.p_WL])

    def updated(
        self, attached: Flags, flying: bool, observation: Observation, rise: Array
    ) -> GripperLosses:
        """Return the losses with new ones added; the same object if there are none.

        Parameters
        ----------
        attached : (n,) bool array
        flying : bool
            Whether the payload is in the air. Before that, a loss ends the take-off and all
            quadrotors hover on their own.
        observation : Observation
        rise : (n,) array
            Height by which a freed quadrotor rises above the team [m].
        """
        fresh = ~(attached | self.lost)
        if not fresh.any():
            return self
        up = np.zeros_like(observation.p_WQ)
        up[:, 2] = rise
        alone = fresh if flying else ~self.lost
        target = np.where(fresh[:, None], observation.p_WQ + up, observation.p_WQ)
        p_WQ = np.where(alone[:, None], target, self.p_WQ)
        return GripperLosses(self.lost | fresh, p_WQ, observation.p.copy())


class ReducedTeam:
    """Controller of a team after gripper losses.

    The remaining quadrotors fly by the law of the smaller team and hold L's origin where it was at
    the loss. Each freed quadrotor hovers a cable's length above its position at the loss. If the
    payload is not in the air, all quadrotors hover and the payload stays on the ground.

    Parameters
    ----------
    model : PayloadModelParameters
        Model of the whole team.
    take_off : TakeOff
        Its gains are used for quadrotors that fly on their own.
    law_for : callable
        Returns the law for the model of a smaller team, or None if there is none.
    """

    def __init__(
        self,
        model: PayloadModelParameters,
        take_off: TakeOff,
        law_for: Callable[[PayloadModelParameters], FlightLaw | None],
    ):
        self._model, self._take_off, self._law_for = model, take_off, law_for
        self._laws: dict[tuple[int, ...], FlightLaw | None] = {}
        self._hover: dict[float, HoverTrajectory] = {}

    def compute_thrusts(
        self,
        t: float,
        losses: GripperLosses,
        flying: bool,
        observation: Observation,
        yaw: float,
        thrust: Array,
        memory: Array,
    ) -> Array | None:
        """Return the thrusts (n, 3) [N] in the world, or None without a law for the smaller team.

        Parameters
        ----------
        t : float
            [s]
        losses : GripperLosses
        flying : bool
            Whether the payload is in the air.
        observation : Observation
        yaw : float
            Desired yaw of the payload [rad].
        thrust : (n, 3) array
            Last command [N].
        memory : array
            Memory of the law, updated in place; zeros at the beginning.
        """
        command = hovering_thrust(self._model, self._take_off, losses.p_WQ, observation)
        kept = np.flatnonzero(~losses.lost)
        if not flying or not len(kept):
            return command
        law = self._law(tuple(kept.tolist()))
        if law is None:
            return None
        # Laws do not depend on the position: one reference at the origin serves all losses.
        reference = self._hover.setdefault(yaw, HoverTrajectory(yaw=yaw))
        own = observation.of_quadrotors(kept)._replace(p=observation.p - losses.p_WL)
        memory = memory[: len(law.initial_memory())]
        command[kept] = (
            thrust[kept]
            if law.holds_plan(memory)
            else law.compute_thrusts(t, own, reference, thrust[kept], memory)
        )
        return command

    def _law(self, kept: tuple[int, ...]) -> FlightLaw | None:
        if kept not in self._laws:
            self._laws[kept] = self._law_for(self._model.carried_by(kept))
        return self._laws[kept]


def hovering_thrust(
    model: PayloadModelParameters, take_off: TakeOff, p_WQ: Array, observation: Observation
) -> Array:
    """Return the thrusts (n, 3) [N] with which quadrotors without load hover at p_WQ (n, 3) [m]."""
    error = take_off.limited_error(p_WQ - observation.p_WQ)
    push = error * take_off.position_gain - observation.v_WQ * take_off.velocity_gain
    push[:, 2] += GRAVITY
    return model.quadrotor_mass[:, None] * push
