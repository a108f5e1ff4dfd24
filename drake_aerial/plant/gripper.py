"""The magnetic gripper: a small body at the cable's end that holds on to the payload up to a limit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import Cylinder
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, RigidBody, SpatialInertia, UnitInertia

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, perpendicular, quat_from_xz
from drake_aerial.io.records import Positive, PositiveOrInfinite, record
from drake_aerial.plant.payload_body import PayloadBody

_RADIUS, _HEIGHT = 0.02, 0.01


@record(frozen=True)
class GripperParameters:
    """A magnetic gripper."""

    holding_force: PositiveOrInfinite = 20.0
    """Pull along the contact's normal above which the gripper lets go [N]; infinite (.inf) for a
    gripper that never does."""
    mass: Positive = 0.002
    """Mass, which is added to the payload [kg]."""


@dataclass(frozen=True, eq=False)
class Gripper:
    """What `add_gripper` added: a body without a joint yet, which `add_cable` joins to its cable and to the payload.

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
        """Return the attached gripper's pose: origin at the contact, z along the normal."""
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
    """Add a gripper for a contact on a payload to a plant that is not finalized yet.

    Parameters
    ----------
    plant : MultibodyPlant
    payload : PayloadBody
    p_LC : (3,)
        The contact in the payload's frame L [m].
    normal_L : (3,)
        The outward surface normal there, in L.
    parameters : GripperParameters, optional
    name : str
        Of the model instance and the body.

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
    parameters = GripperParameters() if parameters is None else parameters
    normal = np.asarray(normal_L, dtype=float)
    length = float(np.linalg.norm(normal))
    if normal.shape != (3,) or not np.isfinite(length) or length == 0.0:
        raise InputError(
            f"the contact's normal is {normal_L!r}; three finite numbers, not all zero, accepted"
        )
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
    return Gripper(
        parameters, payload, np.asarray(p_LC, dtype=float), normal / length, body, instance
    )
