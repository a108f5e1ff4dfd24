"""What a team does once grippers have let go: the rest hold the payload where it was, the freed quadrotors stay out of the way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from drake_aerial.control.take_off import TakeOff
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.observation import Observation
from drake_aerial.geometry import Array
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.statics.gravity import GRAVITY

if TYPE_CHECKING:
    from drake_aerial.control.controller import PayloadController

Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Losses:
    """Which grippers are known to have let go, and where things were when they did; empty before the first.

    Attributes
    ----------
    lost : (n,) bool array
    p_WQ : (n, 3) array
        Where each quadrotor goes once it flies on its own [m].
    p_WL : (3,) array
        Where the rest hold L's origin [m].
    """

    lost: Flags
    p_WQ: Array
    p_WL: Array

    @classmethod
    def unpack(cls, memory: Array) -> Losses:
        """Return the losses that a memory (4 n + 3,) holds; zeros mean none."""
        n = (len(memory) - 3) // 4
        return cls(memory[:n] > 0.5, memory[n : 4 * n].reshape(n, 3), memory[4 * n :])

    def pack(self) -> Array:
        """Return the memory (4 n + 3,)."""
        return np.concatenate([self.lost.astype(float), self.p_WQ.ravel(), self.p_WL])

    def after(self, attached: Flags, flying: bool, seen: Observation, rise: Array) -> Losses:
        """Return the losses after a look at the grippers; the same object if nothing more has let go.

        Parameters
        ----------
        attached : (n,) bool array
        flying : bool
            Whether the payload is in the air. Before that all quadrotors fly on their own after a loss.
        seen : Observation
        rise : (n,) array
            How far a freed quadrotor goes up, away from what still hangs [m].
        """
        fresh = ~(attached | self.lost)
        if not fresh.any():
            return self
        up = np.zeros_like(seen.p_WQ)
        up[:, 2] = rise
        alone = fresh if flying else ~self.lost
        target = np.where(fresh[:, None], seen.p_WQ + up, seen.p_WQ)
        return Losses(self.lost | fresh, np.where(alone[:, None], target, self.p_WQ), seen.p.copy())


class RemainingTeam:
    """Flies what is left of a controller's team.

    Those that still hold the payload fly by the same law with a model of the cables that are left, and hold L's origin where it was at the
    loss; the freed fly on their own, a cable's length above where they were. A payload that is not in the air yet is let down:
    everybody just hovers.

    Parameters
    ----------
    controller : PayloadController
        Of the whole team.
    """

    def __init__(self, controller: PayloadController):
        self._controller = controller
        self._laws: dict[tuple[int, ...], PayloadController | None] = {}
        self._rest: dict[float, HoverTrajectory] = {}

    def thrust(
        self,
        t: float,
        losses: Losses,
        flying: bool,
        seen: Observation,
        yaw: float,
        thrust: Array,
        memory: Array,
    ) -> Array | None:
        """Return the thrusts (n, 3) [N] at time t, and update the law's `memory` in place; None where the law knows no smaller team.

        Parameters
        ----------
        t, losses, flying, seen :
            Time [s], what was lost, whether the payload is in the air, what is seen.
        yaw : float
            That the payload is to keep [rad].
        thrust : (n, 3) array
            What was commanded until now [N].
        memory : array
            Of the law; zeros mean that it begins.
        """
        model, take_off = self._controller.model, self._controller.take_off
        command = hovering_thrust(model, take_off, losses.p_WQ, seen)
        kept = np.flatnonzero(~losses.lost)
        if not flying or not len(kept):
            return command
        law = self._law(tuple(kept.tolist()))
        if law is None:
            return None
        # The place does not matter to a law: one reference, at the origin, serves all.
        rest = self._rest.setdefault(yaw, HoverTrajectory(yaw=yaw))
        theirs = seen.of_quadrotors(kept)._replace(p=seen.p - losses.p_WL)
        size = len(law._initial_memory())
        command[kept] = (
            thrust[kept]
            if law._hold(memory[:size])
            else law._fly(t, theirs, rest, thrust[kept], memory[:size])
        )
        return command

    def _law(self, kept: tuple[int, ...]) -> PayloadController | None:
        if kept not in self._laws:
            self._laws[kept] = self._controller._reduced(self._controller.model.carried_by(kept))
        return self._laws[kept]


def hovering_thrust(
    model: PayloadModelParameters, take_off: TakeOff, p_WQ: Array, seen: Observation
) -> Array:
    """Return the thrusts (n, 3) [N] with which quadrotors without a load go to p_WQ (n, 3) [m] and stay, with take-off's gains."""
    error = p_WQ - seen.p_WQ
    size = np.linalg.norm(error, axis=1, keepdims=True)
    error = error * np.minimum(1.0, take_off.max_error / np.maximum(size, 1e-9))
    push = error * take_off.position_gain - seen.v_WQ * take_off.velocity_gain
    push[:, 2] += GRAVITY
    return model.quadrotor_mass[:, None] * push
