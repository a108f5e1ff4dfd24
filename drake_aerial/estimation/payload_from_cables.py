"""State of a payload from quadrotors and cable angles, without a sensor on the payload."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.geometry import (
    Array,
    cross,
    matrix_from_quat,
    quat_from_matrix,
    quat_from_two_vectors,
    skew,
)

_LEAST_RATE = 1e-6
"""Regularisation of the angular velocity, which is not observable about a single cable."""


class PayloadFromCables(LeafSystem):
    """Pose and velocity of a payload whose cables are taut; it has no state.

    The contacts are a cable's length from the quadrotors along the measured directions. Three or
    more contacts that are not on a line give the pose. Otherwise the centre of mass is assumed to
    hang straight below the contacts, along the mean direction of the cables: an error of the
    believed centre of mass becomes one of the attitude, and the payload's swing about its contacts
    is not seen. The yaw on one cable is not observable and taken as zero.

    | port | size | meaning | unit | frame |
    |---|---|---|---|---|
    | in `quadrotor_states` | 13 n | w x y z, p, angular, linear velocity of Q | m, rad/s | world |
    | in `cable_directions` | 6 n | unit vector quadrotor to contact, rate | -, 1/s | world |
    | out `payload_state` | 13 | the same of L | m, rad/s | world |

    Parameters
    ----------
    model : PayloadModelParameters
        Believed model: contacts, centre of mass and cable lengths.
    """

    def __init__(self, model: PayloadModelParameters):
        super().__init__()
        n = model.n
        self._model = model
        self._centre = model.p_LC.mean(axis=0)
        below = model.p_LLcm - self._centre
        # One cable alone carries the payload below its contact even if the model is singular.
        self._below = below if np.linalg.norm(below) > 1e-6 else np.array([0.0, 0.0, -1e-3])
        self._points = model.p_LC - self._centre
        if model.hinged:
            self._points = np.concatenate([self._points, self._below[None]])
        self._quadrotors = self.DeclareVectorInputPort("quadrotor_states", 13 * n)
        self._cables = self.DeclareVectorInputPort("cable_directions", 6 * n)
        self.DeclareVectorOutputPort("payload_state", 13, self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        states = self._quadrotors.Eval(context).reshape(-1, 13)
        cables = self._cables.Eval(context).reshape(-1, 6)
        length = self._model.cable_length[:, None]
        contacts = states[:, 4:7] + length * cables[:, 0:3]
        rates = states[:, 10:13] + length * cables[:, 3:6]
        centre, velocity = contacts.mean(axis=0), rates.mean(axis=0)
        found, moving = contacts - centre, rates - velocity
        if self._model.hinged:
            size = np.linalg.norm(self._below)
            mean = cables.mean(axis=0)
            scale = size / np.linalg.norm(mean[0:3])
            down = mean[0:3] / np.linalg.norm(mean[0:3])
            turning = scale * (mean[3:6] - down * (down @ mean[3:6]))
            found = np.concatenate([found, size * down[None]])
            moving = np.concatenate([moving, turning[None]])
        R = self._attitude(found)
        # moving_k = omega x found_k, by least squares.
        A = -skew(found).reshape(-1, 3)
        normal = A.T @ A + _LEAST_RATE * np.eye(3)
        omega = np.linalg.solve(normal, A.T @ moving.ravel())
        offset = R @ self._centre
        state = np.concatenate(
            [quat_from_matrix(R), centre - offset, omega, velocity - cross(omega, offset)]
        )
        output.SetFromVector(state)

    def _attitude(self, found: Array) -> Array:
        """Return R_WL from points (k, 3) that belong to those of the model."""
        if self._model.n == 1:
            down = found[-1] / np.linalg.norm(found[-1])
            below = self._below / np.linalg.norm(self._below)
            return matrix_from_quat(quat_from_two_vectors(below, down))
        U, _, Vt = np.linalg.svd(found.T @ self._points)
        flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))])
        R: Array = U @ flip @ Vt
        return R
