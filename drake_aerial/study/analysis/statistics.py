"""Figures of a study from its records: per group of flights, and of one method against another.

A group is one condition, method, belief and inertia. A flight that failed is a failure, never left out; how it enters is part of
each figure's definition in `FORMULAS`.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_aerial.geometry import Array
from drake_aerial.study.analysis.intervals import (
    LEVEL,
    RESAMPLES,
    cluster_bootstrap,
    cluster_weights,
    wilson,
)
from drake_aerial.study.analysis.quantities import (
    BELIEF_ORDER,
    FAILURES,
    INERTIA_ORDER,
    METHOD_ORDER,
    QUANTITIES,
    position,
)

Record = dict[str, Any]

SEED = 20221
"""Of the bootstrap; each figure draws from a stream of its own, named by what it is."""

FORMULAS = {
    "mean, std, median": "over completed flights of the group; std is the sample standard deviation (divisor n - 1)",
    "interval": f"{100 * LEVEL:.0f} % expanded percentile interval of the mean, two-stage bootstrap ({RESAMPLES} resamples): solutions are drawn "
    "with replacement, then flights within each drawn solution, since flights of one solution share its contact",
    "median_all": "median over all flights, a failed one counting as worse than every completed one; null where that median is a failure",
    "failure_rate": "failed (dropped, crashed, diverged) over flown, with Wilson's interval; it takes flights as independent, "
    "which flights of one solution are not: solutions_failed says how many solutions failed at least once",
    "not_flown": "solutions discarded because no gripper can be there; they have no flight and enter no mean; the next best was flown instead",
    "pairs": "flight t of solution k of one method with flight t of solution k of the other: same scan, same noise; solutions are paired by "
    "their rank, which makes the pairs, not the contacts, comparable. Where one method has one solution only, it is paired with "
    "every solution of the other; where it has fewer, ranks without a partner are left out and counted as unpaired",
    "difference": "mean over pairs with both flights completed of (first - second), interval as above over ranks",
    "ratio": "mean of the first over mean of the second, same pairs, same interval",
    "wins": "share of all pairs that the first wins by the smaller value: a failed flight loses against a completed one, two failed ones "
    "share the win, as do equal values; interval as above over ranks",
    "spread": "standard deviation over completed flights at each time from the circle's start to the end of the hover, then root mean square over time",
}


@dataclass(frozen=True, order=True)
class Group:
    """One condition, method, belief and inertia."""

    condition: str
    method: str
    belief: str
    inertia: str

    def __str__(self) -> str:
        return f"{self.condition}/{self.method}/{self.belief}/{self.inertia}"

    @classmethod
    def of(cls, record: Record) -> Group:
        """Return the group of a record."""
        return cls(record["condition"], record["method"], record["belief"], record["inertia"])

    def other(self, method: str) -> Group:
        """Return the same group of another method."""
        return Group(self.condition, method, self.belief, self.inertia)


def groups_of(
    records: Iterable[Record], conditions: Sequence[str] = ()
) -> dict[Group, list[Record]]:
    """Return the records by group, in an order that does not depend on theirs; a key that occurs twice counts once.

    Parameters
    ----------
    records : iterable of dict
        See `records.read_records`.
    conditions : sequence of str
        Their order; those not named follow by the alphabet.
    """
    unique = {record["key"]: record for record in records}
    order = tuple(conditions)
    groups: dict[Group, list[Record]] = {}
    for record in sorted(
        unique.values(), key=lambda r: (r["solution"] or 0, r["rank"] or 0, r["trial"], r["key"])
    ):
        groups.setdefault(Group.of(record), []).append(record)
    return dict(
        sorted(
            groups.items(),
            key=lambda item: (
                position(order, item[0].condition),
                position(BELIEF_ORDER, item[0].belief),
                position(INERTIA_ORDER, item[0].inertia),
                position(METHOD_ORDER, item[0].method),
            ),
        )
    )


def stream(*names: str) -> np.random.Generator:
    """Return the generator of a named figure: the same whatever else is computed."""
    return np.random.default_rng([SEED, zlib.crc32("/".join(names).encode())])


def flown(records: Iterable[Record]) -> list[Record]:
    """Return the records of flights, without solutions that were not flown."""
    return [record for record in records if record["outcome"] != "not_flown"]


def failed(record: Record) -> bool:
    """Return whether a flight ended in a failure."""
    return record["outcome"] in FAILURES


def by_solution(records: Iterable[Record]) -> dict[int, list[Record]]:
    """Return flights by the rank of their solution among those flown."""
    solutions: dict[int, list[Record]] = {}
    for record in records:
        solutions.setdefault(record["solution"], []).append(record)
    return dict(sorted(solutions.items()))


def value_of(record: Record, key: str) -> float | None:
    """Return a quantity of a completed flight; None for a failed one or where it was not measured."""
    if record["outcome"] != "completed":
        return None
    value = (record["metrics"] or {}).get(key)
    return None if value is None or not np.isfinite(value) else float(value)


def summarize(group: Group, records: Sequence[Record]) -> dict[str, Any]:
    """Return the figures of one group; every key is explained in `FORMULAS`.

    Parameters
    ----------
    group : Group
        Whose.
    records : sequence of dict
        Its records.
    """
    flights = flown(records)
    solutions = by_solution(flights)
    failures = sum(failed(record) for record in flights)
    offsets = [
        members[0]["contact"].get("off_com_m")
        for members in solutions.values()
        if members[0].get("contact")
    ]
    offsets = [offset for offset in offsets if offset is not None]
    moved = [
        moved
        for members in solutions.values()
        for moved in members[0].get("moved_m") or []
        if moved and moved > 1e-3
    ]
    return {
        "condition": group.condition,
        "method": group.method,
        "belief": group.belief,
        "inertia": group.inertia,
        "solutions": len(solutions),
        "flights": len(flights),
        "completed": sum(record["outcome"] == "completed" for record in flights),
        **{
            outcome: sum(record["outcome"] == outcome for record in flights) for outcome in FAILURES
        },
        "not_flown": sum(record["outcome"] == "not_flown" for record in records),
        "failure_rate": wilson(failures, len(flights)).to_list(),
        "solutions_failed": sum(
            any(failed(record) for record in members) for members in solutions.values()
        ),
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
    clusters = [
        [v for v in (value_of(record, key) for record in members) if v is not None]
        for members in solutions
    ]
    values = np.array([value for cluster in clusters for value in cluster])
    ranked = [
        v for members in solutions for record in members if (v := _ranked(record, key)) is not None
    ]
    # The lower of the two middle ones would flatter, so that the mean of both counts: infinite if either is a failure.
    middle = float(np.median(ranked)) if ranked else None
    return {
        "n": len(values),
        "mean": float(values.mean()) if len(values) else None,
        "std": float(values.std(ddof=1)) if len(values) > 1 else None,
        "median": float(np.median(values)) if len(values) else None,
        "median_all": middle if middle is not None and np.isfinite(middle) else None,
        "interval": cluster_bootstrap(clusters, stream("mean", str(group), key)).to_list()[1:],
    }


def _ranked(record: Record, key: str) -> float | None:
    return float("inf") if failed(record) else value_of(record, key)


def pair_flights(
    first: Sequence[Record], second: Sequence[Record]
) -> tuple[list[list[tuple[Record, Record]]], int]:
    """Return the pairs of two groups' flights, one list a solution rank, and how many flights have no partner.

    See "pairs" in `FORMULAS`.
    """
    a, b = by_solution(flown(first)), by_solution(flown(second))
    if len(a) == 1 and len(b) > 1:
        a = dict.fromkeys(b, next(iter(a.values())))
    elif len(b) == 1 and len(a) > 1:
        b = dict.fromkeys(a, next(iter(b.values())))
    pairs, used = [], set()
    for rank in sorted(a.keys() & b.keys()):
        partner = {(record["trial"], record["seed"]): record for record in b[rank]}
        matched = [
            (r, partner[r["trial"], r["seed"]])
            for r in a[rank]
            if (r["trial"], r["seed"]) in partner
        ]
        used |= {record["key"] for pair in matched for record in pair}
        if matched:
            pairs.append(matched)
    everyone = {record["key"] for record in [*flown(first), *flown(second)]}
    return pairs, len(everyone - used)


def compare(
    group: Group, other: Group, groups: dict[Group, list[Record]], key: str
) -> dict[str, Any]:
    """Return one quantity of one group against another's: difference, ratio and wins, with intervals (see `FORMULAS`)."""
    pairs, unpaired = pair_flights(groups.get(group, []), groups.get(other, []))
    both = [
        [
            (x, y)
            for x, y in ((value_of(a, key), value_of(b, key)) for a, b in rank)
            if x is not None and y is not None
        ]
        for rank in pairs
    ]
    both = [rank for rank in both if rank]
    ranked = [[(_ranked(a, key), _ranked(b, key)) for a, b in rank] for rank in pairs]
    scored = [[_win(x, y) for x, y in rank if x is not None and y is not None] for rank in ranked]
    scored = [rank for rank in scored if rank]
    name = ("compare", str(group), str(other), key)
    difference = cluster_bootstrap(
        [[x - y for x, y in rank] for rank in both], stream("difference", *name)
    )
    ratio = cluster_bootstrap(both, stream("ratio", *name), of_means=_ratio)
    return {
        "condition": group.condition,
        "belief": group.belief,
        "inertia": group.inertia,
        "first": group.method,
        "second": other.method,
        "quantity": key,
        "ranks": len(scored),
        "pairs": sum(map(len, scored)),
        "pairs_completed": sum(map(len, both)),
        "unpaired": unpaired,
        "difference": difference.to_list(),
        "ratio": ratio.to_list(),
        "wins": cluster_bootstrap(scored, stream("wins", *name)).to_list(),
    }


