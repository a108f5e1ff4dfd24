"""The decision variables of a contact program: gripper poses in the cloud's own frame."""

from __future__ import annotations

import numpy as np

from drake_aerial.geometry import (
    Array,
    Pose,
    cross,
    invert,
    matrix_from_quat,
    quat_multiply,
    transform,
)

_REMEMBERED = 16


class GripperVariables:
    """The vector x (7 n): for each gripper its position p_SG [m] and quaternion q_SG (w, x, y, z).

    S is the cloud's frame, in which users think; densities and constraints are evaluated in its canonical frame N.
    A quaternion q that is not of unit length stands for the rotation q / |q|, so that every function is smooth around
    the unit sphere.

    Parameters
    ----------
    X_SN : Pose
        The canonical frame in the cloud's frame.
    """

    def __init__(self, X_SN: Pose):
        self.X_SN, self._X_NS = X_SN, invert(X_SN)
        self._R_SN = matrix_from_quat(X_SN.q)
        # A solver asks many functions at the same x, one after another.
        self._poses: dict[bytes, Pose] = {}

    def vector(self, X_NG: Pose) -> Array:
        """Return x (7 n) of grippers X_NG (n,)."""
        X_SG = self.X_SN @ X_NG
        return np.hstack([X_SG.p, X_SG.q]).ravel()

    def poses(self, x: Array) -> Pose:
        """Return the grippers X_NG (n,) of x (7 n); the same object for the same x, as long as it is remembered."""
        key = x.tobytes()
        if key not in self._poses:
            if len(self._poses) >= _REMEMBERED:
                self._poses.clear()
            rows = np.reshape(x, (-1, 7))
            q = rows[:, 3:] / np.sqrt(np.sum(rows[:, 3:] ** 2, axis=1, keepdims=True))
            self._poses[key] = Pose(
                transform(self._X_NS, rows[:, :3]), quat_multiply(self._X_NS.q, q)
            )
        return self._poses[key]

    def jacobian(self, x: Array, by_p: Array, by_w: Array) -> Array:
        """Return the Jacobian (m, 7 n) by x from those by poses in N.

        Parameters
        ----------
        x : (7 n,) array
            Where.
        by_p : (m, n, 3) array
            Derivatives by the positions p_NG [1/m].
        by_w : (m, n, 3) array
            Derivatives by rotation vectors w in N [1/rad] of the perturbed rotations exp(w) R_NG.
        """
        q = np.reshape(x, (-1, 7))[:, 3:]
        # Row vectors: g_S = R_SN g_N.
        g_p, g_w = by_p @ self._R_SN.T, by_w @ self._R_SN.T
        out = np.empty((*g_p.shape[:2], 7))
        out[..., :3] = g_p
        # w = 2 vec(dq conj(q)) / |q|^2.
        scale = 2.0 / np.sum(q * q, axis=1)
        w, v = q[:, :1], q[:, 1:]
        out[..., 3] = -np.sum(v * g_w, axis=-1) * scale
        out[..., 4:] = (w * g_w - cross(v, g_w)) * scale[:, None]
        return out.reshape(len(out), -1)
