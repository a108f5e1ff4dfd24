"""Kernel density over surface features, SE(3) x R^2, as used by object, task, contact models."""

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.density import kernels
from drake_aerial.density.mixture import (
    checked_weights,
    exponent_blocks,
    exponentiate,
    lift,
    lifted_gaussian,
    log_weighted_sums,
)
from drake_aerial.geometry import Array, Pose
from drake_aerial.io.records import Positive, record


@record(frozen=True)
class Bandwidth:
    """Bandwidths sigma of a surface feature's kernel."""

    position: Positive = 0.02
    """Standard deviation of the position [m]."""
    rotation: Positive = float(np.deg2rad(15.0))
    """Standard deviation of the rotation vector, per axis [rad]."""
    descriptor: Positive = 0.2
    """Standard deviation of the descriptor r, curvature times rho (dimensionless)."""


class SurfaceDensity:
    """Sum of kernels N_3(p | p_i) Theta(q | q_i) N_2(r | r_i) over surface features s = (p, q, r).

    It is the equation of the paper's section "Kernel density estimator". The pose may be that of a
    surface feature, or of a gripper relative to one (the contact model).

    Parameters
    ----------
    pose : Pose
        Centres: p (K, 3) [m], q (K, 4).
    descriptor : (K, 2) array
        Centres of the descriptor (dimensionless).
    weights : (K,) array, optional
        Kernel weights; scaled so that they sum to one. Uniform by default.
    bandwidth : Bandwidth
        Bandwidths of position [m], rotation [rad] and descriptor.

    Raises
    ------
    InputError
        If there is no kernel, or the weights are negative, not finite or all zero.
    """

    def __init__(
        self,
        pose: Pose,
        descriptor: ArrayLike,
        weights: ArrayLike | None = None,
        *,
        bandwidth: Bandwidth | None = None,
    ):
        self.pose = Pose(np.asarray(pose.p, float), np.asarray(pose.q, float))
        self.descriptor = np.asarray(descriptor, float).reshape(-1, 2)
        self.weights = checked_weights(weights, len(self.pose.p), "a surface density")
        self.bandwidth = bandwidth or Bandwidth()
        self._origin = self.pose.p.mean(axis=0)
        self._of_descriptor = lifted_gaussian(self.descriptor, self.bandwidth.descriptor)

    def __len__(self) -> int:
        return len(self.weights)

    def log_density(self, pose: Pose, descriptor: ArrayLike) -> Array:
        """Return the log-density (...) at poses p (..., 3), q (..., 4), descriptors (..., 2)."""
        points, coefficients, log_norm = self._lifted(pose, descriptor)
        weights = np.concatenate([self.weights, self.weights])[:, None]
        sums = log_weighted_sums(points, coefficients, weights)[:, 0] + log_norm
        return sums.reshape(np.shape(pose.p)[:-1])

    def log_descriptor_density(self, descriptor: ArrayLike) -> Array:
        """Return the log of the marginal density of the descriptor r (..., 2), shape (...)."""
        r = np.asarray(descriptor, float)
        sums = log_weighted_sums(
            lift(r.reshape(-1, 2)), self._of_descriptor, self.weights[:, None]
        )[:, 0]
        return (sums + kernels.gaussian_log_norm(2, self.bandwidth.descriptor)).reshape(
            r.shape[:-1]
        )

    def sample_kernels(self, descriptor: ArrayLike, rng: np.random.Generator) -> np.ndarray:
        """Draw for each descriptor (N, 2) a kernel's index by its posterior probability."""
        r = np.asarray(descriptor, float).reshape(-1, 2)
        index, u = np.empty(len(r), int), rng.random(len(r))
        for rows, e in exponent_blocks(lift(r), self._of_descriptor):
            exponentiate(e)
            cumulative = np.cumsum(e * self.weights, axis=1)
            index[rows] = np.sum(cumulative < u[rows, None] * cumulative[:, -1:], axis=1)
        return np.minimum(index, len(self) - 1)

    def sample(self, n: int, rng: np.random.Generator) -> tuple[Pose, Array]:
        """Draw n features: poses p (n, 3) [m], q (n, 4), and descriptors (n, 2)."""
        i = rng.choice(len(self), size=n, p=self.weights)
        p = self.pose.p[i] + self.bandwidth.position * rng.standard_normal((n, 3))
        q = kernels.sample_theta(self.pose.q[i], self.bandwidth.rotation, rng)
        r = self.descriptor[i] + self.bandwidth.descriptor * rng.standard_normal((n, 2))
        return Pose(p, q), r

    def _lifted(self, pose: Pose, descriptor: ArrayLike) -> tuple[Array, Array, float]:
        """Return lifted points, coefficients of the kernels at q_i and -q_i, and the log-norm."""
        p, q = np.reshape(pose.p, (-1, 3)), np.reshape(pose.q, (-1, 4))
        r = np.reshape(np.asarray(descriptor, float), (-1, 2))
        b = self.bandwidth
        kappa = kernels.rotation_concentration(b.rotation)
        rows = np.vstack(
            [lifted_gaussian(self.pose.p - self._origin, b.position), self._of_descriptor]
        )
        # The largest exponent of the rotation, kappa, is moved into the constant.
        rows[4] -= kappa
        rotation = kappa * np.concatenate([self.pose.q, -self.pose.q]).T
        log_norm = kernels.gaussian_log_norm(3, b.position) + kernels.gaussian_log_norm(
            2, b.descriptor
        )
        points = np.hstack([lift(p - self._origin), lift(r), q])
        return (
            points,
            np.vstack([np.hstack([rows, rows]), rotation]),
            log_norm + kernels.theta_log_norm(b.rotation) + kappa,
        )
