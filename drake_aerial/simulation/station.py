"""The transport station: payload, quadrotors, cables, sensor and control as one Diagram."""

import numpy as np
from numpy.typing import ArrayLike
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import ExternallyAppliedSpatialForceMultiplexer
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import ConstantVectorSource

from drake_aerial.control.controller import PayloadController
from drake_aerial.control.take_off import FlightPhase
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.plant.air_drag import connect_air
from drake_aerial.plant.cable_forces import connect_cables
from drake_aerial.plant.part_checks import check_type, parameters_or_default
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.wind import Wind
from drake_aerial.references.trajectory import Trajectory
from drake_aerial.simulation.port_log import PortLog
from drake_aerial.simulation.propulsion import add_propulsion
from drake_aerial.simulation.sensing import Ports, add_sensing
from drake_aerial.simulation.station_check import check_contacts, check_station
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.simulation.station_plant import add_station_plant, place_at_rest
from drake_aerial.statics.gravity import GRAVITY


class TransportStation(Diagram):
    """n quadrotors that carry one payload, with sensor, attitude loop and propellers.

    Exported ports, `<instance>.<port>`:

    | port | size | meaning |
    |---|---|---|
    | in `controller.reference` | abstract | a `Trajectory` (with a controller inside) |
    | in `attitude.thrust_vectors` | 3 n | commanded thrusts in the world [N] (without one) |
    | out `payload.state` | 13 | w x y z, position, angular and linear velocity of L in the world |
    | out `quadrotors.state` | 13 n | the same of each Q |
    | out `perception.payload_state` | 13 | sampled state of L, with noise |
    | out `perception.quadrotor_states` | 13 n | sampled states of the Q |
    | out `perception.cable_directions` | 6 n | sampled unit directions and their rates [1/s] |
    | out `perception.attached` | n | sampled `cables.attached` |
    | out `perception.imu` | 6 n | specific force [m/s^2] and rate [rad/s] in Q (with `sensors`) |
    | out `perception.rotor_speeds` | 4 n | [rpm] (with `sensors`) |
    | out `cables.tension` | n | [N] |
    | out `cables.attached` | n | 1 where a gripper holds, 0 where it was released |
    | out `controller.thrust_vectors` | 3 n | commanded thrusts [N] (with a controller inside) |
    | out `controller.phase` | 1 | `FlightPhase` (with a controller inside) |
    | out `propellers.command` | 4 n | squared speeds within their limits [rpm^2] |
    | out `propellers.squared_speed` | 4 n | [rpm^2]; the command itself without motor lag |
    | out `wind.velocity` | 3 | velocity of the air in the world [m/s] (with wind) |
    | out `plant.contact_results`, `scene_graph.query` | abstract | Drake's own |

    A new context is at rest: the payload on the ground and each quadrotor in the air straight above
    its contact, the cable slack by `initial_slack`. So `SetRandomContext` and Drake's Monte Carlo
    tools start there too. `place` sets up a trial with a seed and a reference. `install` makes a
    simulation release overloaded grippers.

    Made by `make_transport_station`, for any number of trials, each with a new context: Drake never
    frees a diagram that holds Python systems.
    """

    def __init__(
        self,
        payload: Payload,
        p_LC: ArrayLike,
        normal_L: ArrayLike,
        controller: System | None,
        parameters: StationParameters,
        force: bool = False,
    ):
        super().__init__()
        contacts, normals = check_contacts(payload, p_LC, normal_L)
        check_station(payload, contacts, parameters, force)
        if controller is not None:
            check_type("controller", controller, System)
        self.payload, self.p_LC, self.n = payload, contacts, len(contacts)
        self.controller, self.parameters = controller, parameters
        self._log = PortLog()
        builder = DiagramBuilder()
        parts = add_station_plant(builder, payload, contacts, normals, parameters)
        self.plant, self.scene_graph, self.ground = parts.plant, parts.scene_graph, parts.ground
        self.payload_body, self.quadrotors = parts.payload, parts.quadrotors
        self.cables = parts.cables
        states = parts.connect_states(builder)
        self.sensing = add_sensing(
            builder, contacts, states, parts.connect_accelerations(builder), parameters
        )
        self.perception = self.sensing.perception
        self.propulsion = add_propulsion(
            builder, self.plant, self.quadrotors, states[1], parameters
        )
        if self.perception.HasInputPort("squared_speeds"):
            speeds = self.perception.GetInputPort("squared_speeds")
            builder.Connect(self.propulsion.squared_speed, speeds)
        self._add_cables(builder, states)
        self._add_air(builder, states)
        self._sum_forces(builder, self.propulsion.forces, self.cable_system.forces)
        self._export_ports(builder, states)
        self._connect_controller(builder)
        self._log.connect(builder)
        builder.BuildInto(self)
        self.set_name("transport_station")

    def _add_cables(self, builder: DiagramBuilder, states: Ports) -> None:
        """Add the system of the cables; the sensor samples which grippers hold."""
        self.cable_system = connect_cables(builder, self.plant, self.cables, *states)
        builder.Connect(self.cable_system.attached_port, self.perception.GetInputPort("attached"))

    def _add_air(self, builder: DiagramBuilder, states: Ports) -> None:
        """Add wind and the forces of the air, if there is air."""
        self.wind: Wind | None = None
        air, wind = self.parameters.air, self.parameters.wind
        if air is None:
            return
        parts = self.plant, self.payload_body, self.quadrotors
        self.wind, forces = connect_air(builder, *parts, *states, air, wind)
        if self.wind is not None:
            self._log.export(builder, self.wind.get_output_port(), "wind.velocity")
        builder.Connect(forces, self.plant.get_applied_generalized_force_input_port())

    def _sum_forces(self, builder: DiagramBuilder, *forces: OutputPort | None) -> None:
        """Apply the forces to the plant."""
        ports = [port for port in forces if port is not None]
        total = ExternallyAppliedSpatialForceMultiplexer(len(ports))
        builder.AddNamedSystem("forces", total)
        for k, port in enumerate(ports):
            builder.Connect(port, total.get_input_port(k))
        builder.Connect(total.get_output_port(), self.plant.get_applied_spatial_force_input_port())

    def _export_ports(self, builder: DiagramBuilder, states: Ports) -> None:
        """Export the output ports that every station has."""
        payload_state, quadrotor_states = states
        self._log.export(builder, payload_state, "payload.state")
        self._log.export(builder, quadrotor_states, "quadrotors.state")
        self._log.export(builder, self.cable_system.tension, "cables.tension")
        self._log.export(builder, self.propulsion.command, "propellers.command")
        self._log.export(builder, self.propulsion.squared_speed, "propellers.squared_speed")
        self._log.export(builder, self.cable_system.attached_port, "cables.attached")
        for name, port in self.sensing.measured().items():
            builder.ExportOutput(port, f"perception.{name}")
        contacts = self.plant.get_contact_results_output_port()
        builder.ExportOutput(contacts, "plant.contact_results")
        builder.ExportOutput(self.scene_graph.get_query_output_port(), "scene_graph.query")

    def _connect_controller(self, builder: DiagramBuilder) -> None:
        """Add the controller, or export the port of the commanded thrusts without one."""
        commanded = self.propulsion.thrust_vectors
        if self.controller is None:
            builder.ExportInput(commanded, "attitude.thrust_vectors")
            return
        controller = builder.AddNamedSystem("controller", self.controller)
        name, size = "thrust_vectors", 3 * self.n
        if not controller.HasOutputPort(name) or controller.GetOutputPort(name).size() != size:
            raise InputError(
                f"`controller` must have an output port {name} of size {size}: thrusts in the "
                "world [N]"
            )
        self.sensing.connect(builder, controller)
        thrusts = controller.GetOutputPort("thrust_vectors")
        builder.Connect(thrusts, commanded)
        if controller.HasInputPort("reference"):
            builder.ExportInput(controller.GetInputPort("reference"), "controller.reference")
        self._log.export(builder, thrusts, "controller.thrust_vectors")
        if controller.HasOutputPort("phase"):
            phase = controller.GetOutputPort("phase")
        else:  # such a controller flies from the start
            flying = ConstantVectorSource([float(FlightPhase.FLYING)])
            phase = builder.AddNamedSystem("phase", flying).get_output_port()
        self._log.export(builder, phase, "controller.phase")

    def place(
        self, context: Context, *, seed: int = 0, reference: Trajectory | None = None
    ) -> Trajectory | None:
        """Set up a trial at rest in a new context, with L's origin above the world's.

        The payload stands on the ground and each quadrotor is in the air straight above its
        contact, with its cable slack by `initial_slack`. If the reference does not begin on the
        ground, the payload hangs `airborne_height` above its height on the ground, with taut
        vertical cables; it is level, or from one cable as it comes to rest.

        Parameters
        ----------
        context : Context
            Context of this station, or without a reference of a diagram that holds it.
        seed : int
            Random seed of the measurement noise and the wind.
        reference : Trajectory, optional
            Trajectory for the port `controller.reference`, moved to start where the payload is.

        Returns
        -------
        The moved trajectory, or None.
        """
        phases = () if reference is None else reference.phases
        airborne = bool(phases) and phases[0].name != "ground"
        plant_context = self.plant.GetMyMutableContextFromRoot(context)
        p_WL, carried = place_at_rest(
            self.plant, plant_context, self.cables, self.parameters, airborne
        )
        for system in (self.perception, self.wind):
            if system is not None:
                system.set_seed(system.GetMyMutableContextFromRoot(context), seed)
        # Thrust that holds what each quadrotor carries now, until the controller's first step.
        masses = np.array([quadrotor.parameters.mass for quadrotor in self.quadrotors])
        thrusts = GRAVITY * masses + carried
        self.propulsion.set_thrusts(context, thrusts)
        if isinstance(self.controller, PayloadController):
            self.controller.set_thrusts(
                self.controller.GetMyMutableContextFromRoot(context),
                thrusts[:, None] * np.array([0.0, 0.0, 1.0]),
            )
        if reference is None:
            return None
        moved = reference.starting_at(p_WL)
        if self.HasInputPort("controller.reference"):
            self.GetInputPort("controller.reference").FixValue(context, AbstractValue.Make(moved))
        return moved

    def install(self, simulator: Simulator) -> None:
        """Install the release of overloaded grippers in a simulation with this station.

        Call it after `set_monitor` and before `Initialize`; see `CableSystem.install`.
        """
        self.cable_system.install(simulator)

    def log(self, root_context: Context, name: str) -> tuple[Array, Array]:
        """Return times (T,) [s] and values (T, size) of a logged output port by its exported name.

        Raises
        ------
        InputError
            If no port of this name is logged.
        """
        return self._log.read(root_context, name)


