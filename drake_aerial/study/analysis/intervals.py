"""Intervals that say how much a figure may be trusted: cluster bootstrap and Wilson.

Flights of one contact solution are not independent: they share the contact, which is what decides how well they go. Fifty
flights of five solutions are therefore nearer to five observations than to fifty. The bootstrap here draws solutions first and
then, within each drawn solution, its flights (a two-stage bootstrap; Davison and Hinkley, 1997, section 3.8).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

LEVEL = 0.95
RESAMPLES = 4000


@dataclass(frozen=True)
class Interval:
    """A figure with its interval; `low` and `high` are None where nothing could be resampled."""

    value: float | None
    low: float | None
    high: float | None

    def to_list(self) -> list[float | None]:
        """Return [value, low, high], for JSON."""
        return [self.value, self.low, self.high]


def cluster_weights(
    sizes: Sequence[int], rng: np.random.Generator, resamples: int = RESAMPLES
) -> Array:
    """Return how much each value counts in each resample: (resamples, N), rows sum to one, clusters one after the other.

    Drawing as many clusters as there are, and from each drawn one as many members as it has, leaves multinomial counts of
    clusters and, given those, multinomial counts of members; these are drawn directly.

    Parameters
    ----------
    sizes : sequence of int
        How many members each cluster (solution) has.
    rng : numpy.random.Generator
        What draws.
    resamples : int
        How many.

    Raises
    ------
    InputError
        If there is no cluster, or one is empty.
    """
    if not len(sizes) or min(sizes) < 1:
        raise InputError(
            f"clusters of sizes {list(sizes)} given; at least one, each of at least one member, is accepted"
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
    """Return a mean of clustered values, or a function of means, with its percentile bootstrap interval.

    Parameters
    ----------
    clusters : sequence of (m_k,) or (m_k, C) arrays
        The values of one cluster each, for instance the flights of one solution; empty ones are left out.
    rng : numpy.random.Generator
        What draws.
    of_means : callable, optional
        Takes means (B, C) of the C columns and returns (B,); the first column's mean by default.
    resamples : int
        How many.
    level : float
        Coverage aimed at.

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
    """Return the limits of an expanded percentile interval from bootstrap samples (B,) of `count` independent things; None where not finite."""
    from scipy.special import ndtr, stdtrit

    tail = float(ndtr(np.sqrt(count / (count - 1.0)) * stdtrit(count - 1, 0.5 * (1.0 - level))))
    low, high = np.quantile(samples, [tail, 1.0 - tail])
    return _finite(low), _finite(high)


def wilson(failures: int, attempts: int, level: float = LEVEL) -> Interval:
    """Return a rate with Wilson's score interval (Wilson, 1927), which stays within 0 and 1 and does not shrink to nothing at 0 of n.

    Raises
    ------
    InputError
        If there are more failures than attempts, or less than none.
    """
    from scipy.special import ndtri

    if not 0 <= failures <= attempts:
        raise InputError(
            f"{failures} failures of {attempts} attempts given; from 0 to all is accepted"
        )
    if attempts == 0:
        return Interval(None, None, None)
    z = float(ndtri(0.5 * (1.0 + level)))
    rate = failures / attempts
    middle = (rate + z * z / (2 * attempts)) / (1 + z * z / attempts)
    half = (
        z
        / (1 + z * z / attempts)
        * np.sqrt(rate * (1 - rate) / attempts + z * z / (4 * attempts**2))
    )
    return Interval(rate, max(0.0, float(middle - half)), min(1.0, float(middle + half)))


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
