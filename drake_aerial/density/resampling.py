"""Systematic resampling by weights."""

from __future__ import annotations

import numpy as np

from drake_aerial.geometry import Array


def systematic_resample(weight: Array, count: int, rng: np.random.Generator) -> np.ndarray:
    """Draw `count` indices with probability proportional to `weight` (N,), sorted, with repeats.

    Systematic draws are spread evenly over the canonical order of features, so that no side of an
    object is left out by chance.
    """
    total = np.cumsum(weight + 1e-12)
    at = (np.arange(count) + rng.random(count)) / count * total[-1]
    return np.minimum(np.searchsorted(total, at), len(weight) - 1)
