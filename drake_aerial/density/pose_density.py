"""Kernel density over poses, SE(3), as used for query densities and the paper's votes."""

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
from drake_aerial.geometry import (
    Array,
    Pose,
    axis_of,
    cross,
    quat_about_axis,
    quat_conjugate,
    quat_multiply,
)


class PoseDensity:
    """Sum of kernels N_3(p | p_k, sigma_p) R(q | q_k, sigma_q) over poses X_AB of a frame B in A.

    R is Theta, the antipodal von Mises-Fisher pair on S^3. With `axial` it is the von Mises-Fisher
    density of B's z axis on S^2, for grippers that are symmetric about it.

    Parameters
    ----------
    kernels_at : Pose
        Centres of the K kernels: positions (K, 3) [m], unit quaternions (K, 4).
    weights : (K,) array, optional
        Kernel weights; scaled so that they sum to one. Uniform by default.
    sigma_p : float
        Bandwidth of the position [m].
    sigma_q : float
        Bandwidth of the rotation [rad].
    axial : bool
        Whether only the z axis is compared.
    single : bool
        Whether log-densities are evaluated in single precision: twice as fast, with errors of some
        1e-3 for objects of a metre.

    Raises
    ------
    InputError
        If there is no kernel, or the weights are negative, not finite or all zero.

    Examples
    --------
    >>> density = PoseDensity(Pose(np.zeros((1, 3)), np.eye(4)[:1]), sigma_p=0.02, sigma_q=0.26)
    >>> density.sample(2, np.random.default_rng(0)).p.shape
    (2, 3)
    """

    def __init__(
        self,
        kernels_at: Pose,
        weights: ArrayLike | None = None,
        *,
        sigma_p: float,
        sigma_q: float,
        axial: bool = False,
        single: bool = False,
    ):
        self.kernels_at = Pose(np.asarray(kernels_at.p, float), np.asarray(kernels_at.q, float))
        self.weights = checked_weights(weights, len(self.kernels_at.p), "a pose density")
        self.sigma_p, self.sigma_q, self.axial = sigma_p, sigma_q, axial
        # Positions are relative to their mean, so that the lifted squares lose no digits.
        self._origin = self.kernels_at.p.mean(axis=0)
        position = lifted_gaussian(self.kernels_at.p - self._origin, sigma_p)
        log_norm = kernels.gaussian_log_norm(3, sigma_p)
        if axial:
            kappa = kernels.axis_concentration(sigma_q)
            log_norm += kernels.axis_log_norm(sigma_q)
            # The largest exponent, kappa, is moved into the constant.
            position[-1] -= kappa
            self._rotation = axis_of(self.kernels_at.q, 2)
            self._coefficients = np.vstack([position, kappa * self._rotation.T])
            self._log_norm = log_norm + kappa
        else:
            kappa = kernels.rotation_concentration(sigma_q)
            log_norm += kernels.theta_log_norm(sigma_q)
            position[-1] -= kappa
            self._rotation = np.concatenate([self.kernels_at.q, -self.kernels_at.q])
            self._coefficients = np.vstack(
                [np.hstack([position, position]), kappa * self._rotation.T]
            )
            self._log_norm = log_norm + kappa
        self._kappa = kappa
        self._single = self._coefficients.astype(np.float32) if single else None

    def __len__(self) -> int:
        return len(self.weights)

    def log_density(self, x: Pose) -> Array:
        """Return the log-density (...) at poses x: p (..., 3) [m], q (..., 4)."""
        return self.log_densities(x, self.weights[:, None])[..., 0]

    def log_densities(self, x: Pose, weights: Array) -> Array:
        """Return log-densities (..., M) at poses x for M weightings (K, M) of the kernels.

        Each column of `weights` is used as it is; if it sums to one, the density is normalised.
        """
        weights = weights if self.axial else np.vstack([weights, weights])
        coefficients: np.ndarray = self._coefficients if self._single is None else self._single
        sums = log_weighted_sums(self._lifted(x), coefficients, weights) + self._log_norm
        return sums.reshape(*np.shape(x.p)[:-1], weights.shape[1])

    def log_density_and_gradient(self, x: Pose) -> tuple[Array, Array, Array]:
        """Return the log-density and its gradients at poses x.

        Returns
        -------
        log_density : (...) array
        position_gradient : (..., 3) array
            With respect to p, in A [1/m].
        rotation_gradient : (..., 3) array
            With respect to the rotation vector w, in A [1/rad], of the perturbed rotation exp(w) q.
        """
        shape = np.shape(x.p)[:-1]
        p, q = np.reshape(x.p, (-1, 3)), np.reshape(x.q, (-1, 4))
        weights = self.weights if self.axial else np.concatenate([self.weights, self.weights])
        centres = (
            self.kernels_at.p if self.axial else np.vstack([self.kernels_at.p, self.kernels_at.p])
        )
        value, mean_p = np.empty(len(p)), np.empty((len(p), 3))
        mean_r = np.empty((len(p), self._rotation.shape[1]))
        for rows, e in exponent_blocks(self._lifted(x), self._coefficients):
            with np.errstate(divide="ignore"):
                e += np.log(weights)
            top = exponentiate(e)
            total = e.sum(axis=1, keepdims=True)
            value[rows] = (np.log(total) + top)[:, 0] + self._log_norm
            mean_p[rows], mean_r[rows] = e @ centres / total, e @ self._rotation / total
        gradient_p = (mean_p - p) / self.sigma_p**2
        if self.axial:
            gradient_q = self._kappa * cross(axis_of(q, 2), mean_r)
        else:
            gradient_q = 0.5 * self._kappa * quat_multiply(mean_r, quat_conjugate(q))[:, 1:]
        return value.reshape(shape), gradient_p.reshape(*shape, 3), gradient_q.reshape(*shape, 3)

    def sample(self, n: int, rng: np.random.Generator) -> Pose:
        """Draw n poses: p (n, 3) [m], q (n, 4). With `axial`, the turn about z is uniform."""
        k = rng.choice(len(self), size=n, p=self.weights)
        p = self.kernels_at.p[k] + self.sigma_p * rng.standard_normal((n, 3))
        if not self.axial:
            return Pose(p, kernels.sample_theta(self.kernels_at.q[k], self.sigma_q, rng))
        z = kernels.sample_axis(axis_of(self.kernels_at.q[k], 2), self.sigma_q, rng)
        q = kernels.turned_to_axis(self.kernels_at.q[k], z)
        turn = quat_about_axis(
            np.broadcast_to([0.0, 0.0, 1.0], (n, 3)), rng.uniform(-np.pi, np.pi, n)
        )
        return Pose(p, quat_multiply(q, turn))

    def _lifted(self, x: Pose) -> Array:
        p, q = np.reshape(x.p, (-1, 3)), np.reshape(x.q, (-1, 4))
        return np.hstack([lift(p - self._origin), axis_of(q, 2) if self.axial else q])
