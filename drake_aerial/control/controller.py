"""Base of all controllers of a payload, as a LeafSystem."""

from math import isfinite
from typing import ClassVar

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_aerial.control.controller_parameters import ControllerParameters
from drake_aerial.control.gripper_loss import FlightLaw, GripperLosses, ReducedTeam
from drake_aerial.control.take_off import TakeOff, TakeOffMemory
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.errors import InputError
from drake_aerial.estimation.observation import (
    FilterState,
    Observation,
    PositionFilter,
    observe,
)
from drake_aerial.geometry import Array
from drake_aerial.references.trajectory import HoverTrajectory, Trajectory

OFFSET = 0.001
"""Default delay from a sensor sample to the control step that reads it [s].

It is shorter than a plant step, so commands act from the next plant step on.
"""
PERIOD = 0.02
"""Default period of the control steps [s]."""


class PayloadController(LeafSystem):
    """Base of the controllers: ports, position filter, take-off, gripper losses, thrust limits.

    Derive from it and override `compute_thrusts`; the other methods without an underscore have
    defaults for a law without memory. `FlightOptions` accepts such a class as its `controller`.

    | port | size | meaning | unit | frame |
    |---|---|---|---|---|
    | in `payload_state` | 13 | w x y z, p, angular, linear velocity of L | m, rad/s, m/s | world |
    | in `quadrotor_states` | 13 n | the same of each Q | m, rad/s, m/s | world |
    | in `cable_directions` | 6 n | unit vector quadrotor to contact, rate | -, 1/s | world |
    | in `reference` | abstract | a `Trajectory` over the context's time | - | - |
    | in `attached` | n | 1: gripper attached, 0: released; optional (1) | - | - |
    | out `thrust_vectors` | 3 n | commanded thrusts, held between control steps | N | world |
    | out `phase` | 1 | `FlightPhase` | - | - |
    | out `estimated_position` | 3 | filtered position of L's origin | m | world |

    All state is discrete and in the Context. It changes at the control steps, at times
    `offset + k period`. A control step reads samples taken earlier: with the default offset and a
    sensor that samples at `k period`, 1 ms earlier.

    After a gripper is lost, the remaining quadrotors hold the payload where it was, by the law of
    the smaller team, and the freed one hovers above (`ReducedTeam`). After a loss during take-off,
    the take-off is aborted.

    Parameters
    ----------
    model : PayloadModelParameters
        Believed model.
    period, offset : float
        Period and first time of the control steps [s].
    take_off : TakeOff, optional
    position_filter : PositionFilter, optional
        Filter of the measured payload position.

    Raises
    ------
    InputError
        If the period is not positive, or the offset is not in [0, period).

    Examples
    --------
    >>> from drake_aerial import FlightOptions, PayloadController
    >>> class Constant(PayloadController):
    ...     def compute_thrusts(self, t, observation, reference, thrust, memory):
    ...         return thrust
    >>> FlightOptions(controller=Constant).controller_name
    'Constant'
    """

    default_parameters: ClassVar[ControllerParameters | None] = None
    """Parameters that the constructor takes after the model; None: `period` and so on instead."""

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
        if not period > 0.0:
            raise InputError(f"`period` must be positive [s], got {period}")
        if not 0.0 <= offset < period:
            raise InputError(f"`offset` must be in [0, period) = [0, {period}) s, got {offset}")
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
        self._phase_index = self.DeclareDiscreteState(TakeOffMemory.initial(n).pack())
        self._filter_index = self.DeclareDiscreteState(FilterState.initial().pack())
        self._memory_index = self.DeclareDiscreteState(self.initial_memory())
        self._losses_index = self.DeclareDiscreteState(np.zeros(GripperLosses.size(n)))
        self._reduced = ReducedTeam(model, self.take_off, self.for_smaller_team)
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._control_step)
        ticket = {self.all_state_ticket()}
        self.DeclareStateOutputPort("thrust_vectors", self._thrust_index)
        self.DeclareVectorOutputPort("phase", 1, self._calc_phase, ticket)
        self.DeclareVectorOutputPort("estimated_position", 3, self._calc_position, ticket)

    def compute_thrusts(
        self,
        t: float,
        observation: Observation,
        reference: Trajectory,
        thrust: Array,
        memory: Array,
    ) -> Array:
        """Return the commanded thrusts of the flight law; every derived class overrides this.

        It is called at every control step once the payload hangs. The result is limited to the
        model's thrust limits; a thrust that is not finite becomes hover thrust.

        Parameters
        ----------
        t : float
            Time of the control step [s].
        observation : Observation
            Measured state, with filtered payload position.
        reference : Trajectory
        thrust : (n, 3) array
            Last command, in the world [N].
        memory : array
            State of the law between control steps, to be updated in place. Zeros mean
            that flight begins. Its length is that of `initial_memory`.

        Returns
        -------
        (n, 3) array
            In the world [N].
        """
        raise NotImplementedError(f"{type(self).__name__} must override compute_thrusts")

    def initial_memory(self) -> Array:
        """Return the initial memory of `compute_thrusts`; empty by default.

        It is called in the constructor of the base, so set the attributes that it needs before
        `super().__init__`.
        """
        return np.zeros(0)

    def holds_plan(self, memory: Array) -> bool:
        """Return True if the last command is kept at this control step; False by default.

        It is called before `compute_thrusts`. It may update `memory` in place, for instance to
        count the steps since the last plan.
        """
        return False

    def for_smaller_team(self, model: PayloadModelParameters) -> FlightLaw | None:
        """Return the same law for a team that lost grippers, or None (default) if there is none.

        Its `compute_thrusts`, `holds_plan` and `initial_memory` are used; its memory must not be
        longer than that of the whole team. Without such a law, `compute_thrusts` is called after a
        loss as before it.
        """
        return None

    def set_thrusts(self, context: Context, thrust: Array) -> None:
        """Set the thrusts (n, 3) [N] that this context commands until the first control step.

        The default is the minimum thrust.
        """
        command = limited(self.model, np.asarray(thrust, dtype=float)).ravel()
        context.get_mutable_discrete_state(self._thrust_index).SetFromVector(command)

    def _control_step(self, context: Context, discrete: DiscreteValues) -> None:
        t = context.get_time()
        payload = self._payload.Eval(context)
        quadrotors, cables = self._quadrotors.Eval(context), self._cables.Eval(context)
        state = FilterState.unpack(context.get_discrete_state(self._filter_index).value())
        state = self.position_filter.step(state, payload[4:7], payload[10:13], self.period)
        discrete.get_mutable_vector(self._filter_index).SetFromVector(state.pack())
        before = TakeOffMemory.unpack(context.get_discrete_state(self._phase_index).value())
        memory = context.get_discrete_state(self._memory_index).value().copy()
        nominal = before.flying and self._is_nominal(context, payload, quadrotors, cables)
        if nominal and self.holds_plan(memory):
            discrete.get_mutable_vector(self._memory_index).SetFromVector(memory)
            return
        reference: Trajectory = self._reference.Eval(context)
        observation = observe(payload, quadrotors, cables)._replace(p=state.p)
        last = context.get_discrete_state(self._thrust_index).value().reshape(-1, 3)
        if nominal:
            thrust = self.compute_thrusts(t, observation, reference, last, memory)
            self._command(discrete, thrust, memory)
            return
        grounded = bool(reference.phases) and reference.phases[0].name == "ground"
        losses, fresh = self._losses(context, before.flying, observation)
        noise = self.position_filter.position_noise
        phase = self.take_off.next_phase(self.model, before, t, observation, grounded, noise)
        # A loss during take-off aborts it.
        phase = before if losses.lost.any() else phase
        memory *= not fresh
        discrete.get_mutable_vector(self._phase_index).SetFromVector(phase.pack())
        discrete.get_mutable_vector(self._losses_index).SetFromVector(losses.pack())
        command: Array | None = None
        if losses.lost.any():
            command = self._reduced.compute_thrusts(
                t, losses, phase.flying, observation, reference.yaw, last, memory
            )
        elif not phase.flying:
            sample = reference.sample(t)
            rise = sample.p - reference.start
            command = self.take_off.compute_thrusts(self.model, phase, t, observation, sample, rise)
        if command is None:
            command = self.compute_thrusts(t, observation, reference, last, memory)
        self._command(discrete, command, memory)

    def _command(self, discrete: DiscreteValues, thrust: Array, memory: Array) -> None:
        discrete.get_mutable_vector(self._memory_index).SetFromVector(memory)
        command = limited(self.model, thrust).ravel()
        discrete.get_mutable_vector(self._thrust_index).SetFromVector(command)

    def _is_nominal(self, context: Context, *samples: Array) -> bool:
        """Return True if the samples are finite, and all grippers are and were attached."""
        if context.get_discrete_state(self._losses_index).value()[: self.model.n].any():
            return False
        if self._attached.HasValue(context) and self._attached.Eval(context).min() <= 0.5:
            return False
        return isfinite(sum(float(sample.sum()) for sample in samples))

    def _losses(
        self, context: Context, flying: bool, observation: Observation
    ) -> tuple[GripperLosses, bool]:
        """Return the gripper losses, and whether there are new ones."""
        known = GripperLosses.unpack(context.get_discrete_state(self._losses_index).value())
        if not self._attached.HasValue(context):
            return known, False
        attached = self._attached.Eval(context) > 0.5
        losses = known.updated(attached, flying, observation, self.model.cable_length)
        return losses, losses is not known

    def _calc_phase(self, context: Context, output: BasicVector) -> None:
        memory = TakeOffMemory.unpack(context.get_discrete_state(self._phase_index).value())
        output.SetFromVector([max(memory.phase, 0.0)])

    def _calc_position(self, context: Context, output: BasicVector) -> None:
        state = FilterState.unpack(context.get_discrete_state(self._filter_index).value())
        output.SetFromVector(state.p)


def limited(model: PayloadModelParameters, thrust: Array) -> Array:
    """Return thrust vectors (n, 3) [N] scaled into the model's thrust limits.

    A vector that is not finite becomes hover thrust.
    """
    size = np.sqrt((thrust * thrust).sum(-1))
    if not np.isfinite(size).all():
        rest = np.zeros_like(thrust)
        rest[:, 2] = np.minimum(model.weight / model.n, model.max_thrust)
        thrust = np.where(np.isfinite(size)[:, None], thrust, rest)
        size = np.sqrt((thrust * thrust).sum(-1))
    bound = np.clip(size, model.min_thrust, model.max_thrust)
    return thrust * (bound / np.maximum(size, 1e-9))[:, None]
