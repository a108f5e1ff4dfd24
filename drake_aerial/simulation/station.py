"""The transport station: payload, quadrotors, cables, perception and control as one Diagram with named ports."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import ExternallyAppliedSpatialForceMultiplexer
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, LeafSystem, OutputPort
from pydrake.systems.primitives import (
    ConstantVectorSource,
    Multiplexer,
    VectorLogSink,
    ZeroOrderHold,
)

from drake_aerial.control.allocation import Allocation
from drake_aerial.control.attitude import AttitudeController
from drake_aerial.control.controller import PayloadController
from drake_aerial.control.motor_lead import MotorLead
from drake_aerial.control.take_off import FlightPhase
from drake_aerial.errors import InputError
from drake_aerial.estimation.state_sensor import StateSensor
from drake_aerial.geometry import Array
from drake_aerial.plant.cable import add_cable
from drake_aerial.plant.cable_forces import connect_cables
from drake_aerial.plant.gripper import add_gripper
from drake_aerial.plant.motor_lag import MotorLag
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.payload_body import add_payload
from drake_aerial.plant.quadrotor import add_quadrotor, connect_propellers
from drake_aerial.plant.wind import Wind, connect_wind
from drake_aerial.plant.world import add_ground, add_plant
from drake_aerial.references.trajectory import Trajectory
from drake_aerial.simulation.resting_state import place_at_rest
from drake_aerial.simulation.station_check import check_station
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.statics.gravity import GRAVITY

LOG_PERIOD = 0.01
"""Of the logs of a station [s]."""


class TransportStation(Diagram):
    """n quadrotors that carry one payload, with all that flies them.

    Exported ports, `<instance>.<port>`:

    | port | size | meaning |
    |---|---|---|
    | in `controller.reference` | abstract | a `Trajectory` (with a controller inside) |
    | in `attitude.thrust_vectors` | 3 n | commanded thrusts in the world [N] (without a controller inside) |
    | out `payload.state` | 13 | w x y z, position, angular and linear velocity of L in the world |
    | out `quadrotors.state` | 13 n | the same of each Q |
    | out `perception.payload_state`, `.quadrotor_states`, `.cable_directions`, `.attached` | 13, 13 n, 6 n, n | what is measured |
    | out `cables.tension` | n | [N] |
    | out `cables.attached` | n | 1 where a gripper holds, 0 where it let go |
    | out `controller.thrust_vectors`, `controller.phase` | 3 n, 1 | (with a controller inside) |
    | out `propellers.command` | 4 n | squared speeds within their limits [rpm^2] |
    | out `propellers.squared_speed` | 4 n | [rpm^2]; the command itself where motors have no lag |
    | out `wind.velocity` | 3 | of the air in the world [m/s] (with wind) |
    | out `plant.contact_results`, `scene_graph.query` | abstract | Drake's own |

    Made by `make_transport_station`. It may serve any number of trials, each with a fresh context (`place`): Drake never frees a
    diagram that holds Python systems.
    """

    def __init__(
        self,
        payload: Payload,
        p_LC: ArrayLike,
        normal_L: ArrayLike,
        controller: LeafSystem | None,
        parameters: StationParameters,
        force: bool = False,
    ):
        super().__init__()
        contacts = np.asarray(p_LC, dtype=float).reshape(-1, 3)
        normals = np.broadcast_to(np.asarray(normal_L, dtype=float), contacts.shape)
        n = len(contacts)
        check_station(payload, contacts, parameters, force)
        self.payload, self.p_LC, self.parameters, self.n = payload, contacts, parameters, n
        self.controller = controller
        builder = DiagramBuilder()
        self.plant, self.scene_graph = add_plant(builder, parameters.step)
        self.ground = add_ground(self.plant)
        self.payload_body = add_payload(self.plant, payload)
        names = ("",) if n == 1 else tuple(f"_{i}" for i in range(n))
        self.quadrotors = [
            add_quadrotor(self.plant, p, f"quadrotor{k}")
            for p, k in zip(parameters.quadrotors(n), names, strict=True)
        ]
        cables, grippers = parameters.cables(n), parameters.grippers(n)
        self.cables = []
        for i, k in enumerate(names):
            gripper = add_gripper(
                self.plant, self.payload_body, contacts[i], normals[i], grippers[i], f"gripper{k}"
            )
            self.cables.append(
                add_cable(self.plant, self.quadrotors[i], gripper, cables[i], f"cable{k}")
            )
        self.plant.Finalize()
        self._logged: list[OutputPort] = []
        self._logs: dict[str, slice] = {}
        self._wire(builder)
        self._add_log(builder)
        builder.BuildInto(self)
        self.set_name("transport_station")

    def _wire(self, builder: DiagramBuilder) -> None:
        plant, n, parameters = self.plant, self.n, self.parameters
        payload_state = plant.get_state_output_port(self.payload_body.model_instance)
        states = builder.AddNamedSystem("quadrotor_states", Multiplexer([13] * n))
        for i, quadrotor in enumerate(self.quadrotors):
            builder.Connect(
                plant.get_state_output_port(quadrotor.model_instance), states.get_input_port(i)
            )
        quadrotor_states = states.get_output_port()

        self.perception = builder.AddNamedSystem(
            "perception",
            StateSensor(
                self.p_LC,
                period=parameters.perception_period,
                noise=parameters.noise,
                measured_directions=parameters.measured_directions,
                time_step=parameters.step,
            ),
        )
        builder.Connect(payload_state, self.perception.GetInputPort("payload_state"))
        builder.Connect(quadrotor_states, self.perception.GetInputPort("quadrotor_states"))
        accelerations = builder.AddNamedSystem("quadrotor_accelerations", Multiplexer([6] * n))
        for i, quadrotor in enumerate(self.quadrotors):
            port = plant.get_generalized_acceleration_output_port(quadrotor.model_instance)
            builder.Connect(port, accelerations.get_input_port(i))
        builder.Connect(
            plant.get_generalized_acceleration_output_port(self.payload_body.model_instance),
            self.perception.GetInputPort("payload_acceleration"),
        )
        builder.Connect(
            accelerations.get_output_port(), self.perception.GetInputPort("quadrotor_accelerations")
        )

        team = parameters.quadrotors(n)
        propellers = [
            Allocation(
                q.propeller_positions,
                q.thrust_coefficient,
                q.thrust_coefficient * q.drag_ratio * q.propeller_spins,
                q.min_rpm,
                q.max_rpm,
            )
            for q in team
        ]
        inertia = np.stack([np.diag(q.inertia) for q in team])
        self.attitude = builder.AddNamedSystem("attitude", AttitudeController(propellers, inertia))
        builder.Connect(quadrotor_states, self.attitude.GetInputPort("quadrotor_states"))
        commands, forces = connect_propellers(
            builder, plant, self.quadrotors, motor_lag=parameters.motor_lag
        )
        wanted = self.attitude.GetOutputPort("propeller_commands")
        self.hold: ZeroOrderHold | None = None
        if parameters.attitude_period != 0.0:
            # Two steps after the sensor: the controller's tick is over by then, and it holds what follows from the newest sample.
            hold = ZeroOrderHold(parameters.attitude_period, 4 * n, 2.0 * parameters.step)
            self.hold = builder.AddNamedSystem("attitude_hold", hold)
            builder.Connect(wanted, hold.get_input_port())
            wanted = hold.get_output_port()
        self.motor_lead: MotorLead | None = None
        if parameters.motor_lag != 0.0 and parameters.motor_lead:
            lead = MotorLead(propellers, parameters.motor_lag, parameters.step)
            self.motor_lead = builder.AddNamedSystem("motor_lead", lead)
            builder.Connect(wanted, lead.get_input_port())
            wanted = lead.get_output_port()
        builder.Connect(wanted, commands)

        self.cable_system = connect_cables(
            builder, plant, self.cables, payload_state, quadrotor_states
        )
        builder.Connect(self.cable_system.attached_port, self.perception.GetInputPort("attached"))
        applied = (
            [forces] if self.cable_system.forces is None else [forces, self.cable_system.forces]
        )
        self.wind: Wind | None = None
        if parameters.wind is not None:
            states = (payload_state, quadrotor_states)
            self.wind, push = connect_wind(
                builder, plant, self.payload_body, self.quadrotors, *states, parameters.wind
            )
            applied.append(push)
            self._export(builder, self.wind.get_output_port(), "wind.velocity", log=True)
        if len(applied) > 1:
            total = builder.AddNamedSystem(
                "forces", ExternallyAppliedSpatialForceMultiplexer(len(applied))
            )
            for k, port in enumerate(applied):
                builder.Connect(port, total.get_input_port(k))
            applied = [total.get_output_port()]
        builder.Connect(applied[0], plant.get_applied_spatial_force_input_port())

        limited = turning = commands.get_system().get_output_port(0)
        self.motors: MotorLag | None = None
        if parameters.motor_lag != 0.0:
            self.motors = builder.GetMutableSubsystemByName("propellers_lag")
            turning = self.motors.get_output_port()
        self._export(builder, payload_state, "payload.state", log=True)
        self._export(builder, quadrotor_states, "quadrotors.state", log=True)
        self._export(builder, self.cable_system.tension, "cables.tension", log=True)
        self._export(builder, limited, "propellers.command", log=True)
        self._export(builder, turning, "propellers.squared_speed", log=True)
        self._export(builder, self.cable_system.attached_port, "cables.attached", log=True)
        for name in ("payload_state", "quadrotor_states", "cable_directions", "attached"):
            self._export(builder, self.perception.GetOutputPort(name), f"perception.{name}")
        self._export(builder, plant.get_contact_results_output_port(), "plant.contact_results")
        self._export(builder, self.scene_graph.get_query_output_port(), "scene_graph.query")
        if self.controller is None:
            builder.ExportInput(
                self.attitude.GetInputPort("thrust_vectors"), "attitude.thrust_vectors"
            )
            return
        controller = builder.AddNamedSystem("controller", self.controller)
        if not controller.HasOutputPort("thrust_vectors"):
            raise InputError(
                f"a controller needs an output port thrust_vectors ({3 * n}), in the world [N]; this one has none"
            )
        # A controller need not look at everything.
        for name in ("payload_state", "quadrotor_states", "cable_directions", "attached"):
            if controller.HasInputPort(name):
                builder.Connect(self.perception.GetOutputPort(name), controller.GetInputPort(name))
        thrusts = controller.GetOutputPort("thrust_vectors")
        builder.Connect(thrusts, self.attitude.GetInputPort("thrust_vectors"))
        if controller.HasInputPort("reference"):
            builder.ExportInput(controller.GetInputPort("reference"), "controller.reference")
        self._export(builder, thrusts, "controller.thrust_vectors", log=True)
        if controller.HasOutputPort("phase"):
            phase = controller.GetOutputPort("phase")
        else:
            # One that does not say takes itself for flying from the start.
            phase = builder.AddNamedSystem(
                "phase", ConstantVectorSource([float(FlightPhase.FLYING)])
            ).get_output_port()
        self._export(builder, phase, "controller.phase", log=True)

    def _export(
        self, builder: DiagramBuilder, port: OutputPort, name: str, *, log: bool = False
    ) -> None:
        builder.ExportOutput(port, name)
        if log:
            begin = sum(other.size() for other in self._logged)
            self._logs[name] = slice(begin, begin + port.size())
            self._logged.append(port)

    def _add_log(self, builder: DiagramBuilder) -> None:
        """Log what is to be logged by one system: the simulator asks every system at every step what it has to do."""
        together = builder.AddNamedSystem(
            "logged", Multiplexer([port.size() for port in self._logged])
        )
        for k, port in enumerate(self._logged):
            builder.Connect(port, together.get_input_port(k))
        self._log = builder.AddNamedSystem(
            "log", VectorLogSink(together.get_output_port().size(), LOG_PERIOD)
        )
        builder.Connect(together.get_output_port(), self._log.get_input_port())

    def place(
        self, context: Context, *, seed: int = 0, reference: Trajectory | None = None
    ) -> Trajectory | None:
        """Set up a trial in a fresh context, at rest, with L's origin above the world's.

        The payload stands on the ground and each quadrotor is in the air straight above its contact, its cable slack by
        `initial_slack`; or, for a reference that does not begin on the ground, the payload hangs level (from one cable: as it comes to
        rest) at `airborne_height` over where it would stand, its cables taut and vertical.

        Parameters
        ----------
        context : Context
            Of this station (`CreateDefaultContext`), or of a diagram that holds it if no reference is given.
        seed : int
            Of the measurement noise and the wind.
        reference : Trajectory, optional
            Fixed to the port `controller.reference`, moved so that it starts where the payload is.

        Returns
        -------
        The moved trajectory, or None.
        """
        parameters = self.parameters
        airborne = (
            reference is not None
            and bool(reference.phases)
            and reference.phases[0].name != "ground"
        )
        p_WL, carried = place_at_rest(self, context, airborne)
        self.perception.set_seed(self.perception.GetMyMutableContextFromRoot(context), seed)
        if self.wind is not None:
            self.wind.set_seed(self.wind.GetMyMutableContextFromRoot(context), seed)
        # Pushing and turning as they must for what each carries now; the controller's first tick is one step away.
        team = parameters.quadrotors(self.n)
        thrust = GRAVITY * np.array([q.mass for q in team]) + carried
        squares = np.repeat(
            [u / (4.0 * q.thrust_coefficient) for u, q in zip(thrust, team, strict=True)], 4
        )
        if isinstance(self.controller, PayloadController):
            upwards = thrust[:, None] * np.array([0.0, 0.0, 1.0])
            self.controller.set_thrusts(
                self.controller.GetMyMutableContextFromRoot(context), upwards
            )
        if self.motors is not None:
            self.motors.set_speeds(
                self.motors.GetMyMutableContextFromRoot(context), np.sqrt(squares)
            )
        if self.motor_lead is not None:
            self.motor_lead.set_speeds(
                self.motor_lead.GetMyMutableContextFromRoot(context), np.sqrt(squares)
            )
        if self.hold is not None:
            self.hold.SetVectorState(self.hold.GetMyMutableContextFromRoot(context), squares)
        if reference is None:
            return None
        moved = reference.starting_at(p_WL)
        if self.HasInputPort("controller.reference"):
            self.GetInputPort("controller.reference").FixValue(context, AbstractValue.Make(moved))
        return moved

    def log(self, root_context: Context, name: str) -> tuple[Array, Array]:
        """Return times (T,) [s] and values (T, size) of a logged output port, by its exported name."""
        if name not in self._logs:
            raise InputError(f"no log of {name!r}: give one of {', '.join(self._logs)}")
        log = self._log.FindLog(root_context)
        return np.array(log.sample_times()), np.array(log.data()[self._logs[name]].T)


def make_transport_station(
    payload: Payload,
    p_LC: ArrayLike,
    normal_L: ArrayLike = (0.0, 0.0, 1.0),
    *,
    controller: LeafSystem | None = None,
    parameters: StationParameters | None = None,
    force: bool = False,
) -> TransportStation:
    """Return the Diagram of n quadrotors that carry a payload.

    Parameters
    ----------
    payload : Payload
        In the tracked frame L (`Payload.in_tracked_frame`), z up at rest.
    p_LC : (n, 3)
        Contacts in L [m], one per quadrotor.
    normal_L : (n, 3) or (3,)
        Outward surface normals there.
    controller : LeafSystem, optional
        A `PayloadController`; without one the station takes thrust vectors at its port `attitude.thrust_vectors`.
    parameters : StationParameters, optional
    force : bool
        Whether a team is accepted that cannot lift its payload.

    Raises
    ------
    InputError
        If the propellers cannot lift the weight, the elastic cables' step is unstable, or a parameter is bad.

    Examples
    --------
    >>> from drake_aerial import Payload, make_transport_station
    >>> station = make_transport_station(Payload.from_box([0.4, 0.4, 0.2], 0.25), [[0.0, 0.0, 0.1]])
    >>> station.GetOutputPort("cables.tension").size(), station.GetInputPort("attitude.thrust_vectors").size()
    (1, 3)
    """
    return TransportStation(
        payload, p_LC, normal_L, controller, parameters or StationParameters(), force
    )
