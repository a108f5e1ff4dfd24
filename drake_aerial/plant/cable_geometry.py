"""Geometry of cables: directions and rates from the states of payload and quadrotors."""

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np

from drake_aerial.geometry import Array


class ContactOffsets(NamedTuple):
    """Offsets of n contacts from their quadrotors.

    Attributes
    ----------
    p_QC_W, v_QC_W : (n, 3) arrays
        Vectors from quadrotor to contact [m] and their rates [m/s], in the world frame.
    R_WL : (3, 3) array
        Rotation of the payload.
    """

    p_QC_W: Array
    v_QC_W: Array
    R_WL: Array


def rotation(q: Array) -> Array:
    """Return the rotation matrix (3, 3) of one unit quaternion (w, x, y, z)."""
    return np.array(_matrix(float(q[0]), float(q[1]), float(q[2]), float(q[3]))).reshape(3, 3)


def contact_offsets(payload_state: Array, quadrotor_states: Array, p_LC: Array) -> ContactOffsets:
    """Return the offsets of n contacts from their quadrotors.

    Parameters
    ----------
    payload_state : (13,) array
        w x y z, position [m], angular [rad/s] and linear velocity [m/s] of L in the world.
    quadrotor_states : (13 n,) array
        The same of each quadrotor.
    p_LC : (n, 3) array
        Contacts in L [m].
    """
    offsets = np.array(_offsets(payload_state.tolist(), quadrotor_states.tolist(), p_LC.tolist()))
    return ContactOffsets(offsets[:, 0:3], offsets[:, 3:6], rotation(payload_state))


def cable_directions(
    payload_state: Sequence[float],
    quadrotor_states: Sequence[float],
    p_LC: Sequence[Sequence[float]],
) -> list[float]:
    """Return the directions of n cables, 6 n floats.

    For each cable: the unit vector from quadrotor to contact and its rate [1/s], in the world.

    Parameters
    ----------
    payload_state : 13 floats
    quadrotor_states : 13 n floats
    p_LC : n contacts of 3 floats
        The arguments of `contact_offsets`, as lists.
    """
    directions: list[float] = []
    for dx, dy, dz, ex, ey, ez in _offsets(payload_state, quadrotor_states, p_LC):
        inverse = 1.0 / max(sqrt(dx * dx + dy * dy + dz * dz), 1e-9)
        x, y, z = dx * inverse, dy * inverse, dz * inverse
        along = x * ex + y * ey + z * ez
        directions += [
            x,
            y,
            z,
            (ex - x * along) * inverse,
            (ey - y * along) * inverse,
            (ez - z * along) * inverse,
        ]
    return directions


def _offsets(
    payload_state: Sequence[float],
    quadrotor_states: Sequence[float],
    p_LC: Sequence[Sequence[float]],
) -> list[tuple[float, float, float, float, float, float]]:
    """Return for each contact the vector from its quadrotor [m] and its rate [m/s]."""
    # Plain floats are several times faster than arrays for one to six cables.
    w, x, y, z, px, py, pz, wx, wy, wz, vx, vy, vz = payload_state
    xx, xy, xz, yx, yy, yz, zx, zy, zz = _matrix(w, x, y, z)
    offsets = []
    for k, (a, b, c) in enumerate(p_LC):
        i = 13 * k + 4
        qx, qy, qz = quadrotor_states[i : i + 3]
        ux, uy, uz = quadrotor_states[i + 6 : i + 9]
        # From L's origin to the contact.
        rx, ry, rz = xx * a + xy * b + xz * c, yx * a + yy * b + yz * c, zx * a + zy * b + zz * c
        dx, dy, dz = px + rx - qx, py + ry - qy, pz + rz - qz
        ex, ey, ez = (
            vx + wy * rz - wz * ry - ux,
            vy + wz * rx - wx * rz - uy,
            vz + wx * ry - wy * rx - uz,
        )
        offsets.append((dx, dy, dz, ex, ey, ez))
    return offsets


def _matrix(w: float, x: float, y: float, z: float) -> tuple[float, ...]:
    """Return the rotation matrix of a unit quaternion, row by row."""
    return (
        1 - 2 * (y * y + z * z),
        2 * (x * y - w * z),
        2 * (x * z + w * y),
        2 * (x * y + w * z),
        1 - 2 * (x * x + z * z),
        2 * (y * z - w * x),
        2 * (x * z - w * y),
        2 * (y * z + w * x),
        1 - 2 * (x * x + y * y),
    )
