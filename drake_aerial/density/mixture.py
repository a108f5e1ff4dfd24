"""Log-sums of many kernels at many points, by matrix products.

Gaussian and von Mises-Fisher kernels have exponents that are linear in lifted coordinates (x, |x|^2, 1,
...), so that the exponents of all kernels at all points are one matrix product. Points are taken in blocks,
which bounds memory.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

BLOCK = 200_000
"""Exponents that are held at a time (1.6 MB: they should stay in the cache)."""


def checked_weights(weights: ArrayLike | None, count: int, what: str) -> Array:
    """Return kernel weights (count,) that sum to one; uniform ones for None.

    Raises
    ------
    InputError
        If there are no kernels, the shape is wrong, or the weights are negative, not finite or all zero.
    """
    if count == 0:
        raise InputError(f"{what} has no kernels; at least one is needed")
    w = np.full(count, 1.0) if weights is None else np.asarray(weights, float)
    if w.shape != (count,):
        raise InputError(f"{what}: weights should be of shape ({count},) but got {w.shape}")
    if not np.all(np.isfinite(w)) or np.any(w < 0.0) or not np.any(w > 0.0):
        raise InputError(f"{what}: weights should be finite, not negative and not all zero")
    return w / w.sum()


def lifted_gaussian(mu: Array, sigma: float) -> Array:
    """Return the (k + 2, K) coefficients of -|x - mu|^2 / (2 sigma^2) on the lifted [x, |x|^2, 1]."""
    scale = 1.0 / sigma**2
    square = np.sum(mu * mu, axis=-1)
    return np.vstack([mu.T * scale, np.full(len(mu), -0.5 * scale), -0.5 * scale * square])


def lift(x: Array) -> Array:
    """Return the lifted points [x, |x|^2, 1], shape (N, k + 2), of x (N, k)."""
    return np.column_stack([x, np.sum(x * x, axis=-1), np.ones(len(x))])


def exponent_blocks(points: np.ndarray, coefficients: np.ndarray) -> Iterator[tuple[slice, np.ndarray]]:
    """Yield slices of the lifted points (N, D) and their exponents (block, K) under coefficients (D, K)."""
    step = max(1, BLOCK // coefficients.shape[1])
    for start in range(0, len(points), step):
        rows = slice(start, min(start + step, len(points)))
        yield rows, points[rows] @ coefficients


def exponentiate(e: np.ndarray) -> np.ndarray:
    """Replace exponents e (N, K) by exp(e - top), in place, and return their row maxima top (N, 1)."""
    top = e.max(axis=1, keepdims=True)
    e -= top
    # Far below any sum's last digit; exp is many times slower where it underflows.
    np.maximum(e, -600.0 if e.dtype == np.float64 else -80.0, out=e)
    np.exp(e, out=e)
    return top


def log_weighted_sums(points: np.ndarray, coefficients: np.ndarray, weights: np.ndarray) -> Array:
    """Return log sum_k w_k exp(exponent_nk), shape (N, M), for weights (K, M); -inf where a sum vanishes.

    The coefficients' type decides the precision.
    """
    points, weights = points.astype(coefficients.dtype), weights.astype(coefficients.dtype)
    out = np.empty((len(points), weights.shape[1]))
    for rows, e in exponent_blocks(points, coefficients):
        top = exponentiate(e)
        with np.errstate(divide="ignore"):
            out[rows] = np.log(e @ weights) + top
    return out
