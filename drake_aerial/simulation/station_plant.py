"""The plant of a station: ground, payload, and n quadrotors with cables and grippers."""

from __future__ import annotations

from dataclasses import dataclass

from pydrake.geometry import GeometryId, SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import Multiplexer

from drake_aerial.geometry import Array
from drake_aerial.plant.cable import Cable, add_cable
from drake_aerial.plant.gripper import add_gripper
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.payload_body import PayloadBody, add_payload
from drake_aerial.plant.quadrotor import Quadrotor, add_quadrotor
from drake_aerial.plant.world import add_ground, add_plant
from drake_aerial.simulation.station_parameters import StationParameters


@dataclass(frozen=True, eq=False)
class StationPlant:
    """A finalized plant and its parts, made by `add_station_plant`.

    Attributes
    ----------
    plant : MultibodyPlant
    scene_graph : SceneGraph
    ground : GeometryId
        Collision geometry of the ground.
    payload : PayloadBody
    quadrotors : list of n Quadrotor
    cables : list of n Cable
        In the order of the quadrotors.
    """

    plant: MultibodyPlant
    scene_graph: SceneGraph
    ground: GeometryId
    payload: PayloadBody
    quadrotors: list[Quadrotor]
    cables: list[Cable]

    def connect_states(self, builder: DiagramBuilder) -> tuple[OutputPort, OutputPort]:
        """Return ports of the state of L (13) and of the states of the quadrotors (13 n)."""
        port = self.plant.get_state_output_port
        states = [port(quadrotor.model_instance) for quadrotor in self.quadrotors]
        return port(self.payload.model_instance), _join(builder, "quadrotor_states", states)

    def connect_accelerations(self, builder: DiagramBuilder) -> tuple[OutputPort, OutputPort]:
        """Return ports of the accelerations of L (6) and of the quadrotors (6 n).

        Angular [rad/s^2], then linear [m/s^2], in the world.
        """
        port = self.plant.get_generalized_acceleration_output_port
        each = [port(quadrotor.model_instance) for quadrotor in self.quadrotors]
        return port(self.payload.model_instance), _join(builder, "quadrotor_accelerations", each)


def add_station_plant(
    builder: DiagramBuilder,
    payload: Payload,
    p_LC: Array,
    normal_L: Array,
    parameters: StationParameters,
) -> StationPlant:
    """Add a plant with ground, payload, and a quadrotor with cable and gripper per contact.

    Parameters
    ----------
    builder : DiagramBuilder
    payload : Payload
        In L, z up.
    p_LC, normal_L : (n, 3) arrays
        Contacts [m] and outward normals.
    parameters : StationParameters
    """
    n = len(p_LC)
    plant, scene_graph = add_plant(builder, parameters.step)
    ground, body = add_ground(plant), add_payload(plant, payload)
    suffixes = [""] if n == 1 else [f"_{i}" for i in range(n)]
    quadrotors = [
        add_quadrotor(plant, quadrotor, f"quadrotor{suffix}")
        for quadrotor, suffix in zip(parameters.quadrotors(n), suffixes, strict=True)
    ]
    cables, grippers = [], parameters.grippers(n)
    for i, cable in enumerate(parameters.cables(n)):
        name = f"gripper{suffixes[i]}"
        gripper = add_gripper(plant, body, p_LC[i], normal_L[i], grippers[i], name)
        cables.append(add_cable(plant, quadrotors[i], gripper, cable, f"cable{suffixes[i]}"))
        cables[i].set_default_pose(plant, parameters.initial_slack)
    plant.Finalize()
    return StationPlant(plant, scene_graph, ground, body, quadrotors, cables)


def _join(builder: DiagramBuilder, name: str, ports: list[OutputPort]) -> OutputPort:
    """Return one port with the values of several."""
    together = builder.AddNamedSystem(name, Multiplexer([port.size() for port in ports]))
    for k, port in enumerate(ports):
        builder.Connect(port, together.get_input_port(k))
    return together.get_output_port()
