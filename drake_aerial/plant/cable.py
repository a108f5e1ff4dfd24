"""The cable: never longer than its length, it pulls and never pushes. Two kinds behind one `Cable`."""

from __future__ import annotations

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
from drake_aerial.geometry import Array
from drake_aerial.io.records import NonNegative, Number, record
from drake_aerial.plant.gripper import Gripper
from drake_aerial.plant.quadrotor import Quadrotor
from drake_aerial.plant.world import refuse_world_body


@record(frozen=True)
class CableParameters:
    """A cable between a quadrotor's centre of mass and a gripper."""

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
    """What `add_cable` added.

    Attributes
    ----------
    parameters : CableParameters
    quadrotor : Quadrotor
        Where it starts: Q's origin.
    gripper : Gripper
        Where it ends.
    model_instance : ModelInstanceIndex or None
        Of the telescope's link; None for the elastic kind, which has no body.
    swing : UniversalJoint or None
        Between quadrotor and link.
    slide : PrismaticJoint or None
        Between link and gripper; its position is the distance from quadrotor to gripper [m].
    grip : MultibodyConstraintId or None
        The ball constraint between gripper and payload.
    """

    parameters: CableParameters
    quadrotor: Quadrotor
    gripper: Gripper
    model_instance: ModelInstanceIndex | None = None
    swing: UniversalJoint | None = None
    slide: PrismaticJoint | None = None
    grip: MultibodyConstraintId | None = None

    def place(self, plant: MultibodyPlant, context: Context) -> None:
        """Set the cable's own joints so that it runs from the quadrotor to the contact, as both are and move in `context`.

        Call it after the poses and velocities of quadrotor and payload have been set, so that the simulation starts without a
        transient.

        Raises
        ------
        InputError
            If the two are further apart than the cable is long (an elastic one may be stretched by 2 %).
        """
        X_WQ = plant.EvalBodyPoseInWorld(context, self.quadrotor.body)
        X_WL = plant.EvalBodyPoseInWorld(context, self.gripper.payload.body)
        p_QC_Q = X_WQ.inverse() @ X_WL @ self.gripper.p_LC
        distance, length = float(np.linalg.norm(p_QC_Q)), self.parameters.length
        longest = length * (1.02 if self.parameters.kind == "elastic" else 1.0 + 1e-6)
        if not 1e-6 < distance <= longest:
            raise InputError(
                f"the quadrotor is {distance:.4g} m from its contact; more than 0 and at most the cable's {length:g} m accepted"
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
        # The link's -z points to the gripper: R_x(a) R_y(b) (0, 0, -1) = (-sin b, sin a cos b, -cos a cos b).
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
    """Join a quadrotor and a gripper by a cable, and the gripper to its payload, before the plant is finalized.

    `connect_cables` then gives the tensions, and makes elastic cables pull.

    Raises
    ------
    ValueError
        If one of the bodies is the world: Drake's SAP solver crashes on such a constraint.

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
    parameters = CableParameters() if parameters is None else parameters
    payload = gripper.payload.body
    refuse_world_body(plant, quadrotor.body, gripper.body, payload)
    if parameters.kind == "elastic":
        plant.WeldFrames(payload.body_frame(), gripper.body.body_frame(), gripper.X_LG)
        return Cable(parameters, quadrotor, gripper)
    instance = plant.AddModelInstance(name)
    length, mass = parameters.length, parameters.link_mass
    # The mass sits near the quadrotor, where it disturbs the swing least; the inertia is that of a rod, to keep it well conditioned.
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
    grip = plant.AddBallConstraint(gripper.body, np.zeros(3), payload, gripper.p_LC)
    return Cable(parameters, quadrotor, gripper, instance, swing, slide, grip)


def tension_matrix(
    quadrotor_masses: Array, mass: float, inertia: Array, p_LoC: Array, xi: Array
) -> Array:
    """Return the matrix (n, n) that takes tensions [N] to the rates at which they shorten the cables [m/s^2].

    d_ij/m_i + xi_i.xi_j/M + (a_i x xi_i).J^-1 (a_j x xi_j), with everything in the payload's frame.

    Parameters
    ----------
    quadrotor_masses : (n,) array [kg]
    mass, inertia : float, (3, 3) array
        The payload's, grippers included, about its centre of mass.
    p_LoC : (n, 3) array
        Contacts from the centre of mass [m].
    xi : (n, 3) array
        Cable directions, from quadrotor to contact.
    """
    arms = np.cross(p_LoC, xi)
    return (
        np.diag(1.0 / quadrotor_masses) + xi @ xi.T / mass + arms @ np.linalg.solve(inertia, arms.T)
    )


def check_elastic_step(parameters: CableParameters, time_step: float, largest: float) -> float:
    """Return how far the explicit step of an elastic cable is from instability: below 4 it is stable, below 2 is accepted.

    The step is stable for dt^2 k lambda + 2 dt c lambda < 4.

    Parameters
    ----------
    parameters : CableParameters
    time_step : float
        dt [s]
    largest : float
        lambda, the largest eigenvalue of `tension_matrix` [1/kg].

    Raises
    ------
    InputError
        At 2 or more; the message gives admissible values of damping, stiffness and step.
    """
    k, c, dt, limit = parameters.stiffness, parameters.damping, time_step, 2.0
    number = (dt**2 * k + 2.0 * dt * c) * largest
    if number < limit:
        return number
    budget = limit / largest
    c_max, k_max = (budget - dt**2 * k) / (2.0 * dt), (budget - 2.0 * dt * c) / dt**2
    dt_max = (-c + np.sqrt(c**2 + k * budget)) / k
    options = [f"a step below {1e3 * dt_max:.3g} ms"]
    if c_max > 0.0:
        options.append(f"a damping below {c_max:.3g} N s/m")
    if k_max > 0.0:
        options.append(f"a stiffness below {k_max:.3g} N/m")
    raise InputError(
        f"an elastic cable of stiffness {k:g} N/m and damping {c:g} N s/m is unstable at a step of {1e3 * dt:g} ms on this "
        f"payload (stability number {number:.2f}; below {limit:g} accepted): use {', or '.join(options)}"
    )
