"""Initial state of a trial: payload, quadrotors and cables at rest, on ground or in the air."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context

from drake_aerial.geometry import Array, quat_from_two_vectors
from drake_aerial.plant.cable import Cable
from drake_aerial.simulation.beliefs import suspended_properties
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.statics.gravity import GRAVITY
from drake_aerial.statics.tensions import level_tensions


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