def make_transport_station(
    payload: Payload,
    p_LC: ArrayLike,
    normal_L: ArrayLike = (0.0, 0.0, 1.0),
    *,
    controller: System | None = None,
    parameters: StationParameters | None = None,
    force: bool = False,
) -> TransportStation:
    """Return the Diagram of n quadrotors that carry a payload.

    Parameters
    ----------
    payload : Payload
        In the tracked frame L (`Payload.in_tracked_frame`), z up at rest.
    p_LC : (n, 3)
        Contacts in L [m], one per quadrotor, at most 2 cm from the payload's surface.
    normal_L : (n, 3) or (3,)
        Outward surface normals at the contacts, of any length but zero.
    controller : System, optional
        A `PayloadController`, or a system with some of its input ports and the output port
        `thrust_vectors`. Without one the station has the input port `attitude.thrust_vectors`.
    parameters : StationParameters, optional
    force : bool
        Whether to accept a team that cannot lift its payload.

    Raises
    ------
    InputError
        If the team cannot lift the payload, a contact is off the surface, the step of the elastic
        cables is unstable, or another parameter is bad.

    Examples
    --------
    >>> from drake_aerial import Payload, make_transport_station
    >>> station = make_transport_station(Payload.from_box([0.4, 0.4, 0.2], 0.25), [[0.0, 0.0, 0.1]])
    >>> station.GetOutputPort("cables.tension").size()
    1
    >>> station.GetInputPort("attitude.thrust_vectors").size()
    3
    """
    parameters = parameters_or_default(parameters, StationParameters)
    return TransportStation(payload, p_LC, normal_L, controller, parameters, force)
