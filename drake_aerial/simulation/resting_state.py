"""Where a trial begins: payload, quadrotors and cables at rest, on the ground or in the air."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.systems.framework import Context

from drake_aerial.geometry import Array, quat_from_two_vectors
from drake_aerial.simulation.beliefs import suspended_properties
from drake_aerial.statics.gravity import GRAVITY
from drake_aerial.statics.tensions import level_tensions

if TYPE_CHECKING:
    from drake_aerial.simulation.station import TransportStation


def place_at_rest(
    station: TransportStation, context: Context, airborne: bool
) -> tuple[Array, Array]:
    """Place a station's bodies in the context of its diagram, or of one that holds it.

    On the ground the cables are slack by `initial_slack` and the quadrotors straight above their contacts. In the air the payload is at
    `airborne_height` above that, level or, from one cable, as it comes to rest; the cables are taut and vertical.

    Returns
    -------
    Position of L's origin in the world (3,) [m], and what each cable carries (n,) [N].
    """
    plant, plant_context = station.plant, station.plant.GetMyMutableContextFromRoot(context)
    n, parameters, p_LC = station.n, station.parameters, station.p_LC
    X_WL = RigidTransform([0.0, 0.0, station.payload_body.rest_height])
    length = parameters.cable_lengths(n)
    reach = length - parameters.initial_slack
    carried = np.zeros(n)
    if airborne:
        mass, com, _ = suspended_properties(station.payload, p_LC, parameters.grippers(n))
        X_WL = RigidTransform(X_WL.translation() + [0.0, 0.0, parameters.airborne_height])
        if n == 1:
            q = quat_from_two_vectors(_unit(com - p_LC[0]), [0.0, 0.0, -1.0])
            X_WL = RigidTransform(Quaternion(q), X_WL.translation())
        carried = level_tensions(p_LC - com, mass * GRAVITY)
        reach = length
        cables = parameters.cables(n)
        if cables[0].kind == "elastic":
            reach = reach + carried / [c.stiffness for c in cables]
    poses = [(station.payload_body.body, X_WL)]
    for quadrotor, contact, height in zip(station.quadrotors, p_LC, reach, strict=True):
        poses.append((quadrotor.body, RigidTransform(X_WL @ contact + [0.0, 0.0, height])))
    for body, pose in poses:
        plant.SetFreeBodyPose(plant_context, body, pose)
        plant.SetFreeBodySpatialVelocity(
            plant_context, body, SpatialVelocity(np.zeros(3), np.zeros(3))
        )
    for cable in station.cables:
        cable.place(plant, plant_context)
    return X_WL.translation(), carried


def _unit(vector: Array) -> Array:
    size = float(np.linalg.norm(vector))
    return vector / size if size > 1e-9 else np.array([0.0, 0.0, -1.0])
