"""The ten inertial parameters of a rigid body, in which Newton-Euler is linear.

phi = (m, m c_x, m c_y, m c_z, I_xx, I_yy, I_zz, I_xy, I_xz, I_yz): the mass, the first moment and
the rotational inertia about the origin L, in the axes of L.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.geometry import IDENTITY, Array, skew

NAMES = ("m", "mx", "my", "mz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
"""Names of the ten parameters."""


class InertialParameters(NamedTuple):
    """Mass, centre of mass and inertia of a body with frame L.

    Attributes
    ----------
    mass : float
        [kg]
    com : (3,) array
        Centre of mass p_LLcm [m].
    inertia : (3, 3) array
        Rotational inertia about the centre of mass, in the axes of L [kg m^2].
    """

    mass: float
    com: Array
    inertia: Array

    @classmethod
    def from_vector(cls, phi: Array) -> InertialParameters:
        """Return the parameters in a vector phi (10,).

        Raises
        ------
        InputError
            If the mass is not positive.
        """
        if not phi[0] > 0.0:
            raise InputError(f"the mass of inertial parameters must be positive, got {phi[0]:g} kg")
        com = phi[1:4] / phi[0]
        about_origin = inertia_matrix(phi)
        S = skew(com)
        return cls(float(phi[0]), com, about_origin + phi[0] * S @ S)

    def to_vector(self) -> Array:
        """Return phi (10,)."""
        S = skew(self.com)
        J = np.asarray(self.inertia) - self.mass * S @ S
        off = J[[0, 0, 1], [1, 2, 2]]
        return np.concatenate([[self.mass], self.mass * np.asarray(self.com), np.diag(J), off])


def inertia_matrix(phi: Array) -> Array:
    """Return the rotational inertia (3, 3) about the origin in phi (10,) [kg m^2]."""
    xx, yy, zz, xy, xz, yz = phi[4:10]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def pseudo_inertia(phi: Array) -> Array:
    """Return the pseudo-inertia matrix (4, 4) of phi (10,), a linear function of phi.

    It is positive semidefinite for every body with a distribution of positive mass, and only then
    (Wensing, Kim and Slotine, "Linear Matrix Inequalities for Physically Consistent Inertial
    Parameter Identification", RA-L 2018).
    """
    J = inertia_matrix(phi)
    matrix = np.empty((4, 4))
    matrix[:3, :3] = 0.5 * np.trace(J) * IDENTITY - J
    matrix[:3, 3] = matrix[3, :3] = phi[1:4]
    matrix[3, 3] = phi[0]
    return matrix


def inertia_columns(W: Array) -> Array:
    """Return the matrix (..., 3, 6) that takes the six entries of an inertia I to I W.

    Parameters
    ----------
    W : (..., 3) array
        Angular velocity or acceleration, in the axes of L.
    """
    x, y, z = np.moveaxis(W, -1, 0)
    o = np.zeros_like(x)
    rows = ([x, o, o, y, z, o], [o, y, o, x, o, z], [o, o, z, o, x, y])
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def regressor(v_dot: Array, W: Array, W_dot: Array, gravity: Array) -> Array:
    """Return the matrix Y (..., 6, 10) with Y phi = the wrench that moves the body.

    The wrench is the force, then the moment about the origin of L, without the weight, both in the
    axes of L: Newton-Euler solved for the applied wrench.

    Parameters
    ----------
    v_dot : (..., 3) array
        Acceleration of L's origin, in the axes of L [m/s^2].
    W, W_dot : (..., 3) arrays
        Angular velocity [rad/s] and acceleration [rad/s^2] in the axes of L.
    gravity : (..., 3) array
        Gravity in the axes of L [m/s^2].
    """
    a = v_dot - gravity
    S, turn = skew(W), skew(W_dot)
    Y = np.zeros((*np.broadcast_shapes(a.shape, W.shape)[:-1], 6, 10))
    Y[..., 0:3, 0] = a
    Y[..., 0:3, 1:4] = turn + S @ S
    Y[..., 3:6, 1:4] = -skew(a)
    Y[..., 3:6, 4:10] = inertia_columns(W_dot) + S @ inertia_columns(W)
    return Y
