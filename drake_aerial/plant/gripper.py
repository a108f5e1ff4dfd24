"""Magnetic gripper: a small body at the end of a cable that holds the payload up to a limit."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import Cylinder
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, RigidBody, SpatialInertia, UnitInertia

from drake_aerial.geometry import Array, perpendicular, quat_from_xz
from drake_aerial.io.records import Positive, PositiveOrInfinite, record
from drake_aerial.io.strict_yaml import numbers
from drake_aerial.plant.part_checks import (
    check_plant,
    check_type,
    parameters_or_default,
    unit_vector3,
)
from drake_aerial.plant.payload_body import PayloadBody

_RADIUS, _HEIGHT = 0.02, 0.01


@record(frozen=True)
class GripperParameters:
    """A magnetic gripper.

    Examples
    --------
    >>> from drake_aerial import GripperParameters, StationParameters
    >>> StationParameters(gripper=GripperParameters(holding_force=15.0)).gripper.holding_force
    15.0
    """

    holding_force: PositiveOrInfinite = 20.0
    """Pull along the contact's normal above which the gripper lets go [N]; infinite (.inf) for a
    gripper that never does."""
    mass: Positive = 0.002
    """Mass, which is added to the payload [kg]."""


@dataclass(frozen=True, eq=False)
class Gripper:
    """A gripper in a plant, made by `add_gripper`; `add_cable` joins it to cable and payload.

    Attributes
    ----------
    parameters : GripperParameters
    payload : PayloadBody
    p_LC : (3,) array
        Contact C in the payload's frame L [m].
    normal_L : (3,) array
        Outward unit normal at the contact, in L.
    body : RigidBody
    model_instance : ModelInstanceIndex
    """

    parameters: GripperParameters
    payload: PayloadBody
    p_LC: Array
    normal_L: Array
    body: RigidBody
    model_instance: ModelInstanceIndex

    @property
    def X_LG(self) -> RigidTransform:
        """Pose of the attached gripper: origin at the contact, z along the normal."""
        q = quat_from_xz(perpendicular(self.normal_L), self.normal_L)
        return RigidTransform(Quaternion(q / np.linalg.norm(q)), self.p_LC)


def add_gripper(
    plant: MultibodyPlant,
    payload: PayloadBody,
    p_LC: ArrayLike,
    normal_L: ArrayLike = (0.0, 0.0, 1.0),
    parameters: GripperParameters | None = None,
    name: str = "gripper",
) -> Gripper:
    """Add a gripper for one contact on a payload.

    Parameters
    ----------
    plant : MultibodyPlant
        Not finalized.
    payload : PayloadBody
        The payload, as `add_payload` returns it.
    p_LC : (3,)
        Contact in the payload's frame L [m].
    normal_L : (3,)
        Outward surface normal at the contact, in L; of any length but zero.
    parameters : GripperParameters, optional
    name : str
        Name of the model instance and of the body.

    Raises
    ------
    InputError
        If an argument has the wrong type or shape, or is not finite; or if the plant is finalized.

    Examples
    --------
    >>> from pydrake.systems.framework import DiagramBuilder
    >>> from drake_aerial import Payload, add_gripper, add_payload
    >>> from drake_aerial.plant.world import add_plant
    >>> plant, _ = add_plant(DiagramBuilder(), 0.002)
    >>> box = add_payload(plant, Payload.from_box([0.4, 0.4, 0.2], 0.25))
    >>> gripper = add_gripper(plant, box, [0.0, 0.0, 0.1], [0.0, 0.0, 1.0])
    >>> gripper.p_LC.tolist(), gripper.parameters.holding_force
    ([0.0, 0.0, 0.1], 20.0)
    """
    check_plant(plant, finalized=False)
    check_type("payload", payload, PayloadBody, "as add_payload returns it")
    contact, normal = numbers(p_LC, (3,), "`p_LC`"), unit_vector3("normal_L", normal_L)
    parameters = parameters_or_default(parameters, GripperParameters)
    instance = plant.AddModelInstance(name)
    unit = UnitInertia.SolidCylinder(_RADIUS, _HEIGHT, [0.0, 0.0, 1.0])
    body = plant.AddRigidBody(name, instance, SpatialInertia(parameters.mass, np.zeros(3), unit))
    if plant.geometry_source_is_registered():
        plant.RegisterVisualGeometry(
            body,
            RigidTransform([0, 0, 0.5 * _HEIGHT]),
            Cylinder(_RADIUS, _HEIGHT),
            "visual",
            [0.2, 0.2, 0.25, 1.0],
        )
    return Gripper(parameters, payload, contact, normal, body, instance)
