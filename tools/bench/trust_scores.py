"""Scores of probabilities: Brier, calibration, and how well they tell right from wrong."""

from __future__ import annotations

import numpy as np


def brier(probability: np.ndarray, right: np.ndarray, weight: np.ndarray) -> float:
    """Return the weighted mean squared difference of probability and outcome."""
    return float(np.average((probability - right) ** 2, weights=weight))


def calibration_error(
    probability: np.ndarray, right: np.ndarray, weight: np.ndarray, bins: int = 10
) -> float:
    """Return the expected calibration error over equal bins of the probability."""
    bin_of = np.minimum((probability * bins).astype(int), bins - 1)
    error = 0.0
    for k in range(bins):
        own = bin_of == k
        if weight[own].sum() > 0.0:
            gap = np.average(probability[own], weights=weight[own]) - np.average(
                right[own], weights=weight[own]
            )
            error += weight[own].sum() * abs(gap)
    return float(error / weight.sum())


def auc(good: np.ndarray, bad: np.ndarray) -> float:
    """Return the probability that a good answer scores higher than a bad one; ties count half."""
    from scipy.stats import rankdata

    if not len(good) or not len(bad):
        return float("nan")
    ranks = rankdata(np.concatenate([good, bad]))[: len(good)]
    return float((ranks.sum() - 0.5 * len(good) * (len(good) + 1)) / (len(good) * len(bad)))


def balanced(right: np.ndarray) -> np.ndarray:
    """Return weights that give right and wrong answers the same total."""
    right = np.asarray(right, bool)
    return np.where(right, 0.5 / max(right.sum(), 1), 0.5 / max((~right).sum(), 1))


def isotonic(x: np.ndarray, right: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the steps of the monotone fit of outcomes on x: middles and values.

    Pools adjacent violators (Ayer et al., 1955).
    """
    order = np.argsort(x, kind="stable")
    blocks: list[list[float]] = []
    for xi, ri, wi in zip(x[order], right[order], weight[order], strict=True):
        blocks.append([wi * xi, wi * ri, wi])
        while len(blocks) > 1 and blocks[-2][1] / blocks[-2][2] >= blocks[-1][1] / blocks[-1][2]:
            last = blocks.pop()
            blocks[-1] = [a + b for a, b in zip(blocks[-1], last, strict=True)]
    sums = np.array(blocks)
    return sums[:, 0] / sums[:, 2], sums[:, 1] / sums[:, 2]
