"""Where a cable's two ends are and how they move, from the bodies' states."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np

from drake_aerial.geometry import Array


class ContactOffsets(NamedTuple):
    """Of n contacts.

    Attributes
    ----------
    p_QC_W, v_QC_W : (n, 3) arrays
        Vector from each quadrotor to its contact [m], and its rate [m/s], in the world frame.
    R_WL : (3, 3) array
        The payload's rotation.
    """

    p_QC_W: Array
    v_QC_W: Array
    R_WL: Array


def rotation(q: Array) -> Array:
    """Return the rotation matrix (3, 3) of one unit quaternion (w, x, y, z); scalar arithmetic, for the plant's rate."""
    w, x, y, z = float(q[0]), float(q[1]), float(q[2]), float(q[3])
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def contact_offsets(payload_state: Array, quadrotor_states: Array, p_LC: Array) -> ContactOffsets:
    """Return where n contacts are, seen from their quadrotors.

    Parameters
    ----------
    payload_state : (13,) array
        w x y z, position [m], angular [rad/s] and linear velocity [m/s] of L in the world.
    quadrotor_states : (13 n,) array
        The same of each quadrotor.
    p_LC : (n, 3) array
        Contacts in L [m].
    """
    R_WL = rotation(payload_state[:4])
    arm = p_LC @ R_WL.T
    wx, wy, wz = payload_state[7], payload_state[8], payload_state[9]
    spin = np.array([[0.0, wz, -wy], [-wz, 0.0, wx], [wy, -wx, 0.0]])  # transposed, for rows: arm @ spin = w x arm
    quadrotors = quadrotor_states.reshape(-1, 13)
    return ContactOffsets(
        payload_state[4:7] + arm - quadrotors[:, 4:7],
        payload_state[10:13] + arm @ spin - quadrotors[:, 10:13],
        R_WL,
    )


def cable_directions(
    payload_state: Sequence[float], quadrotor_states: Sequence[float], p_LC: Sequence[Sequence[float]]
) -> list[float]:
    """Return per cable (6 n) the unit vector from quadrotor to contact and its rate [1/s], in the world frame.

    The same as from `contact_offsets`, in plain floats: for a sensor that sees few cables at a time.

    Parameters
    ----------
    payload_state : 13 floats
    quadrotor_states : 13 n floats
    p_LC : n contacts of 3 floats
        As of `contact_offsets`.
    """
    w, qx, qy, qz, px, py, pz, wx, wy, wz, vx, vy, vz = payload_state
    xx, yy, zz, xy, xz, yz = qx * qx, qy * qy, qz * qz, qx * qy, qx * qz, qy * qz
    ax, ay, az = w * qx, w * qy, w * qz
    directions: list[float] = []
    for k, (a, b, c) in enumerate(p_LC):
        i = 13 * k + 4
        x, y, z = quadrotor_states[i : i + 3]
        ux, uy, uz = quadrotor_states[i + 6 : i + 9]
        # The arm from L's origin to the contact, then what is from quadrotor to contact, and its rate.
        rx = (1 - 2 * (yy + zz)) * a + 2 * (xy - az) * b + 2 * (xz + ay) * c
        ry = 2 * (xy + az) * a + (1 - 2 * (xx + zz)) * b + 2 * (yz - ax) * c
        rz = 2 * (xz - ay) * a + 2 * (yz + ax) * b + (1 - 2 * (xx + yy)) * c
        dx, dy, dz = px + rx - x, py + ry - y, pz + rz - z
        ex, ey, ez = vx + wy * rz - wz * ry - ux, vy + wz * rx - wx * rz - uy, vz + wx * ry - wy * rx - uz
        inverse = 1.0 / max(sqrt(dx * dx + dy * dy + dz * dz), 1e-9)
        dx, dy, dz = dx * inverse, dy * inverse, dz * inverse
        along = dx * ex + dy * ey + dz * ez
        directions += [dx, dy, dz]
        directions += [(ex - dx * along) * inverse, (ey - dy * along) * inverse, (ez - dz * along) * inverse]
    return directions
