"""Where a cable's two ends are and how they move, from the bodies' states."""

from __future__ import annotations

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
