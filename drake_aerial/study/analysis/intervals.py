"""Confidence intervals: cluster bootstrap and Wilson.

Flights of one contact solution are not independent: they share the contact, which decides most of
their error. Fifty flights of five solutions are closer to five observations than to fifty. The
bootstrap therefore draws solutions first and then, within each drawn solution, its flights (a
two-stage bootstrap; Davison and Hinkley, 1997, section 3.8).
"""

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

LEVEL = 0.95
RESAMPLES = 4000
SEED = 20221
"""Seed of the bootstrap."""


@dataclass(frozen=True)
class Interval:
    """A value with its interval; `low` and `high` are None if there is too little data."""

    value: float | None
    low: float | None
    high: float | None

    def to_list(self) -> list[float | None]:
        """Return [value, low, high], for JSON."""
        return [self.value, self.low, self.high]


def named_generator(*names: str) -> np.random.Generator:
    """Return the random generator of a named statistic, independent of the others."""
    return np.random.default_rng([SEED, zlib.crc32("/".join(names).encode())])


def cluster_weights(
    sizes: Sequence[int], rng: np.random.Generator, resamples: int = RESAMPLES
) -> Array:
    """Return the weights of N values in each resample, (resamples, N); rows sum to one.

    The number of times each cluster is drawn is multinomial; given these, so are the numbers of its
    members. Both are drawn directly. The values are ordered by cluster.

    Parameters
    ----------
    sizes : sequence of int
        Number of members (flights) of each cluster (solution).
    rng : numpy.random.Generator
    resamples : int
        Number of resamples.

    Raises
    ------
    InputError
        If there is no cluster, or one is empty.
    """
    if not len(sizes) or min(sizes) < 1:
        raise InputError(
            f"`sizes` must be one or more numbers of at least 1, got {list(sizes)}; "
            "leave empty clusters out"
        )
    drawn = rng.multinomial(len(sizes), np.full(len(sizes), 1.0 / len(sizes)), size=resamples)
    counts = [
        rng.multinomial(drawn[:, k] * size, np.full(size, 1.0 / size))
        for k, size in enumerate(sizes)
    ]
    weights = np.concatenate(counts, axis=1).astype(float)
    return weights / weights.sum(axis=1, keepdims=True)


def cluster_bootstrap(
    clusters: Sequence[ArrayLike],
    rng: np.random.Generator,
    *,
    of_means: Callable[[Array], Array] | None = None,
    resamples: int = RESAMPLES,
    level: float = LEVEL,
) -> Interval:
    """Return the mean of clustered values, or a function of means, with its bootstrap interval.

    Parameters
    ----------
    clusters : sequence of (m_k,) or (m_k, C) arrays
        The values of one cluster each, for instance the flights of one solution; empty clusters are
        left out.
    rng : numpy.random.Generator
    of_means : callable, optional
        Takes means (B, C) of the C columns and returns (B,); the first column's mean by default.
    resamples : int
        Number of resamples.
    level : float
        Nominal coverage.

    Returns
    -------
    Interval
        Without limits for a single value, or if the statistic is not finite.
    """
    arrays = [np.asarray(cluster, float) for cluster in clusters if len(np.asarray(cluster))]
    if not arrays:
        return Interval(None, None, None)
    values = np.concatenate([array.reshape(len(array), -1) for array in arrays])
    statistic = of_means or (lambda means: means[:, 0])
    value = float(statistic(values.mean(axis=0, keepdims=True))[0])
    if len(values) < 2 or not np.isfinite(value):
        return Interval(value if np.isfinite(value) else None, None, None)
    samples = statistic(cluster_weights([len(array) for array in arrays], rng, resamples) @ values)
    low, high = percentile_limits(samples, len(arrays) if len(arrays) > 1 else len(values), level)
    return Interval(value, low, high)


def percentile_limits(
    samples: Array, count: int, level: float = LEVEL
) -> tuple[float | None, float | None]:
    """Return the limits of the expanded percentile interval; None where not finite.

    Parameters
    ----------
    samples : (B,) array
        Bootstrap samples.
    count : int
        Number of independent observations.
    level : float
        Nominal coverage.
    """
    from scipy.special import ndtr, stdtrit

    tail = float(ndtr(np.sqrt(count / (count - 1.0)) * stdtrit(count - 1, 0.5 * (1.0 - level))))
    low, high = np.quantile(samples, [tail, 1.0 - tail])
    return _finite(low), _finite(high)


def wilson(failures: int, attempts: int, level: float = LEVEL) -> Interval:
    """Return a rate with Wilson's score interval (Wilson, 1927).

    Raises
    ------
    InputError
        If `failures` is not in 0 to `attempts`.
    """
    from scipy.stats import binomtest

    if not 0 <= failures <= attempts:
        raise InputError(f"`failures` must be in 0 to {attempts}, got {failures}")
    if attempts == 0:
        return Interval(None, None, None)
    limits = binomtest(failures, attempts).proportion_ci(level, method="wilson")
    return Interval(failures / attempts, float(limits.low), float(limits.high))


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
