"""State of the payload model."""

from typing import NamedTuple

from drake_aerial.geometry import Array


class PayloadState(NamedTuple):
    """Batch of states of the model.

    Attributes
    ----------
    p, v : (B, 3) arrays
        CoM position and velocity in the world [m, m/s].
    R : (B, 3, 3) array
        Attitude R_WL.
    W : (B, 3) array
        Angular velocity of the payload in the axes of L [rad/s].
    xi, w : (B, n, 3) arrays
        Directions (unit, from quadrotor to contact) and angular velocities [rad/s] of the cables,
        in the world.
    F : (B, n, 3) array
        Thrust vectors in the world [N].
    """

    p: Array
    v: Array
    R: Array
    W: Array
    xi: Array
    w: Array
    F: Array
