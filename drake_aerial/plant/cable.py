"""Cable between a quadrotor and a gripper: inextensible or elastic; it can only pull."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Ge
from pydrake.geometry import Cylinder
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    ModelInstanceIndex,
    MultibodyConstraintId,
    PrismaticJoint,
    SpatialInertia,
    UnitInertia,
    UniversalJoint,
)
from pydrake.systems.framework import Context

from drake_aerial.choices import CableKind
from drake_aerial.errors import InputError
from drake_aerial.io.records import NonNegative, Number, record
from drake_aerial.plant.gripper import Gripper
from drake_aerial.plant.part_checks import (
    check_plant,
    check_type,
    parameters_or_default,
    refuse_world_body,
)
from drake_aerial.plant.quadrotor import Quadrotor

_DEFAULT_SLACK = 0.1
"""Slack of a cable by default, as a fraction of its length."""


@record(frozen=True)
class CableParameters:
    """A cable between a quadrotor's centre of mass and a gripper.

    Examples
    --------
    >>> from drake_aerial import CableParameters, StationParameters
    >>> StationParameters(cable=CableParameters(kind="elastic", length=0.8)).cable.length
    0.8
    """

    kind: CableKind = "inextensible"
    """inextensible (a telescope with a limit at the length) or elastic (a spring and damper that
    only pull)."""
    length: Annotated[Number, Ge(1e-3)] = 0.5
    """Length [m]."""
    stiffness: Annotated[Number, Ge(1e-9)] = 5e3
    """Stiffness of an elastic cable [N/m]."""
    damping: NonNegative = 10.0
    """Damping of an elastic cable while it is taut [N s/m]."""
    link_mass: Annotated[Number, Ge(1e-6)] = 2e-4
    """Mass of the link of an inextensible cable [kg]."""


@dataclass(frozen=True, eq=False)
class Cable:
    """A cable in a plant, made by `add_cable`.

    Attributes
    ----------
    parameters : CableParameters
    quadrotor : Quadrotor
        The cable starts at Q's origin.
    gripper : Gripper
        The cable ends at the gripper's contact.
    model_instance : ModelInstanceIndex or None
        Model instance of the telescope's link; None for an elastic cable, which has no body.
    swing : UniversalJoint or None
        Joint between quadrotor and link.
    slide : PrismaticJoint or None
        Joint between link and gripper; its position is the distance from quadrotor to gripper [m].
    grip : MultibodyConstraintId or None
        Ball constraint between gripper and payload.
    """

    parameters: CableParameters
    quadrotor: Quadrotor
    gripper: Gripper
    model_instance: ModelInstanceIndex | None = None
    swing: UniversalJoint | None = None
    slide: PrismaticJoint | None = None
    grip: MultibodyConstraintId | None = None

    def set_default_pose(self, plant: MultibodyPlant, slack: float) -> None:
        """Set the quadrotor's pose in new contexts: level, straight above its contact.

        The contact is where the payload's own default pose has it. Call it again after that pose
        has been changed (`plant.SetDefaultFloatingBaseBodyPose`).

        Parameters
        ----------
        plant : MultibodyPlant
        slack : float
            Cable length less the distance from quadrotor to contact [m].
        """
        X_WL = plant.GetDefaultFloatingBaseBodyPose(self.gripper.payload.body)
        distance = self.parameters.length - slack
        p_WQ = X_WL @ self.gripper.p_LC + [0.0, 0.0, distance]
        plant.SetDefaultFloatingBaseBodyPose(self.quadrotor.body, RigidTransform(p_WQ))
        if self.slide is not None:
            self.slide.set_default_translation(distance)

    def place(self, plant: MultibodyPlant, context: Context) -> None:
        """Set the cable's joints so that it runs from the quadrotor to the contact.

        Call it after the poses and velocities of quadrotor and payload have been set in `context`;
        the simulation then starts without a transient.

        Parameters
        ----------
        plant : MultibodyPlant
        context : Context
            Context of the plant.

        Raises
        ------
        InputError
            If quadrotor and contact are further apart than the cable is long (an elastic cable may
            be stretched by 2 %).
        """
        X_WQ = plant.EvalBodyPoseInWorld(context, self.quadrotor.body)
        X_WL = plant.EvalBodyPoseInWorld(context, self.gripper.payload.body)
        p_QC_Q = X_WQ.inverse() @ X_WL @ self.gripper.p_LC
        distance, length = float(np.linalg.norm(p_QC_Q)), self.parameters.length
        longest = length * (1.02 if self.parameters.kind == "elastic" else 1.0 + 1e-6)
        if not 1e-6 < distance <= longest:
            raise InputError(
                "the distance from the quadrotor to its contact must be in "
                f"(0, {length:g}] m, the cable's length, got {distance:.4g} m"
            )
        if self.swing is None or self.slide is None:
            return
        V_WQ = plant.EvalBodySpatialVelocityInWorld(context, self.quadrotor.body)
        V_WC = plant.EvalBodySpatialVelocityInWorld(context, self.gripper.payload.body).Shift(
            X_WL.rotation() @ self.gripper.p_LC
        )
        R_QW = X_WQ.rotation().inverse()
        v_QC_Q = R_QW @ (V_WC.translational() - V_WQ.translational()) - np.cross(
            R_QW @ V_WQ.rotational(), p_QC_Q
        )
        # The link's -z points to the gripper:
        # R_x(a) R_y(b) (0, 0, -1) = (-sin b, sin a cos b, -cos a cos b).
        x, y, z = direction = p_QC_Q / distance
        rate = float(direction @ v_QC_Q)
        dx, dy, dz = (v_QC_Q - rate * direction) / distance
        cos_b = float(np.hypot(y, z))
        self.swing.set_angles(context, np.array([np.arctan2(y, -z), np.arctan2(-x, cos_b)]))
        self.swing.set_angular_rates(context, np.array([(y * dz - z * dy) / cos_b**2, -dx / cos_b]))
        self.slide.set_translation(context, min(distance, length))
        self.slide.set_translation_rate(context, rate)


def add_cable(
    plant: MultibodyPlant,
    quadrotor: Quadrotor,
    gripper: Gripper,
    parameters: CableParameters | None = None,
    name: str = "cable",
) -> Cable:
    """Join a quadrotor and a gripper by a cable, and the gripper to its payload.

    After the plant is finalized, `connect_cables` adds the system that computes the tensions and
    applies the forces of elastic cables. The quadrotor's default pose becomes level and straight
    above the contact, with the cable slack by a tenth of its length (`Cable.set_default_pose`).

    Parameters
    ----------
    plant : MultibodyPlant
        Not finalized.
    quadrotor : Quadrotor
        The quadrotor, as `add_quadrotor` returns it.
    gripper : Gripper
        The gripper, as `add_gripper` returns it.
    parameters : CableParameters, optional
    name : str
        Name of the model instance, the link and the joints.

    Raises
    ------
    InputError
        If an argument has the wrong type, if the plant is finalized, or if one of the bodies is the
        world body, for which Drake's SAP solver crashes.

    Examples
    --------
    >>> from pydrake.systems.framework import DiagramBuilder
    >>> from drake_aerial import Payload, add_cable, add_gripper, add_payload, add_quadrotor
    >>> from drake_aerial.plant.world import add_plant
    >>> plant, _ = add_plant(DiagramBuilder(), 0.002)
    >>> box = add_payload(plant, Payload.from_box([0.4, 0.4, 0.2], 0.25))
    >>> gripper = add_gripper(plant, box, [0.0, 0.0, 0.1], [0.0, 0.0, 1.0])
    >>> cable = add_cable(plant, add_quadrotor(plant), gripper)
    >>> cable.parameters.kind, cable.parameters.length
    ('inextensible', 0.5)
    """
    check_plant(plant, finalized=False)
    check_type("quadrotor", quadrotor, Quadrotor, "as add_quadrotor returns it")
    check_type("gripper", gripper, Gripper, "as add_gripper returns it")
    parameters = parameters_or_default(parameters, CableParameters)
    payload = gripper.payload.body
    refuse_world_body(plant, quadrotor.body, gripper.body, payload)
    if parameters.kind == "elastic":
        plant.WeldFrames(payload.body_frame(), gripper.body.body_frame(), gripper.X_LG)
        cable = Cable(parameters, quadrotor, gripper)
    else:
        cable = _add_telescope(plant, quadrotor, gripper, parameters, name)
    cable.set_default_pose(plant, _DEFAULT_SLACK * parameters.length)
    return cable


def _add_telescope(
    plant: MultibodyPlant,
    quadrotor: Quadrotor,
    gripper: Gripper,
    parameters: CableParameters,
    name: str,
) -> Cable:
    """Add a link between two joints whose slide ends at the cable's length, and the grip."""
    instance = plant.AddModelInstance(name)
    length, mass = parameters.length, parameters.link_mass
    # The mass is near the quadrotor, where it disturbs the swing least. The inertia is that of a
    # rod, to keep it well conditioned.
    unit = UnitInertia.SolidCylinder(0.02, 0.3 * length, [0.0, 0.0, 1.0])
    link = plant.AddRigidBody(name, instance, SpatialInertia(mass, np.zeros(3), unit))
    if plant.geometry_source_is_registered():
        plant.RegisterVisualGeometry(
            link,
            RigidTransform([0.0, 0.0, -0.5 * length]),
            Cylinder(0.003, length),
            "visual",
            [0.1, 0.1, 0.1, 1.0],
        )
    swing = plant.AddJoint(
        UniversalJoint(f"{name}_swing", quadrotor.body.body_frame(), link.body_frame(), damping=0.0)
    )
    slide = plant.AddJoint(
        PrismaticJoint(
            f"{name}_slide",
            link.body_frame(),
            gripper.body.body_frame(),
            np.array([0.0, 0.0, -1.0]),
            0.0,
            length,
            0.0,
        )
    )
    payload = gripper.payload.body
    grip = plant.AddBallConstraint(gripper.body, np.zeros(3), payload, gripper.p_LC)
    return Cable(parameters, quadrotor, gripper, instance, swing, slide, grip)
