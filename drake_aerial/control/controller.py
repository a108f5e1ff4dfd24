"""The interface that all controllers of a payload share, as a LeafSystem."""

from __future__ import annotations

from math import isfinite

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_aerial.control.remaining_team import Losses, RemainingTeam
from drake_aerial.control.take_off import FlightPhase, TakeOff
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.errors import InputError
from drake_aerial.estimation.observation import Observation, PositionFilter, observe
from drake_aerial.geometry import Array
from drake_aerial.references.trajectory import HoverTrajectory, Trajectory

_FLYING = float(FlightPhase.FLYING)
OFFSET = 0.001
"""Of the ticks after the samples that they read, by default [s]: within a plant's step, so that commands act from the next one on."""
PERIOD = 0.02
"""Of the ticks, by default [s]."""


class PayloadController(LeafSystem):
    """Base of the controllers: ports, the filter of the payload's position, take-off, and the tick.

    | port | size | meaning |
    |---|---|---|
    | in `payload_state` | 13 | quaternion, position, angular and linear velocity of L in the world |
    | in `quadrotor_states` | 13 n | the same of each Q |
    | in `cable_directions` | 6 n | per cable: unit direction from quadrotor to contact, and its rate [1/s] |
    | in `reference` | abstract | a `Trajectory`, over the context's time |
    | in `attached` | n | 1 where a gripper holds, 0 where it let go; may be left unconnected: all hold |
    | out `thrust_vectors` | 3 n | commanded thrusts in the world [N], held between ticks |
    | out `phase` | 1 | `FlightPhase` |
    | out `estimated_position` | 3 | filtered position of L's origin [m] |

    All state is discrete and lives in the Context; it changes at the ticks `offset + k period`. A tick reads samples
    taken before it: with the default offset, that of a sensor that samples at `k period`, 1 ms ago.

    Once a gripper has let go, the others hold the payload where it was, by the same law for the cables that are left, and the
    freed quadrotor hovers above (`RemainingTeam`).

    Parameters
    ----------
    model : PayloadModelParameters
        What the controller believes.
    period, offset : float
        Of the ticks [s].
    take_off : TakeOff
        How to get into the air from the ground.
    position_filter : PositionFilter
        Filter of the measured payload position.
    """

    def __init__(
        self,
        model: PayloadModelParameters,
        *,
        period: float = PERIOD,
        offset: float = OFFSET,
        take_off: TakeOff | None = None,
        position_filter: PositionFilter | None = None,
    ):
        super().__init__()
        if not period > 0.0 or not 0.0 <= offset < period:
            raise InputError(
                f"a controller needs period > 0 and 0 <= offset < period but got {period}, {offset}"
            )
        n = model.n
        self.model, self.period, self.offset = model, period, offset
        self.take_off = take_off or TakeOff()
        self.position_filter = position_filter or PositionFilter()
        self._payload = self.DeclareVectorInputPort("payload_state", 13)
        self._quadrotors = self.DeclareVectorInputPort("quadrotor_states", 13 * n)
        self._cables = self.DeclareVectorInputPort("cable_directions", 6 * n)
        self._reference = self.DeclareAbstractInputPort(
            "reference", AbstractValue.Make(HoverTrajectory())
        )
        hover = np.zeros((n, 3))
        hover[:, 2] = model.min_thrust
        self._attached = self.DeclareVectorInputPort("attached", n)
        self._thrust_index = self.DeclareDiscreteState(hover.ravel())
        self._phase_index = self.DeclareDiscreteState(self.take_off.begin(n))
        self._filter_index = self.DeclareDiscreteState(np.array([0.0] * 6 + [-1.0]))
        self._memory_index = self.DeclareDiscreteState(self._initial_memory())
        self._losses_index = self.DeclareDiscreteState(np.zeros(4 * n + 3))
        self._remaining = RemainingTeam(self)
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._tick)
        ticket = {self.all_state_ticket()}
        self.DeclareStateOutputPort("thrust_vectors", self._thrust_index)
        self.DeclareVectorOutputPort("phase", 1, self._calc_phase, ticket)
        self.DeclareVectorOutputPort("estimated_position", 3, self._calc_position, ticket)

    def set_thrusts(self, context: Context, thrust: Array) -> None:
        """Set what is commanded until the first tick, thrusts (n, 3) [N], in this system's context; the least there is by default."""
        command = limited(self.model, np.asarray(thrust, dtype=float)).ravel()
        context.get_mutable_discrete_state(self._thrust_index).SetFromVector(command)

    def _initial_memory(self) -> Array:
        """Return the initial value of whatever else the law remembers from tick to tick."""
        return np.zeros(0)

    def _fly(
        self, t: float, seen: Observation, reference: Trajectory, thrust: Array, memory: Array
    ) -> Array:
        """Return the thrusts (n, 3) [N] of the flight law at time t, and update `memory` in place.

        `thrust` (n, 3) is what was commanded until now; a `memory` of zeros means that flight begins.
        """
        raise NotImplementedError

    def _hold(self, memory: Array) -> bool:
        """Return whether what is commanded is held at this tick whatever is seen, and count the tick in `memory`."""
        return False

    def _reduced(self, model: PayloadModelParameters) -> PayloadController | None:
        """Return a controller of the same law for a smaller team, for its `_fly` alone; None if there is no such law.

        Without one the law goes on after a loss as if nothing had happened.
        """
        return None

    def _tick(self, context: Context, discrete: DiscreteValues) -> None:
        t, model = context.get_time(), self.model
        payload = self._payload.Eval(context)
        memory = context.get_discrete_state(self._filter_index).value()
        quadrotors, cables = self._quadrotors.Eval(context), self._cables.Eval(context)
        filtered = self.position_filter.step(memory, payload[4:7], payload[10:13], self.period)
        discrete.get_mutable_vector(self._filter_index).SetFromVector(filtered)
        before = context.get_discrete_state(self._phase_index).value()
        law = context.get_discrete_state(self._memory_index).value().copy()
        calm = before[0] >= _FLYING and self._nothing_new(context, payload, quadrotors, cables)
        if calm and self._hold(law):
            discrete.get_mutable_vector(self._memory_index).SetFromVector(law)
            return
        reference: Trajectory = self._reference.Eval(context)
        seen = observe(payload, quadrotors, cables)._replace(p=filtered[0:3])
        last = context.get_discrete_state(self._thrust_index).value().reshape(-1, 3)
        if calm:
            self._command(discrete, self._fly(t, seen, reference, last, law), law)
            return
        grounded = bool(reference.phases) and reference.phases[0].name == "ground"
        losses, fresh = self._losses(context, before[0] >= _FLYING, seen)
        noise = self.position_filter.position_noise
        following = self.take_off.next_phase(model, before, t, seen, grounded, noise)
        # Whoever lost a gripper before it flew does not fly any more.
        phase = before if losses.lost.any() else following
        flying = bool(phase[0] >= _FLYING)
        law *= not fresh
        thrust = None
        discrete.get_mutable_vector(self._phase_index).SetFromVector(phase)
        discrete.get_mutable_vector(self._losses_index).SetFromVector(losses.pack())
        if losses.lost.any():
            thrust = self._remaining.thrust(t, losses, flying, seen, reference.yaw, last, law)
        elif not flying:
            sample = reference.sample(t)
            thrust = self.take_off.thrust(model, phase, t, seen, sample, sample.p - reference.start)
        if thrust is None:
            thrust = self._fly(t, seen, reference, last, law)
        self._command(discrete, thrust, law)

    def _command(self, discrete: DiscreteValues, thrust: Array, law: Array) -> None:
        discrete.get_mutable_vector(self._memory_index).SetFromVector(law)
        discrete.get_mutable_vector(self._thrust_index).SetFromVector(
            limited(self.model, thrust).ravel()
        )

    def _nothing_new(self, context: Context, *samples: Array) -> bool:
        """Return whether samples are numbers, and every gripper holds and always has."""
        if context.get_discrete_state(self._losses_index).value()[: self.model.n].any():
            return False
        if self._attached.HasValue(context) and self._attached.Eval(context).min() <= 0.5:
            return False
        return isfinite(sum(float(sample.sum()) for sample in samples))

    def _losses(self, context: Context, flying: bool, seen: Observation) -> tuple[Losses, bool]:
        """Return which grippers have let go by now, and whether that is news."""
        known = Losses.unpack(context.get_discrete_state(self._losses_index).value())
        if not self._attached.HasValue(context):
            return known, False
        losses = known.after(
            self._attached.Eval(context) > 0.5, flying, seen, self.model.cable_length
        )
        return losses, losses is not known

    def _calc_phase(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([max(context.get_discrete_state(self._phase_index).value()[0], 0.0)])

    def _calc_position(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state(self._filter_index).value()[0:3])


def limited(model: PayloadModelParameters, thrust: Array) -> Array:
    """Return thrust vectors (n, 3) [N] whose sizes respect the limits; the direction is kept, non-finite is hover."""
    size = np.sqrt((thrust * thrust).sum(-1))
    if not np.isfinite(size).all():
        rest = np.zeros_like(thrust)
        rest[:, 2] = np.minimum(model.weight / model.n, model.max_thrust)
        thrust = np.where(np.isfinite(size)[:, None], thrust, rest)
        size = np.sqrt((thrust * thrust).sum(-1))
    bound = np.clip(size, model.min_thrust, model.max_thrust)
    return thrust * (bound / np.maximum(size, 1e-9))[:, None]
