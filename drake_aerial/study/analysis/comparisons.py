"""Paired comparison of two groups of flights; see "pairs" in `statistics.FORMULAS`."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from drake_aerial.geometry import Array
from drake_aerial.study.analysis.groups import Group, by_solution, flown, ranked_value, value_of
from drake_aerial.study.analysis.intervals import cluster_bootstrap, named_generator
from drake_aerial.study.records import Record

Pair = tuple[Record, Record]


def pair_flights(first: Sequence[Record], second: Sequence[Record]) -> tuple[list[list[Pair]], int]:
    """Return the pairs of flights of two groups.

    Returns
    -------
    pairs : list of lists
        One list per solution rank.
    unpaired : int
        Number of flights without a partner.
    """
    a, b = by_solution(first), by_solution(second)
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
    group: Group, other: Group, groups: Mapping[Group, Sequence[Record]], key: str
) -> dict[str, Any]:
    """Return difference, ratio and wins of a quantity between two groups, with intervals."""
    pairs, unpaired = pair_flights(groups.get(group, []), groups.get(other, []))
    completed = _valued(pairs, value_of, key)
    ranked = _valued(pairs, ranked_value, key)
    wins = [[_win(x, y) for x, y in rank] for rank in ranked]
    name = ("compare", str(group), str(other), key)
    difference = cluster_bootstrap(
        [[x - y for x, y in rank] for rank in completed], named_generator("difference", *name)
    )
    ratio = cluster_bootstrap(completed, named_generator("ratio", *name), of_means=_ratio)
    return {
        "condition": group.condition,
        "belief": group.belief,
        "inertia": group.inertia,
        "first": group.method,
        "second": other.method,
        "quantity": key,
        "ranks": len(wins),
        "pairs": sum(map(len, wins)),
        "pairs_completed": sum(map(len, completed)),
        "unpaired": unpaired,
        "difference": difference.to_list(),
        "ratio": ratio.to_list(),
        "wins": cluster_bootstrap(wins, named_generator("wins", *name)).to_list(),
    }


def _valued(pairs: Sequence[Sequence[Pair]], value: Any, key: str) -> list[list[tuple[Any, Any]]]:
    """Return the values of the pairs in which both have one; without empty ranks."""
    ranks = [[(value(a, key), value(b, key)) for a, b in rank] for rank in pairs]
    valued = [[(x, y) for x, y in rank if x is not None and y is not None] for rank in ranks]
    return [rank for rank in valued if rank]


def _ratio(means: Array) -> Array:
    return np.divide(
        means[:, 0], means[:, 1], out=np.full(len(means), np.nan), where=means[:, 1] != 0.0
    )


def _win(first: float, second: float) -> float:
    return 0.5 if first == second else float(first < second)
