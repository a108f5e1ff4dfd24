"""Log-sums of many kernels at many points, by matrix products.

Gaussian and von Mises-Fisher kernels have exponents that are linear in lifted coordinates
(x, |x|^2, 1, ...). The exponents of all kernels at all points are therefore one matrix product.
Points are processed in blocks, which bounds memory and uses all cores. The result does not depend
on the number of cores.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.parallel import for_each, one_blas_thread

BLOCK_BYTES = 560_000
"""Memory of a block's exponents, measured: small enough for the cache, and an even number of
blocks for annealing's 100 points and 5,000 kernels on two cores."""
# Rows of a block are a multiple of this. Matrix products round left-over rows in another way.
_GROUP = 4
# Lower bound of exponents relative to the largest one: no sum shows the difference, and exp is slow
# where it underflows.
_MIN_EXPONENT = {np.dtype(np.float64): -600.0, np.dtype(np.float32): -80.0}


def checked_weights(weights: ArrayLike | None, count: int, what: str) -> Array:
    """Return kernel weights (count,) that sum to one; uniform ones for None.

    Raises
    ------
    InputError
        If there are no kernels, the shape is wrong, or the weights are negative, not finite or all
        zero.
    """
    if count == 0:
        raise InputError(f"{what} must have at least one kernel, got none")
    w = np.full(count, 1.0) if weights is None else np.asarray(weights, float)
    if w.shape != (count,):
        raise InputError(f"{what}: `weights` must be of shape ({count},), got {w.shape}")
    if not np.all(np.isfinite(w)) or np.any(w < 0.0) or not np.any(w > 0.0):
        raise InputError(
            f"{what}: `weights` must be finite, not negative and not all zero, "
            f"got {w.min()} to {w.max()}"
        )
    return w / w.sum()


def lifted_gaussian(mu: Array, sigma: float) -> Array:
    """Return the (k + 2, K) coefficients of -|x - mu|^2 / (2 sigma^2) on [x, |x|^2, 1]."""
    scale = 1.0 / sigma**2
    square = np.sum(mu * mu, axis=-1)
    return np.vstack([mu.T * scale, np.full(len(mu), -0.5 * scale), -0.5 * scale * square])


def lift(x: Array) -> Array:
    """Return the lifted points [x, |x|^2, 1], shape (N, k + 2), of x (N, k)."""
    return np.column_stack([x, np.sum(x * x, axis=-1), np.ones(len(x))])


def row_blocks(points: int, kernels: int, itemsize: int = 8) -> list[slice]:
    """Return slices of the points whose exponents under all kernels fit into a block."""
    rows = max(_GROUP, BLOCK_BYTES // (itemsize * kernels) // _GROUP * _GROUP)
    return [slice(start, min(start + rows, points)) for start in range(0, points, rows)]


def exponent_blocks(
    points: np.ndarray, coefficients: np.ndarray
) -> Iterator[tuple[slice, np.ndarray]]:
    """Yield slices of lifted points (N, D) and exponents (block, K) by coefficients (D, K)."""
    for rows in row_blocks(len(points), coefficients.shape[1], coefficients.itemsize):
        yield rows, points[rows] @ coefficients


def exponentiate(e: np.ndarray) -> np.ndarray:
    """Replace exponents e (N, K) by exp(e - top) in place; return their row maxima top (N, 1)."""
    top = e.max(axis=1, keepdims=True)
    e -= top
    # The maximum with an array is more than twice as fast as with a number.
    np.maximum(e, np.full(e.shape[1], _MIN_EXPONENT[e.dtype], dtype=e.dtype), out=e)
    np.exp(e, out=e)
    return top


def log_weighted_sums(points: np.ndarray, coefficients: np.ndarray, weights: np.ndarray) -> Array:
    """Return log sum_k w_k exp(exponent_nk), shape (N, M), for weights (K, M).

    It is -inf where a sum vanishes. The type of the coefficients decides the precision.
    """
    points, weights = points.astype(coefficients.dtype), weights.astype(coefficients.dtype)
    out = np.empty((len(points), weights.shape[1]))

    def from_top(at: np.ndarray) -> Array:
        e = at @ coefficients
        top = exponentiate(e)
        with np.errstate(divide="ignore"):
            return np.log(e @ weights) + top

    def fill(rows: slice) -> None:
        if coefficients.dtype != np.float64:
            out[rows] = from_top(points[rows])
            return
        # In double precision most points need no shift of their exponents by the largest one.
        e = points[rows] @ coefficients
        np.maximum(e, np.full(e.shape[1], _MIN_EXPONENT[e.dtype]), out=e)
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            sums = np.exp(e, out=e) @ weights
            logs = np.log(sums)
        beyond = np.flatnonzero(~((sums > 1e-200) & (sums < 1e200)).all(axis=1))
        if len(beyond):
            logs[beyond] = from_top(points[rows][beyond])
        out[rows] = logs

    blocks = row_blocks(len(points), coefficients.shape[1], coefficients.itemsize)
    if len(blocks) == 1:
        fill(blocks[0])
    else:
        one_blas_thread(for_each)(fill, blocks)
    return out


def systematic_resample(weight: Array, count: int, rng: np.random.Generator) -> np.ndarray:
    """Draw `count` indices with probability proportional to `weight` (N,), sorted, with repeats.

    Systematic draws are spread evenly over the canonical order of features, so that no side of an
    object is left out by chance.
    """
    total = np.cumsum(weight + 1e-12)
    at = (np.arange(count) + rng.random(count)) / count * total[-1]
    return np.minimum(np.searchsorted(total, at), len(weight) - 1)
