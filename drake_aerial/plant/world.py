"""The simulated world: the plant with its solver, the ground, and the contact material."""

from pydrake.geometry import AddContactMaterial, Box, GeometryId, ProximityProperties, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import (
    AddMultibodyPlant,
    CoulombFriction,
    MultibodyPlant,
    MultibodyPlantConfig,
)
from pydrake.systems.framework import DiagramBuilder

TIME_STEP = 0.005
"""Default time step of a plant [s]; docs/flight.md compares steps."""
ELASTIC_TIME_STEP = 0.002
"""Default time step of a plant with elastic cables, whose force is explicit [s]."""
CONTACT_STIFFNESS = 1e4
"""Stiffness of a touching pair of bodies, each of which is twice as stiff [N/m]."""
GROUND = "ground"
"""Name of the ground's collision geometry."""


def add_plant(
    builder: DiagramBuilder, time_step: float = TIME_STEP
) -> tuple[MultibodyPlant, SceneGraph]:
    """Add a discrete plant with the SAP solver and point contact, and its scene graph.

    The plant's output ports are not sampled: a discrete controller that is updated together with
    the plant reads the state before the step.

    Parameters
    ----------
    builder : DiagramBuilder
    time_step : float
        [s]

    Examples
    --------
    >>> from pydrake.systems.framework import DiagramBuilder
    >>> from drake_aerial import add_plant
    >>> plant, scene_graph = add_plant(DiagramBuilder(), 0.002)
    >>> plant.time_step()
    0.002
    """
    config = MultibodyPlantConfig(
        time_step=time_step,
        contact_model="point",
        discrete_contact_approximation="sap",
        use_sampled_output_ports=False,
    )
    return AddMultibodyPlant(config, builder)


def contact_properties(friction: float = 0.8) -> ProximityProperties:
    """Return the contact material of all bodies: stiff, well damped, with this friction."""
    properties = ProximityProperties()
    AddContactMaterial(
        20.0, 2.0 * CONTACT_STIFFNESS, CoulombFriction(friction, friction), properties
    )
    # Relaxation time of SAP [s]; with the default, 0.1 s, a landed payload creeps up for 1 s.
    properties.AddProperty("material", "relaxation_time", 0.01)
    return properties


def add_ground(plant: MultibodyPlant, friction: float = 0.8) -> GeometryId:
    """Add the ground, whose top is at z = 0, and return the id of its collision geometry.

    Parameters
    ----------
    plant : MultibodyPlant
        Not finalized, with a scene graph.
    friction : float
        Coefficient of friction.

    Examples
    --------
    >>> from pydrake.systems.framework import DiagramBuilder
    >>> from drake_aerial import add_ground, add_plant
    >>> plant, scene_graph = add_plant(DiagramBuilder())
    >>> geometry = add_ground(plant)
    >>> scene_graph.model_inspector().GetName(geometry)
    'ground'
    """
    world = plant.world_body()
    plant.RegisterVisualGeometry(
        world,
        RigidTransform([0.0, 0.0, -0.01]),
        Box(8.0, 8.0, 0.02),
        "ground_visual",
        [0.86, 0.88, 0.86, 1.0],
    )
    # A block, because Drake prints a warning for a half space.
    block = Box(200.0, 200.0, 2.0)
    return plant.RegisterCollisionGeometry(
        world, RigidTransform([0.0, 0.0, -1.0]), block, GROUND, contact_properties(friction)
    )
