"""The quadrotor: a free body with four propellers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from pydrake.geometry import Box, Cylinder, Ellipsoid, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant, Propeller, PropellerInfo
from pydrake.multibody.tree import ModelInstanceIndex, RigidBody, SpatialInertia, UnitInertia
from pydrake.systems.framework import DiagramBuilder, InputPort, OutputPort
from pydrake.systems.primitives import Saturation

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.io.records import NonNegative, Positive, read_record, record
from drake_aerial.plant.mass_properties import check_inertia
from drake_aerial.plant.motor_lag import MotorLag
from drake_aerial.plant.part_checks import check_list, check_plant, parameters_or_default
from drake_aerial.plant.world import contact_properties

GUARD_REACH = 1.2
"""Horizontal radius of the rotor guard, at which quadrotors touch, over the arm."""


@record(frozen=True)
class QuadrotorParameters:
    """A quadrotor of X configuration.

    Its body frame Q has x forward, y left, z along the thrust; its origin is the centre of mass.
    The defaults are the paper's table. It gives no thrust coefficient: 6.572e-9 N/rpm^2 is
    published for that airframe with bull-nose propellers (7.07 N at the maximal RPM). Arm and drag
    ratio are common values of that size.

    Examples
    --------
    >>> from drake_aerial import QuadrotorParameters
    >>> round(QuadrotorParameters(max_rpm=20000.0).thrust_limits[1], 2)  # in N
    10.52
    """

    mass: Positive = 0.25
    """Mass [kg]."""
    inertia: tuple[Positive, Positive, Positive] = (6e-4, 5e-4, 1e-3)
    """Principal moments of inertia along Q's axes [kg m^2]."""
    thrust_coefficient: Positive = 6.572e-9
    """Thrust of one propeller per squared speed [N/rpm^2]."""
    drag_ratio: Positive = 0.016
    """Yaw moment of a propeller over its thrust [m]."""
    arm: Positive = 0.10
    """Distance of each propeller from the centre [m]."""
    min_rpm: NonNegative = 5500.0
    """Lowest speed of a propeller [rpm]."""
    max_rpm: Positive = 16400.0
    """Highest speed of a propeller [rpm]."""

    def __post_init__(self) -> None:
        check_inertia(self.inertia, "`inertia`")
        if self.min_rpm >= self.max_rpm:
            raise InputError(f"`min_rpm` must be < max_rpm = {self.max_rpm:g}, got {self.min_rpm}")

    @classmethod
    def read(cls, path: str | Path) -> QuadrotorParameters:
        """Read the parameters from a YAML file that has this class's fields as keys.

        Fields that the file leaves out have their defaults.

        Raises
        ------
        InputError
            If the file is unreadable, or has an unknown key or an impossible value.
        """
        return read_record(cls, path)

    @property
    def propeller_positions(self) -> Array:
        """Positions (4, 3) of the propellers in Q [m].

        The order is front left, rear left, rear right, front right.
        """
        a = self.arm / np.sqrt(2.0)
        return np.array([[a, a, 0.0], [-a, a, 0.0], [-a, -a, 0.0], [a, -a, 0.0]])

    @property
    def propeller_spins(self) -> Array:
        """Signs (4,) of the propellers' yaw moments about Q's z."""
        return np.array([1.0, -1.0, 1.0, -1.0])

    @property
    def allocation(self) -> Array:
        """Matrix (4, 4) from squared speeds [rpm^2] to thrust [N] and moments in Q [N m]."""
        p = self.propeller_positions
        rows = np.stack([np.ones(4), p[:, 1], -p[:, 0], self.drag_ratio * self.propeller_spins])
        return self.thrust_coefficient * rows

    @property
    def command_limits(self) -> tuple[float, float]:
        """Lowest and highest command of a propeller [rpm^2]."""
        return self.min_rpm**2, self.max_rpm**2

    @property
    def thrust_limits(self) -> tuple[float, float]:
        """Lowest and highest total thrust [N]."""
        low, high = self.command_limits
        return 4.0 * self.thrust_coefficient * low, 4.0 * self.thrust_coefficient * high


@dataclass(frozen=True, eq=False)
class Quadrotor:
    """A quadrotor in a plant, made by `add_quadrotor`.

    Attributes
    ----------
    parameters : QuadrotorParameters
    body : RigidBody
        The only body of its model instance; its frame is Q, its origin the centre of mass.
    model_instance : ModelInstanceIndex
        Its state output port has 13 numbers: quaternion w, x, y, z, position [m], angular velocity
        [rad/s] and linear velocity [m/s] of Q in the world.
    """

    parameters: QuadrotorParameters
    body: RigidBody
    model_instance: ModelInstanceIndex


