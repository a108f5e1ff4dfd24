"""The configuration model H(h): the formation of grippers, and gravity (docs/method.md)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drake_aerial.density import kernels
from drake_aerial.geometry import (
    Array,
    Pose,
    axis_of,
    quat_about_axis,
    quat_conjugate,
    quat_multiply,
    rotate,
)

_Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class ConfigurationModel:
    """The demonstrated configuration in its formation frame F.

    F has its origin at the mean gripper position, z up and a free yaw.

    Attributes
    ----------
    X_FG : Pose
        Demonstrated gripper poses, batch (n,).
    p_FQ : (n, 3) array
        Demonstrated quadrotor positions [m].
    cable_length : (n,) array
        Cable lengths [m].
    sigma_p : float
        Bandwidth of gripper positions in F [m].
    sigma_q : float
        Bandwidth of gripper attitudes [rad].
    axial : bool
        Whether only the grippers' z axes are compared.
    vertical : float
        Weight of height differences: sigma_p over the bandwidth of heights.
    """

    X_FG: Pose
    p_FQ: Array
    cable_length: Array
    sigma_p: float
    sigma_q: float
    axial: bool
    vertical: float = 1.0

    def __len__(self) -> int:
        return len(self.cable_length)

    @classmethod
    def learn(
        cls,
        X_NG: Pose,
        X_NQ: Pose,
        cable_length: Array,
        *,
        sigma_p: float,
        sigma_q: float,
        axial: bool,
    ) -> ConfigurationModel:
        """Learn from demonstrated gripper and quadrotor poses (n,) in a frame N whose z is up."""
        origin = X_NG.p.mean(axis=0)
        return cls(
            Pose(X_NG.p - origin, X_NG.q),
            X_NQ.p - origin,
            np.asarray(cable_length, float),
            sigma_p,
            sigma_q,
            axial,
        )

    def with_heights(self, stretch: float, vertical: float) -> ConfigurationModel:
        """Return the model with other gripper heights.

        Parameters
        ----------
        stretch : float
            Factor of the grippers' heights in F; quadrotors keep their offsets from the grippers.
        vertical : float
            Weight of height differences; as the attribute.
        """
        p_FG = self.X_FG.p * [1.0, 1.0, stretch]
        p_FQ = self.p_FQ + p_FG - self.X_FG.p
        return replace(self, X_FG=Pose(p_FG, self.X_FG.q), p_FQ=p_FQ, vertical=vertical)

    @property
    def cable_direction(self) -> Array:
        """Demonstrated unit directions (n, 3) in F from each gripper to its quadrotor."""
        d = self.p_FQ - self.X_FG.p
        return d / np.linalg.norm(d, axis=1, keepdims=True)

    def formation_frames(self, X_NG: Pose) -> tuple[Array, Array]:
        """Fit the formation frames of grippers X_NG (..., n).

        The yaw is the one with the largest H: two-dimensional Procrustes in closed form, positions
        and axes weighted by their bandwidths. With n = 1 only the gripper's attitude fixes it.

        Returns
        -------
        origin : (..., 3) array
            Origins of F in N [m].
        yaw : (...) array
            Yaws of F in N [rad].
        """
        origin = X_NG.p.mean(axis=-2)
        p = X_NG.p - origin[..., None, :]
        cosine, sine = _planar_moments(self.X_FG.p, p, 1.0 / self.sigma_p**2)
        # A tilt costs the same whether one axis is compared or three, each at half the weight.
        axes, weight = ((2,), 1.0) if self.axial else ((0, 1, 2), 0.5)
        for axis in axes:
            c, s = _planar_moments(
                axis_of(self.X_FG.q, axis), axis_of(X_NG.q, axis), weight / self.sigma_q**2
            )
            cosine, sine = cosine + c, sine + s
        return origin, np.arctan2(sine, cosine)

    def demonstrated_at(self, origin: Array, yaw: Array, scale: Array | float = 1.0) -> Pose:
        """Return the demonstrated grippers X_NG (..., n) at given formation frames.

        Parameters
        ----------
        origin : (..., 3) array
            Origins of the formation frames in N [m].
        yaw : (...) array
            Their yaws in N [rad].
        scale : (...) array
            Factor of the grippers' offsets from the origin.
        """
        q = quat_about_axis(_Z, np.asarray(yaw))[..., None, :]
        offset = rotate(q, self.X_FG.p) * np.asarray(scale, float)[..., None, None]
        return Pose(np.asarray(origin)[..., None, :] + offset, quat_multiply(q, self.X_FG.q))

    def log_density(
        self,
        X_NG: Pose,
        scale: Array | float = 1.0,
        frames: tuple[Array, Array] | None = None,
    ) -> Array:
        """Return log H (...) of gripper poses X_NG (..., n) in a frame N whose z is up.

        Parameters
        ----------
        X_NG : Pose
            Gripper poses: p (..., n, 3) [m], q (..., n, 4).
        scale : (...) array
            Factor of the demonstrated gripper offsets, for objects of another size.
        frames : (..., 3) and (...) arrays, optional
            `formation_frames` of X_NG, if they are known already.
        """
        origin, yaw = self.formation_frames(X_NG) if frames is None else frames
        q_FN = quat_conjugate(quat_about_axis(_Z, yaw))[..., None, :]
        p_FG = rotate(q_FN, X_NG.p - origin[..., None, :])
        q_FG = quat_multiply(q_FN, X_NG.q)
        reference = self.X_FG.p * np.asarray(scale, float)[..., None, None]
        weight = np.array([1.0, 1.0, self.vertical])
        terms = kernels.log_gaussian(weight * p_FG, weight * reference, self.sigma_p) + np.log(
            self.vertical
        )
        if self.axial:
            terms = terms + kernels.log_axis(
                axis_of(q_FG, 2), axis_of(self.X_FG.q, 2), self.sigma_q
            )
        else:
            terms = terms + kernels.log_theta(q_FG, self.X_FG.q, self.sigma_q)
        return terms.sum(axis=-1)

    def quadrotors_over(self, X_NG: Pose) -> Pose:
        """Return level quadrotors X_NQ (..., n) on taut cables in the demonstrated directions."""
        _, yaw = self.formation_frames(X_NG)
        q = quat_about_axis(_Z, yaw)[..., None, :]
        p = X_NG.p + rotate(q, self.cable_direction * self.cable_length[:, None])
        level = np.zeros((*p.shape[:-1], 4))
        level[..., 0] = 1.0
        return Pose(p, level)


def _planar_moments(reference: Array, moved: Array, weight: float) -> tuple[Array, Array]:
    """Return the cosine and sine parts (...) of sum_n weight R_z(yaw) reference_n . moved_n."""
    cosine = np.sum(moved[..., :2] * reference[..., :2], axis=(-1, -2))
    sine = np.sum(reference[..., 0] * moved[..., 1] - reference[..., 1] * moved[..., 0], axis=-1)
    return weight * cosine, weight * sine
