"""The payload as a body of a plant: mass properties, contact spheres, hull and visual."""

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Convex, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, RigidBody, RotationalInertia, SpatialInertia
from scipy.spatial import QhullError

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.plant import support_points as support
from drake_aerial.plant.air import AirParameters, PayloadAir, payload_air
from drake_aerial.plant.part_checks import check_plant, check_type
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.triangles import convex_hull
from drake_aerial.plant.world import CONTACT_STIFFNESS, contact_properties
from drake_aerial.statics.gravity import GRAVITY

_COLOUR = [0.80, 0.62, 0.40, 1.0]


@dataclass(frozen=True, eq=False)
class PayloadBody:
    """A payload in a plant, made by `add_payload`.

    Attributes
    ----------
    payload : Payload
        The payload, in the tracked frame L.
    body : RigidBody
        The only body of its model instance; its frame is L.
    model_instance : ModelInstanceIndex
        Its state output port has 13 numbers: quaternion w, x, y, z, position [m], angular velocity
        [rad/s] and linear velocity [m/s] of L in the world.
    rest_height : float
        Height of L's origin above the ground at rest [m].
    stands_alone : bool
        Whether it stands on its own shape; otherwise on a light cradle (`support_points.feet`).
    air : PayloadAir or None
        What the air does to it; the body's mass has the air's in it. None without air.
    """

    payload: Payload
    body: RigidBody
    model_instance: ModelInstanceIndex
    rest_height: float
    stands_alone: bool
    air: PayloadAir | None = None


def add_payload(
    plant: MultibodyPlant,
    payload: Payload,
    *,
    name: str = "payload",
    air: AirParameters | None = None,
) -> PayloadBody:
    """Add a payload to a plant, as a free body in a model instance of its own.

    On the ground it stands on at most 20 small spheres (`support_points`). Other bodies collide
    with its convex hull, which is 1 cm smaller so that the spheres touch the ground first. The
    default pose, which new contexts have, is at rest on ground at z = 0, with L above the world's
    origin.

    Parameters
    ----------
    plant : MultibodyPlant
        Not finalized.
    payload : Payload
        The payload in the body's frame L (`Payload.in_tracked_frame`), z up at rest.
    name : str
        Name of the model instance and of the body.
    air : AirParameters, optional
        The body then has the mass of the air that moves along too, whose weight `connect_air`
        balances; the payload's own mass is what a scale shows in air. None for no air.

    Raises
    ------
    InputError
        If Drake refuses the mass properties, if the shape has no volume, if an argument has the
        wrong type, or if the plant is finalized.

    Examples
    --------
    >>> from pydrake.systems.framework import DiagramBuilder
    >>> from drake_aerial import Payload, add_payload
    >>> from drake_aerial.plant.world import add_plant
    >>> plant, _ = add_plant(DiagramBuilder(), 0.002)
    >>> box = add_payload(plant, Payload.from_box([0.4, 0.4, 0.2], 0.25))
    >>> float(box.body.default_mass())
    0.25
    """
    check_plant(plant, finalized=False)
    check_type("payload", payload, Payload, "(Payload.read, .from_box, .from_mesh, .from_cloud)")
    instance = plant.AddModelInstance(name)
    J = payload.inertia
    try:
        about_com = RotationalInertia(J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2])
        inertia = SpatialInertia.MakeFromCentralInertia(payload.mass, payload.com, about_com)
    except RuntimeError as error:
        raise InputError(
            f"`inertia` of a payload must be possible for its mass, got {J.tolist()} kg m^2 for "
            f"{payload.mass:g} kg"
        ) from error
    around = None if air is None else payload_air(payload.vertices, payload.faces, air)
    if around is not None:
        inertia += _inertia_of_air(around)
    body = plant.AddRigidBody(name, instance, inertia)
    feet, own = support.feet(payload.vertices, payload.com)
    if plant.geometry_source_is_registered():
        _register_shape(plant, body, payload, feet)
    penetration = payload.mass * GRAVITY / (len(feet) * CONTACT_STIFFNESS)
    rest_height = float(-feet[0, 2]) - penetration
    plant.SetDefaultFloatingBaseBodyPose(body, RigidTransform([0.0, 0.0, rest_height]))
    return PayloadBody(payload, body, instance, rest_height, own, around)


def _inertia_of_air(air: PayloadAir) -> SpatialInertia:
    """Return the spatial inertia of the air that moves with a payload, about L's origin in L."""
    J = air.inertia
    about_centre = RotationalInertia(J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2])
    return SpatialInertia.MakeFromCentralInertia(air.mass, air.centre, about_centre)


def _register_shape(plant: MultibodyPlant, body: RigidBody, payload: Payload, feet: Array) -> None:
    properties = contact_properties()
    try:
        hull, _ = convex_hull(payload.vertices)
    except QhullError as error:
        raise InputError(
            f"the convex hull of payload {payload.name!r} must have a volume, but it is flat"
        ) from error
    centre, floor = hull.mean(axis=0), feet[0, 2] + support.RADIUS
    points = [foot + [0.0, 0.0, support.RADIUS] for foot in feet]
    for corner in support.extremes(hull):
        inward = (centre - corner) / np.linalg.norm(centre - corner)
        point = corner + support.RADIUS * inward
        point[2] = max(point[2], floor)
        # A foot may be at this corner already.
        if min(np.linalg.norm(point - other) for other in points) > 0.02:
            points.append(point)
    for k, point in enumerate(points):
        plant.RegisterCollisionGeometry(
            body, RigidTransform(point), Sphere(support.RADIUS), f"touch_{k}", properties
        )
    shrink = np.maximum(0.2, 1.0 - 0.02 / np.ptp(hull, axis=0))
    inner = Convex((centre + shrink * (hull - centre)).T, payload.name)
    plant.RegisterCollisionGeometry(body, RigidTransform(), inner, "hull", properties)
    plant.RegisterVisualGeometry(
        body, RigidTransform(), Convex(hull.T, payload.name), "visual", _COLOUR
    )
