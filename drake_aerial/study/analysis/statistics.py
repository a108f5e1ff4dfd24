"""Statistics of one group of flights, and the definitions of all numbers of a report.

A failed flight is never left out; `FORMULAS` says how it enters each number.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from drake_aerial.geometry import Array
from drake_aerial.study.analysis.groups import (
    Group,
    by_solution,
    failed,
    flown,
    moved_of,
    offset_of,
    ranked_value,
    values_of,
)
from drake_aerial.study.analysis.intervals import (
    LEVEL,
    RESAMPLES,
    cluster_bootstrap,
    cluster_weights,
    named_generator,
    wilson,
)
from drake_aerial.study.analysis.quantities import FAILURES, QUANTITIES
from drake_aerial.study.records import Record

FORMULAS = {
    "mean, std, median": "over the completed flights of a group; std is the sample standard "
    "deviation (divisor n - 1)",
    "interval": f"{100 * LEVEL:.0f} % expanded percentile interval of the mean from a two-stage "
    f"bootstrap ({RESAMPLES} resamples): solutions are drawn with replacement, then flights within "
    "each drawn solution, because flights of one solution share its contact",
    "median_all": "median over all flights, in which a failed flight ranks after every completed "
    "one; null if the median is a failed flight",
    "failure_rate": "failed flights (dropped, crashed, diverged) over all flights, with Wilson's "
    "interval; the interval assumes independent flights, but flights of one solution are not: "
    "solutions_failed counts the solutions with at least one failed flight",
    "not_flown": "infeasible solutions; they have no flight and are not part of any mean; the next "
    "best solution was flown instead",
    "pairs": "flight t of solution k of one method with flight t of solution k of the other: same "
    "scan, same noise. Solutions are paired by rank, which makes the pairs comparable, not the "
    "contacts. If one method has a single solution, it is paired with every solution of the other; "
    "other ranks without a partner are left out and counted as unpaired",
    "difference": "mean of (first - second) over the pairs in which both flights completed, with "
    "the same interval over ranks",
    "ratio": "mean of the first over mean of the second, same pairs, same interval",
    "wins": "share of all pairs in which the first has the smaller value: a failed flight loses "
    "against a completed one; two failed flights, and equal values, count one half; same interval "
    "over ranks",
    "spread": "standard deviation over completed flights at each time from the start of the circle "
    "to the end of the hover, then root mean square over time",
}


def summarize(group: Group, records: Sequence[Record]) -> dict[str, Any]:
    """Return the statistics of one group; `FORMULAS` explains the keys."""
    flights = flown(records)
    solutions = by_solution(flights)
    offsets = [offset for m in solutions.values() if (offset := offset_of(m)) is not None]
    moved = [distance for members in solutions.values() for distance in moved_of(members[0])]
    count = {
        outcome: sum(record["outcome"] == outcome for record in records)
        for outcome in ("completed", *FAILURES, "not_flown")
    }
    return {
        "condition": group.condition,
        "method": group.method,
        "belief": group.belief,
        "inertia": group.inertia,
        "solutions": len(solutions),
        "flights": len(flights),
        **count,
        "failure_rate": wilson(sum(map(failed, flights)), len(flights)).to_list(),
        "solutions_failed": sum(any(map(failed, members)) for members in solutions.values()),
        "contact_off_com_m": {
            "mean": float(np.mean(offsets)) if offsets else None,
            "min": min(offsets, default=None),
            "max": max(offsets, default=None),
        },
        "grippers_moved": len(moved),
        "moved_max_m": max(moved, default=None),
        "quantities": {
            quantity.key: _quantity(group, list(solutions.values()), quantity.key)
            for quantity in QUANTITIES
        },
    }


def _quantity(group: Group, solutions: Sequence[Sequence[Record]], key: str) -> dict[str, Any]:
    clusters = [values_of(members, key) for members in solutions]
    values = np.concatenate(clusters) if clusters else np.zeros(0)
    ranked = [
        value
        for members in solutions
        for record in members
        if (value := ranked_value(record, key)) is not None
    ]
    # Of an even number, the mean of the two middle values: infinite if either is a failed flight.
    middle = float(np.median(ranked)) if ranked else None
    interval = cluster_bootstrap(clusters, named_generator("mean", str(group), key))
    return {
        "n": len(values),
        "mean": float(values.mean()) if len(values) else None,
        "std": float(values.std(ddof=1)) if len(values) > 1 else None,
        "median": float(np.median(values)) if len(values) else None,
        "median_all": middle if middle is not None and np.isfinite(middle) else None,
        "interval": interval.to_list()[1:],
    }


def spread(
    clusters: Sequence[Array], rng: np.random.Generator, resamples: int = RESAMPLES
) -> tuple[float | None, Array]:
    """Return the spread of flights about their mean, and its bootstrap samples (resamples,).

    Parameters
    ----------
    clusters : sequence of (m_k, T) arrays
        The flights of one solution each, at the same times.
    rng : numpy.random.Generator
    resamples : int
        Number of bootstrap samples.
    """
    size = sum(len(cluster) for cluster in clusters)
    if size < 2:
        return None, np.zeros(0)
    rows = np.concatenate([np.asarray(cluster, float) for cluster in clusters])
    # Variance of all resamples at once, from the weights of the flights.
    weights = cluster_weights([len(cluster) for cluster in clusters], rng, resamples)
    centered = rows - rows.mean(axis=0)
    variance = (weights @ centered**2 - (weights @ centered) ** 2).clip(min=0.0) * (
        size / (size - 1)
    )
    return float(np.sqrt(np.mean(rows.var(axis=0, ddof=1)))), np.sqrt(variance.mean(axis=1))
