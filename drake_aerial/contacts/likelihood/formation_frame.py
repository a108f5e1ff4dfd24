"""The formation frame that fits one configuration of grippers, with derivatives."""

from dataclasses import dataclass

import numpy as np

from drake_aerial.geometry import Array, Pose, axis_of, cross
from drake_aerial.skill.configuration_model import ConfigurationModel

# Squared length of the yaw's resultant below which the yaw is undefined; its derivative is then 0.
_UNDEFINED = 1e-12


@dataclass(frozen=True, eq=False)
class FormationFrame:
    """Formation frame of one configuration; see `ConfigurationModel.formation_frames`.

    Attributes
    ----------
    origin : (3,) array
        The mean gripper position in N [m].
    yaw : float
        Yaw in N [rad].
    yaw_by_p : (n, 3) array
        Derivatives of the yaw by gripper positions [rad/m].
    yaw_by_w : (n, 3) array
        Derivatives of the yaw by rotation vectors w in N of exp(w) R_NG (dimensionless).
    """

    origin: Array
    yaw: float
    yaw_by_p: Array
    yaw_by_w: Array

    def turned(self, v_F: Array) -> Array:
        """Return vectors v_F (..., 3) expressed in N."""
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        x, y = v_F[..., 0], v_F[..., 1]
        return np.stack([c * x - s * y, s * x + c * y, v_F[..., 2]], axis=-1)


class FormationFrames:
    """Formation frames of a configuration model, for one configuration at a time.

    Parameters
    ----------
    configuration : ConfigurationModel
        The demonstrated configuration of n grippers.
    """

    def __init__(self, configuration: ConfigurationModel):
        self.configuration = configuration
        weight = 1.0 / configuration.sigma_p**2
        self._c_p, self._s_p = (
            moment - moment.mean(axis=0) for moment in _moments(configuration.X_FG.p, weight)
        )
        axes, weight = ((2,), 1.0) if configuration.axial else ((0, 1, 2), 0.5)
        self._axes = [
            (
                axis,
                *_moments(axis_of(configuration.X_FG.q, axis), weight / configuration.sigma_q**2),
            )
            for axis in axes
        ]
        self._last: tuple[Pose, FormationFrame] | None = None

    def __call__(self, X_NG: Pose) -> FormationFrame:
        """Return the frame of grippers X_NG (n,) in N; cached for the object of the last call."""
        if self._last is None or self._last[0] is not X_NG:
            self._last = X_NG, self._frame(X_NG)
        return self._last[1]

    def _frame(self, X_NG: Pose) -> FormationFrame:
        # The moments are centred, so that the mean of the grippers drops out.
        cosine, sine = np.sum(self._c_p * X_NG.p), np.sum(self._s_p * X_NG.p)
        c_w, s_w = np.zeros((2, *X_NG.p.shape))
        for axis, c, s in self._axes:
            moved = axis_of(X_NG.q, axis)
            cosine, sine = cosine + np.sum(c * moved), sine + np.sum(s * moved)
            c_w, s_w = c_w + cross(moved, c), s_w + cross(moved, s)
        square = cosine**2 + sine**2
        defined = 1.0 / square if square > _UNDEFINED else 0.0
        return FormationFrame(
            X_NG.p.mean(axis=0),
            float(np.arctan2(sine, cosine)),
            (cosine * self._s_p - sine * self._c_p) * defined,
            (cosine * s_w - sine * c_w) * defined,
        )


def about_z(v: Array) -> Array:
    """Return e_z x v (..., 3), the derivative of vectors v by a rotation about z [1/rad]."""
    return np.stack([-v[..., 1], v[..., 0], np.zeros(v.shape[:-1])], axis=-1)


def _moments(reference: Array, weight: float) -> tuple[Array, Array]:
    """Return vectors (n, 3) whose products with grippers give the yaw's cosine and sine parts."""
    level = weight * reference * [1.0, 1.0, 0.0]
    return level, about_z(level)
