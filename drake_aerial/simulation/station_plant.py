"""The plant of a station: ground, payload, quadrotors, cables, grippers, and poses at rest."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import GeometryId, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.primitives import Multiplexer

from drake_aerial.geometry import Array, quat_from_two_vectors
from drake_aerial.plant.cable import Cable, add_cable
from drake_aerial.plant.gripper import add_gripper
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.payload_body import PayloadBody, add_payload
from drake_aerial.plant.quadrotor import Quadrotor, add_quadrotor
from drake_aerial.plant.world import add_ground, add_plant
from drake_aerial.simulation.beliefs import suspended_properties
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.statics.gravity import GRAVITY
from drake_aerial.statics.tensions import level_tensions


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
    ground, body = add_ground(plant), add_payload(plant, payload, air=parameters.air)
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


def place_at_rest(
    plant: MultibodyPlant,
    context: Context,
    cables: Sequence[Cable],
    parameters: StationParameters,
    airborne: bool,
) -> tuple[Array, Array]:
    """Place payload, quadrotors and cables at rest, with L's origin above the world's.

    On the ground the quadrotors are straight above their contacts and the cables are slack by
    `initial_slack`. In the air the payload is higher by `airborne_height`; it is level, or from
    one cable as it comes to rest, and the cables are taut and vertical.

    Parameters
    ----------
    plant : MultibodyPlant
    context : Context
        Context of the plant.
    cables : sequence of n Cable
        On one payload.
    parameters : StationParameters
    airborne : bool

    Returns
    -------
    p_WL : (3,) array
        Position of L's origin in the world [m].
    carried : (n,) array
        Force that each cable carries [N].
    """
    n, payload = len(cables), cables[0].gripper.payload
    p_LC = np.stack([cable.gripper.p_LC for cable in cables])
    X_WL = RigidTransform([0.0, 0.0, payload.rest_height])
    length = parameters.cable_lengths(n)
    distance, carried = length - parameters.initial_slack, np.zeros(n)
    if airborne:
        mass, com, _ = suspended_properties(payload.payload, p_LC, parameters.grippers(n))
        X_WL = RigidTransform(X_WL.translation() + [0.0, 0.0, parameters.airborne_height])
        if n == 1:
            q = quat_from_two_vectors(_unit(com - p_LC[0]), [0.0, 0.0, -1.0])
            X_WL = RigidTransform(Quaternion(q), X_WL.translation())
        carried = level_tensions(p_LC - com, mass * GRAVITY)
        distance = length
        if cables[0].parameters.kind == "elastic":
            distance = length + carried / [cable.parameters.stiffness for cable in cables]
    poses = [(payload.body, X_WL)]
    for cable, contact, height in zip(cables, p_LC, distance, strict=True):
        X_WQ = RigidTransform(X_WL @ contact + [0.0, 0.0, height])
        poses.append((cable.quadrotor.body, X_WQ))
    at_rest = SpatialVelocity(np.zeros(3), np.zeros(3))
    for body, pose in poses:
        plant.SetFreeBodyPose(context, body, pose)
        plant.SetFreeBodySpatialVelocity(context, body, at_rest)
    for cable in cables:
        cable.place(plant, context)
    return X_WL.translation(), carried


def _unit(vector: Array) -> Array:
    """Return the direction of a vector (3,), downwards for one of no length."""
    size = float(np.linalg.norm(vector))
    return vector / size if size > 1e-9 else np.array([0.0, 0.0, -1.0])
