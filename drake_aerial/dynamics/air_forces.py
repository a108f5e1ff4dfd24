"""Forces of the air on payload and quadrotors in the payload model, and their derivatives.

Without air in the model (`PayloadModelParameters.air`), no function here is called.
"""

from typing import NamedTuple

import numpy as np

from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.dynamics.payload_state import PayloadState
from drake_aerial.geometry import IDENTITY, Array, skew, small_cross
from drake_aerial.plant.air import payload_drag, rotor_drag
from drake_aerial.statics.gravity import GRAVITY

_STILL = 1e-9
"""Speed of the air below which the derivative of the quadratic drag counts as zero [m/s]."""


class AirForces(NamedTuple):
    """Forces of the air on a batch of states.

    Attributes
    ----------
    wrench : (B, 6) array
        Force on the payload in the world [N], drag and buoyancy; moment about the CoM in the axes
        of L [N m].
    on_quadrotors : (B, n, 3) array
        Rotor drag in the world [N].
    """

    wrench: Array
    on_quadrotors: Array


class AirJacobians(NamedTuple):
    """Derivatives of `AirForces` by (y, v), the core of the error state and the CoM's velocity.

    Attributes
    ----------
    wrench : (B, 6, 6 + 7 n + 3) array
    on_quadrotors : (B, n, 3, 6 + 7 n + 3) array
    """

    wrench: Array
    on_quadrotors: Array


def payload_wrench(
    model: PayloadModelParameters, R: Array, W: Array, v: Array, wind: Array | None = None
) -> Array:
    """Return force in the world and moment in L about the CoM, (B, 6), of drag and buoyancy.

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
    lever = air.p_LD - model.p_LLcm
    relative = -v if wind is None else wind - v
    f = payload_drag(air.drag, np.vecmat(relative, R) - small_cross(W, lever))
    buoyancy = GRAVITY * air.mass
    wrench = np.empty((len(R), 6))
    wrench[:, 0:3] = np.matvec(R, f)
    wrench[:, 2] += buoyancy
    f += buoyancy * R[:, 2]
    wrench[:, 3:6] = small_cross(lever, f)
    return wrench


def air_forces(
    model: PayloadModelParameters, x: PayloadState, wind: Array | None = None
) -> AirForces:
    """Return the forces of the air on a batch of states.

    Parameters
    ----------
    model : PayloadModelParameters
        With air.
    x : PayloadState
        Batch B.
    wind : (3,) or (B, 3) array, optional
        Velocity of the air in the world [m/s].
    """
    assert model.air is not None
    wrench = payload_wrench(model, x.R, x.W, x.v, wind)
    size = np.sqrt(np.vecdot(x.F, x.F))[..., None]
    velocity = quadrotor_velocities(model, x)
    relative = -velocity if wind is None else np.asarray(wind)[..., None, :] - velocity
    on_quadrotors = rotor_drag(model.air.rotor_drag, x.F / np.maximum(size, 1e-9), relative)
    return AirForces(wrench, on_quadrotors)


def quadrotor_velocities(model: PayloadModelParameters, x: PayloadState) -> Array:
    """Return the velocities (B, n, 3) of the quadrotors in the world [m/s]."""
    turn = skew(x.W) @ model.arms.T
    contact = (x.R @ turn).mT + x.v[:, None]
    return contact - model.cable_length[:, None] * small_cross(x.w, x.xi)


def air_jacobians(
    model: PayloadModelParameters,
    x: PayloadState,
    tilt: Array,
    wind: Array | None = None,
) -> AirJacobians:
    """Return the derivatives of the forces of the air.

    Parameters
    ----------
    model, x, wind :
        As in `air_forces`.
    tilt : (B, n, 3, 2) array
        Derivative of the cables' directions with respect to their errors, E x xi.
    """
    air = model.air
    assert air is not None
    B, ny = len(x.p), 6 + 7 * model.n
    # Payload: u is the velocity of the air relative to the centre of drag, in L.
    lever = air.p_LD - model.p_LLcm
    past = np.vecmat(-x.v if wind is None else wind - x.v, x.R)
    u = past - small_cross(x.W, lever)
    speed = np.sqrt(np.vecdot(u, u))[:, None]
    f = speed * (u @ air.drag)
    by_u = (
        speed[..., None] * air.drag + f[:, :, None] * (u / np.maximum(speed, _STILL) ** 2)[:, None]
    )
    changes = np.empty((B, 3, 9))  # of u by theta, W, v
    changes[:, :, 0:3] = skew(past)
    changes[:, :, 3:6] = skew(lever)
    changes[:, :, 6:9] = -x.R.mT
    df = by_u @ changes
    weight = GRAVITY * air.mass * x.R[:, 2]
    moment = df.copy()
    moment[:, :, 0:3] += skew(weight)
    df[:, :, 0:3] -= skew(f)
    both = np.concatenate([x.R @ df, skew(lever) @ moment], axis=1)
    wrench = np.zeros((B, 6, ny + 3))
    wrench[:, :, 0:6] = both[:, :, 0:6]
    wrench[:, :, ny:] = both[:, :, 6:9]
    return AirJacobians(wrench, _rotor_jacobian(model, x, tilt, wind))


def _rotor_jacobian(
    model: PayloadModelParameters, x: PayloadState, tilt: Array, wind: Array | None
) -> Array:
    """Return the derivative (B, n, 3, ny + 3) of the rotor drag."""
    assert model.air is not None
    n, B, ny = model.n, len(x.p), 6 + 7 * model.n
    l, c = model.cable_length[:, None, None], model.air.rotor_drag[:, None, None]
    velocity = quadrotor_velocities(model, x)
    u = -velocity if wind is None else np.asarray(wind)[..., None, :] - velocity
    size = np.maximum(np.sqrt(np.vecdot(x.F, x.F)), 1e-9)[..., None]
    z = x.F / size
    across = IDENTITY - z[..., :, None] * z[..., None, :]
    P = c * across
    J = np.zeros((B, n, 3, ny + 3))
    turned = P @ x.R[:, None]
    J[..., 0:3] = turned @ skew(np.cross(x.W[:, None], model.arms))
    J[..., 3:6] = turned @ model.arm_matrices
    J[..., ny:] = -P
    blocks = [(6, 2, l * (P @ skew(x.w) @ tilt)), (6 + 2 * n, 2, l * (P @ tilt))]
    along = np.vecdot(z, u)[..., None, None]
    by_axis = -c * (z[..., :, None] * u[..., None, :] + along * IDENTITY)
    blocks.append((6 + 4 * n, 3, by_axis @ across / size[..., None]))
    for first, width, block in blocks:
        for i in range(n):
            J[:, i, :, first + width * i : first + width * (i + 1)] = block[:, i]
    return J
