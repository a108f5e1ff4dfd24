"""The scene: the plant with its solver, the ground, and what must not be done to the world body."""

from __future__ import annotations

from pydrake.geometry import AddContactMaterial, Box, GeometryId, ProximityProperties, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import (
    AddMultibodyPlant,
    CoulombFriction,
    MultibodyPlant,
    MultibodyPlantConfig,
)
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import DiagramBuilder

TIME_STEP = 0.005
"""Of a plant by default [s]; docs/flight.md has what the step does to a flight."""
ELASTIC_TIME_STEP = 0.002
"""Of one with elastic cables, whose force is explicit [s]."""
CONTACT_STIFFNESS = 1e4
"""Of a pair of touching bodies that are each twice as stiff [N/m]."""
GROUND = "ground"
"""Name of the ground's collision geometry."""


def add_plant(
    builder: DiagramBuilder, time_step: float = TIME_STEP
) -> tuple[MultibodyPlant, SceneGraph]:
    """Add a discrete plant with the SAP solver and point contact, and its scene graph.

    Its output ports are not sampled: a discrete controller that runs at the same instants as the plant sees the state before the
    step, not after it.

    Parameters
    ----------
    builder : DiagramBuilder
    time_step : float
        [s]
    """
    config = MultibodyPlantConfig(
        time_step=time_step,
        contact_model="point",
        discrete_contact_approximation="sap",
        use_sampled_output_ports=False,
    )
    return AddMultibodyPlant(config, builder)


def contact_properties(friction: float = 0.8) -> ProximityProperties:
    """Return the material of everything that touches: stiff, well damped, of the given friction coefficient."""
    properties = ProximityProperties()
    AddContactMaterial(
        20.0, 2.0 * CONTACT_STIFFNESS, CoulombFriction(friction, friction), properties
    )
    # Of the SAP approximation's linear dissipation; its default of 0.1 s lets a landed payload creep up for a second.
    properties.AddProperty("material", "relaxation_time", 0.01)
    return properties


def add_ground(plant: MultibodyPlant, friction: float = 0.8) -> GeometryId:
    """Add the ground, whose top is z = 0, and return its collision geometry's id."""
    world = plant.world_body()
    plant.RegisterVisualGeometry(
        world,
        RigidTransform([0.0, 0.0, -0.01]),
        Box(8.0, 8.0, 0.02),
        "ground_visual",
        [0.86, 0.88, 0.86, 1.0],
    )
    # A block rather than a half space, about which Drake would print a warning.
    block = Box(200.0, 200.0, 2.0)
    return plant.RegisterCollisionGeometry(
        world, RigidTransform([0.0, 0.0, -1.0]), block, GROUND, contact_properties(friction)
    )


def refuse_world_body(plant: MultibodyPlant, *bodies: RigidBody) -> None:
    """Raise ValueError if one of the bodies to be constrained is the world.

    Drake's SAP driver crashes the interpreter on a constraint that involves the world body (1.46 to 1.58); suspend from a heavy
    body that is welded to nothing, or from a joint, instead.
    """
    for body in bodies:
        if body.index() == plant.world_body().index():
            raise ValueError(
                "the world body was given as one end of a cable; a constraint to it crashes Drake's SAP solver: "
                "give a body of the plant other than the world"
            )