def add_quadrotor(
    plant: MultibodyPlant, parameters: QuadrotorParameters | None = None, name: str = "quadrotor"
) -> Quadrotor:
    """Add a quadrotor to a plant; `connect_propellers` adds its propellers.

    New contexts have it at the world's origin until `add_cable` puts it above its contact.

    Parameters
    ----------
    plant : MultibodyPlant
        Not finalized.
    parameters : QuadrotorParameters, optional
    name : str
        Name of the model instance and of the body.

    Raises
    ------
    InputError
        If an argument has the wrong type, or if the plant is finalized.

    Examples
    --------
    >>> from pydrake.systems.framework import DiagramBuilder
    >>> from drake_aerial import add_quadrotor
    >>> from drake_aerial.plant.world import add_plant
    >>> plant, _ = add_plant(DiagramBuilder(), 0.002)
    >>> quadrotor = add_quadrotor(plant)
    >>> round(quadrotor.parameters.thrust_limits[1], 2)
    7.07
    """
    check_plant(plant, finalized=False)
    parameters = parameters_or_default(parameters, QuadrotorParameters)
    m = parameters.mass
    unit = UnitInertia(*(np.asarray(parameters.inertia) / m))
    instance = plant.AddModelInstance(name)
    body = plant.AddRigidBody(name, instance, SpatialInertia(m, np.zeros(3), unit))
    if plant.geometry_source_is_registered():
        # Landing gear and rotor guard in one, which is touched in crashes only.
        reach = GUARD_REACH * parameters.arm
        guard = Ellipsoid(reach, reach, 0.04)
        plant.RegisterCollisionGeometry(
            body, RigidTransform(), guard, "guard", contact_properties()
        )
        for k, (X, shape, colour) in enumerate(visual_parts(parameters)):
            plant.RegisterVisualGeometry(body, X, shape, f"visual_{k}", colour)
    return Quadrotor(parameters, body, instance)


def visual_parts(
    parameters: QuadrotorParameters,
) -> list[tuple[RigidTransform, Box | Cylinder | Sphere | Ellipsoid, list[float]]]:
    """Return the shapes that draw a quadrotor: pose in Q, shape, colour (rgba)."""
    arm = parameters.arm
    dark, metal, blade = [0.13, 0.14, 0.16, 1.0], [0.55, 0.57, 0.60, 1.0], [0.35, 0.62, 0.90, 0.55]
    parts: list = [
        (RigidTransform([0, 0, 0.005]), Box(0.075, 0.055, 0.03), dark),
        (RigidTransform([-0.005, 0, 0.026]), Box(0.05, 0.035, 0.014), metal),
        (RigidTransform([0.042, 0, 0.006]), Sphere(0.011), [0.85, 0.20, 0.15, 1.0]),
    ]
    for yaw in (np.pi / 4.0, -np.pi / 4.0):
        parts.append(
            (
                RigidTransform(RotationMatrix.MakeZRotation(yaw), np.zeros(3)),
                Box(2 * arm, 0.014, 0.010),
                dark,
            )
        )
    for x, y, _ in parameters.propeller_positions:
        parts.append((RigidTransform([x, y, 0.012]), Cylinder(0.010, 0.024), metal))
        parts.append((RigidTransform([x, y, 0.026]), Cylinder(0.62 * arm, 0.003), blade))
        parts.append((RigidTransform([x, y, -0.018]), Cylinder(0.003, 0.032), dark))
    return parts


def connect_propellers(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    quadrotors: list[Quadrotor],
    name: str = "propellers",
    *,
    motor_lag: float = 0.0,
    initial_speeds: ArrayLike | None = None,
) -> tuple[InputPort, OutputPort]:
    """Add the propellers of n quadrotors, with their speed limits, to a diagram.

    Parameters
    ----------
    builder : DiagramBuilder
    plant : MultibodyPlant
        Finalized.
    quadrotors : list of Quadrotor
        The n quadrotors, as `add_quadrotor` returns them.
    name : str
        Name of the propellers' system; that of the limits is "<name>_limits", that of the motor lag
        "<name>_lag".
    motor_lag : float
        Time constant with which the speeds follow the commands [s]; 0 for none.
    initial_speeds : (4 n,) array, optional
        Speeds in a new context with motor lag [rpm]; by default the lowest.

    Returns
    -------
    commands : InputPort
        Squared speeds (4 n) [rpm^2]; each is limited to its propeller's range.
    forces : OutputPort
        Spatial forces, for the plant's applied_spatial_force port.

    Raises
    ------
    InputError
        If an argument has the wrong type, `motor_lag` is negative, or the plant is not finalized.

    Examples
    --------
    >>> from pydrake.systems.framework import DiagramBuilder
    >>> from drake_aerial import add_plant, add_quadrotor, connect_propellers
    >>> builder = DiagramBuilder()
    >>> plant, _ = add_plant(builder)
    >>> quadrotor = add_quadrotor(plant)
    >>> plant.Finalize()
    >>> commands, forces = connect_propellers(builder, plant, [quadrotor])
    >>> builder.Connect(forces, plant.get_applied_spatial_force_input_port())
    >>> commands.size()
    4
    """
    check_plant(plant, finalized=True)
    check_list("quadrotors", quadrotors, Quadrotor, "as add_quadrotor returns it")
    infos, low, high = [], [], []
    for quadrotor in quadrotors:
        p = quadrotor.parameters
        k = p.thrust_coefficient
        for position, spin in zip(p.propeller_positions, p.propeller_spins, strict=True):
            X_QPropeller = RigidTransform(position)
            infos.append(
                PropellerInfo(quadrotor.body.index(), X_QPropeller, k, k * p.drag_ratio * spin)
            )
        low += [p.command_limits[0]] * 4
        high += [p.command_limits[1]] * 4
    limits = builder.AddNamedSystem(f"{name}_limits", Saturation(np.array(low), np.array(high)))
    propellers = builder.AddNamedSystem(name, Propeller(infos))
    speeds = limits.get_output_port()
    if motor_lag != 0.0:
        initial = np.sqrt(low) if initial_speeds is None else initial_speeds
        lag = MotorLag(len(low), motor_lag, plant.time_step(), initial)
        builder.Connect(speeds, builder.AddNamedSystem(f"{name}_lag", lag).get_input_port())
        speeds = lag.get_output_port()
    builder.Connect(speeds, propellers.get_command_input_port())
    builder.Connect(plant.get_body_poses_output_port(), propellers.get_body_poses_input_port())
    return limits.get_input_port(), propellers.get_spatial_forces_output_port()
