"""Propulsion of n quadrotors: from commanded thrust vectors to the forces of the propellers."""

from dataclasses import dataclass

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    DiscreteValues,
    InputPort,
    LeafSystem,
    OutputPort,
)

from drake_aerial.control.allocation import Allocation
from drake_aerial.control.attitude import AttitudeController
from drake_aerial.control.motor_lead import MotorLead
from drake_aerial.geometry import Array
from drake_aerial.plant.motor_lag import MotorLag
from drake_aerial.plant.quadrotor import Quadrotor, connect_propellers
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.statics.gravity import GRAVITY


class CommandHold(LeafSystem):
    """Zero-order hold of commands with an initial value.

    | port | size | meaning |
    |---|---|---|
    | in `command` | N | |
    | out `command` | N | the command at the last sample |

    Parameters
    ----------
    initial : (N,) array
        Output before the first sample, in a new context.
    period, offset : float
        Samples are taken at offset + k period [s].
    """

    def __init__(self, initial: Array, period: float, offset: float):
        super().__init__()
        self._command = self.DeclareVectorInputPort("command", len(initial))
        self.DeclareStateOutputPort("command", self.DeclareDiscreteState(initial))
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._sample)

    def set_command(self, context: Context, command: Array) -> None:
        """Set the output (N,) in this system's context."""
        context.get_mutable_discrete_state_vector().SetFromVector(command)

    def _sample(self, context: Context, discrete_state: DiscreteValues) -> None:
        discrete_state.get_mutable_vector().SetFromVector(self._command.Eval(context))


@dataclass(frozen=True, eq=False)
class Propulsion:
    """Attitude loop and propellers of n quadrotors in a diagram, made by `add_propulsion`.

    Attributes
    ----------
    quadrotors : list of n Quadrotor
    thrust_vectors : InputPort
        Commanded thrusts (3 n) in the world [N].
    forces : OutputPort
        Spatial forces for the plant's applied_spatial_force port.
    command : OutputPort
        Commanded squared speeds (4 n) within their limits [rpm^2].
    squared_speed : OutputPort
        Squared speeds (4 n) [rpm^2]; the command itself without motor lag.
    hold : CommandHold or None
        Hold of the commands (`attitude_period`).
    motor_lead : MotorLead or None
    motor_lag : MotorLag or None
    """

    quadrotors: list[Quadrotor]
    thrust_vectors: InputPort
    forces: OutputPort
    command: OutputPort
    squared_speed: OutputPort
    hold: CommandHold | None
    motor_lead: MotorLead | None
    motor_lag: MotorLag | None

    def set_thrusts(self, root_context: Context, thrusts: Array) -> None:
        """Set commands and speeds to those of thrusts (n,) [N]."""
        squares = _squared_speeds(self.quadrotors, thrusts)
        for motors in (self.motor_lag, self.motor_lead):
            if motors is not None:
                context = motors.GetMyMutableContextFromRoot(root_context)
                motors.set_speeds(context, np.sqrt(squares))
        if self.hold is not None:
            context = self.hold.GetMyMutableContextFromRoot(root_context)
            self.hold.set_command(context, squares)


def add_propulsion(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    quadrotors: list[Quadrotor],
    quadrotor_states: OutputPort,
    parameters: StationParameters,
) -> Propulsion:
    """Add attitude loop, hold, motor lead, propeller limits, motor lag and propellers.

    In a new context commands and speeds are those that carry the quadrotors alone.

    Parameters
    ----------
    builder : DiagramBuilder
    plant : MultibodyPlant
        Finalized.
    quadrotors : list of n Quadrotor
    quadrotor_states : OutputPort
        States of the quadrotors (13 n).
    parameters : StationParameters
        Of which `attitude_period`, `motor_lag` and `motor_lead` are used.
    """
    team = [quadrotor.parameters for quadrotor in quadrotors]
    hover = _squared_speeds(quadrotors, GRAVITY * np.array([q.mass for q in team]))
    attitude = builder.AddNamedSystem("attitude", AttitudeController.of_quadrotors(team))
    builder.Connect(quadrotor_states, attitude.GetInputPort("quadrotor_states"))
    lag_time = parameters.motor_lag
    wanted, hold, lead = attitude.GetOutputPort("propeller_commands"), None, None
    if parameters.attitude_period != 0.0:
        # Two steps after the sensor, so that it holds the command from the newest sample.
        hold = builder.AddNamedSystem(
            "attitude_hold",
            CommandHold(hover, parameters.attitude_period, 2.0 * parameters.step),
        )
        builder.Connect(wanted, hold.get_input_port())
        wanted = hold.get_output_port()
    if lag_time != 0.0 and parameters.motor_lead:
        propellers = [Allocation.of_quadrotor(q) for q in team]
        lead = builder.AddNamedSystem(
            "motor_lead", MotorLead(propellers, lag_time, parameters.step, initial=np.sqrt(hover))
        )
        builder.Connect(wanted, lead.get_input_port())
        wanted = lead.get_output_port()
    commands, forces = connect_propellers(
        builder, plant, quadrotors, motor_lag=lag_time, initial_speeds=np.sqrt(hover)
    )
    builder.Connect(wanted, commands)
    command = squared_speed = commands.get_system().get_output_port(0)
    lag: MotorLag | None = None
    if lag_time != 0.0:
        lag = builder.GetMutableSubsystemByName("propellers_lag")
        squared_speed = lag.get_output_port()
    thrust_vectors = attitude.GetInputPort("thrust_vectors")
    return Propulsion(quadrotors, thrust_vectors, forces, command, squared_speed, hold, lead, lag)


def _squared_speeds(quadrotors: list[Quadrotor], thrusts: Array) -> Array:
    """Return squared speeds (4 n) [rpm^2] of thrusts (n,) [N] by four equal propellers each."""
    coefficients = np.array([q.parameters.thrust_coefficient for q in quadrotors])
    return np.repeat(thrusts / (4.0 * coefficients), 4)
