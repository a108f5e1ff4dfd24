"""Systematic resampling by weights."""

from __future__ import annotations

import numpy as np

from drake_aerial.geometry import Array


def systematic_resample(weight: Array, count: int, rng: np.random.Generator) -> np.ndarray:
    """Draw `count` indices, sorted and with repeats, with probability proportional to `weight` (N,).

    Systematic draws spread evenly along the features' canonical order, so that no side is left out by chance.
    """
    total = np.cumsum(weight + 1e-12)
    at = (np.arange(count) + rng.random(count)) / count * total[-1]
    return np.minimum(np.searchsorted(total, at), len(weight) - 1)
