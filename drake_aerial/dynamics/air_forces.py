"""Forces of the air on payload and quadrotors in the payload model, and their derivatives.

Without air in the model (`PayloadModelParameters.air`), no function here is called.
"""

from typing import NamedTuple

import numpy as np

from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.dynamics.payload_state import PayloadState
from drake_aerial.geometry import IDENTITY, Array, skew, small_cross
from drake_aerial.statics.gravity import GRAVITY

_STILL = 1e-9
"""Speed of the air below which the derivative of the quadratic drag counts as zero [m/s]."""


class PayloadWrench(NamedTuple):
    """Drag and buoyancy of a batch of payloads.

    Attributes
    ----------
    wrench : (B, 6) array
        Force in the world [N], moment about the CoM in the axes of L [N m].
    past, u : (B, 3) arrays
        Velocity of the air relative to the CoM and to the centre of drag, in L [m/s].
    speed : (B, 1) array
        Size of u [m/s].
    drag : (B, 3) array
        Drag in L [N].
    """

    wrench: Array
    past: Array
    u: Array
    speed: Array
    drag: Array


class AirForces(NamedTuple):
    """Forces of the air on a batch of states.

    Attributes
    ----------
    payload : PayloadWrench
    on_quadrotors : (B, n, 3) array
        Rotor drag in the world [N].
    axis : (B, n, 3) array
        Directions of the thrusts.
    size, along : (B, n, 1) arrays
        Thrusts [N], and velocity of the air along them, relative to the quadrotors [m/s].
    turning : (B, n, 3) array
        Velocities of the contacts relative to the CoM, in L [m/s].
    """

    payload: PayloadWrench
    on_quadrotors: Array
    axis: Array
    size: Array
    along: Array
    turning: Array


def payload_wrench(
    model: PayloadModelParameters, R: Array, W: Array, v: Array, wind: Array | None = None
) -> PayloadWrench:
    """Return drag and buoyancy of a batch of payloads.

    Parameters
    ----------
    model : PayloadModelParameters
        With air.
    R, W, v : (B, 3, 3), (B, 3), (B, 3) arrays
        Attitude R_WL, angular velocity in L [rad/s], velocity of the CoM in the world [m/s].
    wind : (3,) or (B, 3) array, optional
        Velocity of the air in the world [m/s].
    """
    air = model.air
    assert air is not None
    past = np.vecmat(-v if wind is None else wind - v, R)
    u = past + np.matvec(model.drag_lever, W)
    speed = np.sqrt(np.vecdot(u, u))[:, None]
    drag = speed * (u @ air.drag)
    buoyancy = GRAVITY * air.mass
    wrench = np.empty((len(R), 6))
    wrench[:, 0:3] = np.matvec(R, drag)
    wrench[:, 2] += buoyancy
    wrench[:, 3:6] = np.matvec(model.drag_lever, drag + buoyancy * R[:, 2])
    return PayloadWrench(wrench, past, u, speed, drag)


def drag_by_velocity(model: PayloadModelParameters, payload: PayloadWrench) -> Array:
    """Return the derivative (B, 3, 3) of the payload's drag by the air's velocity, in L [kg/s]."""
    assert model.air is not None
    D = payload.drag[:, :, None] * (payload.u / np.maximum(payload.speed, _STILL) ** 2)[:, None]
    D += payload.speed[..., None] * model.air.drag
    return D


def air_forces(
    model: PayloadModelParameters,
    x: PayloadState,
    turning: Array,
    wind: Array | None = None,
) -> AirForces:
    """Return the forces of the air on a batch of states.

    Parameters
    ----------
    model : PayloadModelParameters
        With air.
    x : PayloadState
        Batch B.
    turning : (B, n, 3) array
        Velocities of the contacts relative to the CoM, W x a, in L [m/s].
    wind : (3,) or (B, 3) array, optional
        Velocity of the air in the world [m/s].
    """
    assert model.air is not None
    u = model.cable_length[:, None] * small_cross(x.w, x.xi)
    u -= turning @ x.R.mT
    u -= x.v[:, None]
    if wind is not None:
        u += wind if wind.ndim == 1 else wind[:, None]
    size = np.maximum(np.sqrt(np.vecdot(x.F, x.F))[..., None], _STILL)
    axis = x.F / size
    along = np.vecdot(axis, u)[..., None]
    u -= along * axis
    u *= model.air.rotor_drag[:, None]
    payload = payload_wrench(model, x.R, x.W, x.v, wind)
    return AirForces(payload, u, axis, size, along, turning)


def air_jacobians(
    model: PayloadModelParameters, x: PayloadState, tilt: Array, forces: AirForces
) -> tuple[Array, Array]:
    """Return the derivatives of the forces of the air.

    Parameters
    ----------
    model : PayloadModelParameters
        With air.
    x : PayloadState
        Batch B.
    tilt : (B, n, 3, 2) array
        Derivative of the cables' directions with respect to their errors.
    forces : AirForces
        At x.

    Returns
    -------
    wrench : (B, 6, 9) array
        Of the wrench on the payload, by the errors of R and W and by the CoM's velocity.
    on_quadrotors : (B, n, 3, ny + 3) array
        Of the rotor drag, by the core y of the error state and by the CoM's velocity.
    """
    air, p = model.air, forces.payload
    assert air is not None
    by_u = drag_by_velocity(model, p)
    by_state = np.empty((len(x.p), 3, 9))  # of u
    by_state[:, :, 0:3] = skew(p.past)
    by_state[:, :, 3:6] = model.drag_lever
    by_state[:, :, 6:9] = -x.R.mT
    drag = by_u @ by_state
    force = drag.copy()
    force[:, :, 0:3] -= skew(p.drag)
    drag[:, :, 0:3] += skew((GRAVITY * air.mass) * x.R[:, 2])
    return np.concatenate([x.R @ force, model.drag_lever @ drag], axis=1), _rotor_jacobian(
        model, x, tilt, forces
    )


def _rotor_jacobian(
    model: PayloadModelParameters, x: PayloadState, tilt: Array, forces: AirForces
) -> Array:
    """Return the derivative (B, n, 3, ny + 3) of the rotor drag."""
    assert model.air is not None
    n, B, z = model.n, len(x.p), forces.axis
    iA, iB, iF, iv = 6, 6 + 2 * n, 6 + 4 * n, 6 + 7 * n
    J = np.zeros((B, n, 3, iv + 3))  # first of the velocity of the air, but for its sign
    levers = np.empty((B, n, 3, 6))
    levers[..., 0:3] = skew(forces.turning)
    levers[..., 3:6] = model.arm_matrices
    np.matmul(x.R[:, None], levers, out=J[..., 0:6])
    J[..., iv:] = -IDENTITY
    swung = model.cable_length[:, None, None] * tilt
    turned = skew(x.w) @ swung
    for i in range(n):
        J[:, i, :, iA + 2 * i : iA + 2 * i + 2] = turned[:, i]
        J[:, i, :, iB + 2 * i : iB + 2 * i + 2] = swung[:, i]
    across = model.air.rotor_drag[:, None, None] * (IDENTITY - z[..., None] * z[..., None, :])
    J = across @ J
    by_thrust = z[..., None] * forces.on_quadrotors[..., None, :]
    by_thrust += forces.along[..., None] * across
    by_thrust /= -forces.size[..., None]
    for i in range(n):
        J[:, i, :, iF + 3 * i : iF + 3 * i + 3] = by_thrust[:, i]
    return J