def _ratio(means: Array) -> Array:
    return np.divide(
        means[:, 0], means[:, 1], out=np.full(len(means), np.nan), where=means[:, 1] != 0.0
    )


def _win(first: float, second: float) -> float:
    return 0.5 if first == second else float(first < second)


def spread(
    clusters: Sequence[Array], rng: np.random.Generator, resamples: int = RESAMPLES
) -> tuple[float | None, Array]:
    """Return the spread of flights about their mean at each time, and its bootstrap samples (resamples,); see `FORMULAS`.

    Parameters
    ----------
    clusters : sequence of (m_k, T) arrays
        The flights of one solution each, on one time grid.
    rng : numpy.random.Generator
        What draws.
    resamples : int
        How many.
    """
    rows = (
        np.concatenate([np.asarray(cluster, float) for cluster in clusters])
        if len(clusters)
        else np.zeros((0, 1))
    )
    if len(rows) < 2:
        return None, np.zeros(0)
    # Moments of all resamples at once: how often each flight was drawn, times the flights.
    weights = cluster_weights([len(cluster) for cluster in clusters], rng, resamples)
    size = sum(len(cluster) for cluster in clusters)
    centered = rows - rows.mean(axis=0)
    variance = (weights @ centered**2 - (weights @ centered) ** 2).clip(min=0.0) * (
        size / (size - 1)
    )
    return float(np.sqrt(np.mean(rows.var(axis=0, ddof=1)))), np.sqrt(variance.mean(axis=1))
