"""Kernels: Gaussians, and von Mises-Fisher kernels on rotations and on directions.

Every log-density is normalised. Bandwidths of rotations are angles: for small ones, the standard
deviation of each component of the rotation vector [rad]. The concentration follows from it.
Sources: the paper's section "Kernel density estimator"; docs/method.md.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ive

from drake_aerial.geometry import (
    Array,
    axis_of,
    cross,
    perpendicular,
    quat_from_two_vectors,
    quat_multiply,
)

LOG_2PI = float(np.log(2.0 * np.pi))


def gaussian_log_norm(dimension: int, sigma: float) -> float:
    """Return the log-density at the centre of an isotropic Gaussian of deviation `sigma`."""
    return -dimension * (0.5 * LOG_2PI + float(np.log(sigma)))


def log_gaussian(x: ArrayLike, mu: ArrayLike, sigma: float) -> Array:
    """Return the log-density N_k(x | mu, sigma) of isotropic Gaussians, shape (...).

    Parameters
    ----------
    x, mu : (..., k) arrays
        Points and centres, in the unit of `sigma`; they broadcast.
    sigma : float
        Standard deviation of each component. It must be positive.
    """
    x, mu = np.asarray(x, float), np.asarray(mu, float)
    square = np.sum((x - mu) ** 2, axis=-1)
    return gaussian_log_norm(x.shape[-1], sigma) - 0.5 * square / sigma**2


def rotation_concentration(sigma: float) -> float:
    """Return kappa = 4 / sigma^2 of Theta's exponent kappa cos(angle / 2); sigma in rad."""
    return 4.0 / sigma**2


def axis_concentration(sigma: float) -> float:
    """Return kappa = 1 / sigma^2 of the axial kernel's exponent kappa cos(angle); sigma in rad."""
    return 1.0 / sigma**2


def theta_log_norm(sigma: float) -> float:
    """Return log c of Theta = c (e^(kappa d) + e^(-kappa d)), d the quaternions' dot product."""
    kappa = rotation_concentration(sigma)
    log_bessel = float(np.log(ive(1, kappa))) + kappa
    return float(np.log(kappa)) - 2.0 * LOG_2PI - log_bessel - float(np.log(2.0))


def log_theta(q: ArrayLike, mu: ArrayLike, sigma: float) -> Array:
    """Return the log-density Theta(q | mu, sigma) of rotations, shape (...).

    Theta is the mean of two von Mises-Fisher densities on the unit sphere S^3, centred on mu and on
    -mu. The quaternions q and -q, which are the same rotation, therefore have the same density.
    Theta integrates to one over S^3 (area 2 pi^2).

    Parameters
    ----------
    q, mu : (..., 4) arrays
        Unit quaternions w, x, y, z; they broadcast.
    sigma : float
        Bandwidth [rad].
    """
    d = rotation_concentration(sigma) * np.sum(
        np.asarray(q, float) * np.asarray(mu, float), axis=-1
    )
    return theta_log_norm(sigma) + np.abs(d) + np.log1p(np.exp(-2.0 * np.abs(d)))


def axis_log_norm(sigma: float) -> float:
    """Return log c of the axial kernel c e^(kappa d), d the unit axes' dot product."""
    kappa = axis_concentration(sigma)
    # log(kappa / (4 pi sinh kappa)) without overflow.
    return float(np.log(kappa) - LOG_2PI - kappa - np.log1p(-np.exp(-2.0 * kappa)))


def log_axis(z: ArrayLike, mu: ArrayLike, sigma: float) -> Array:
    """Return the von Mises-Fisher log-density of unit axes z about mu, shape (...).

    It integrates to one over S^2.

    Parameters
    ----------
    z, mu : (..., 3) arrays
        Unit vectors; they broadcast.
    sigma : float
        Bandwidth [rad]: the standard deviation of each component of the tilt.
    """
    d = np.sum(np.asarray(z, float) * np.asarray(mu, float), axis=-1)
    return axis_log_norm(sigma) + axis_concentration(sigma) * d


def sample_theta(mu: ArrayLike, sigma: float, rng: np.random.Generator) -> Array:
    """Draw unit quaternions (N, 4) from Theta about `mu` (N, 4), of bandwidth `sigma` [rad]."""
    mu = np.asarray(mu, float)
    n, kappa = len(mu), rotation_concentration(sigma)
    # Wood's rejection sampler (1994) of the cosine to the centre, for the sphere S^3.
    b = 3.0 / (2.0 * kappa + np.sqrt(4.0 * kappa**2 + 9.0))
    x0 = (1.0 - b) / (1.0 + b)
    c = kappa * x0 + 3.0 * np.log(1.0 - x0**2)
    cosine, todo = np.empty(n), np.arange(n)
    while len(todo):
        z, u = rng.beta(1.5, 1.5, len(todo)), rng.random(len(todo))
        t = (1.0 - (1.0 + b) * z) / (1.0 - (1.0 - b) * z)
        accepted = kappa * t + 3.0 * np.log(1.0 - x0 * t) - c >= np.log(u)
        cosine[todo[accepted]] = t[accepted]
        todo = todo[~accepted]
    tangent = rng.standard_normal((n, 4))
    tangent -= np.sum(tangent * mu, axis=-1, keepdims=True) * mu
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    q = cosine[:, None] * mu + np.sqrt(1.0 - cosine[:, None] ** 2) * tangent
    return q * np.where(rng.random((n, 1)) < 0.5, 1.0, -1.0)


def sample_axis(mu: ArrayLike, sigma: float, rng: np.random.Generator) -> Array:
    """Draw unit axes (N, 3) from the axial kernel about `mu` (N, 3), of bandwidth `sigma` [rad]."""
    mu = np.asarray(mu, float)
    n, kappa = len(mu), axis_concentration(sigma)
    u = rng.random(n)
    # Inverse of the cosine's distribution function on S^2.
    cosine = 1.0 + np.log(u + (1.0 - u) * np.exp(-2.0 * kappa)) / kappa
    x = perpendicular(mu)
    angle = rng.uniform(0.0, 2.0 * np.pi, n)[:, None]
    tangent = np.cos(angle) * x + np.sin(angle) * cross(mu, x)
    return cosine[:, None] * mu + np.sqrt(np.maximum(1.0 - cosine[:, None] ** 2, 0.0)) * tangent


def turned_to_axis(q: ArrayLike, z: ArrayLike) -> Array:
    """Rotate frames q (N, 4) by the smallest rotations that move their z axes to `z` (N, 3)."""
    return quat_multiply(quat_from_two_vectors(axis_of(q, 2), z), q)
