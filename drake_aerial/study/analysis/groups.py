"""Groups of a study's records: one condition, method, belief and inertia each."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drake_aerial.study.analysis.labels import (
    BELIEF_ORDER,
    INERTIA_ORDER,
    METHOD_ORDER,
    position,
)
from drake_aerial.study.analysis.quantities import FAILURES
from drake_aerial.study.records import Record


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
        return replace(self, method=method)


def groups_of(
    records: Iterable[Record], conditions: Sequence[str] = ()
) -> dict[Group, list[Record]]:
    """Return the records by group, in the report's order.

    The result does not depend on the order of the records. A key that occurs twice counts once.

    Parameters
    ----------
    records : iterable of dict
        See `records.read_records`.
    conditions : sequence of str
        Their order; other conditions follow in alphabetical order.
    """
    unique = {record["key"]: record for record in records}
    order = tuple(conditions)
    groups: dict[Group, list[Record]] = {}
    for record in sorted(
        unique.values(), key=lambda r: (r["solution"] or 0, r["rank"] or 0, r["trial"], r["key"])
    ):
        groups.setdefault(Group.of(record), []).append(record)

    def place(group: Group) -> tuple[tuple[int, str], ...]:
        return (
            position(order, group.condition),
            position(BELIEF_ORDER, group.belief),
            position(INERTIA_ORDER, group.inertia),
            position(METHOD_ORDER, group.method),
        )

    return {group: groups[group] for group in sorted(groups, key=place)}


def flown(records: Iterable[Record]) -> list[Record]:
    """Return the records of flights, without solutions that were not flown."""
    return [record for record in records if record["outcome"] != "not_flown"]


def failed(record: Record) -> bool:
    """Return True if a flight ended in a failure."""
    return record["outcome"] in FAILURES


def by_solution(records: Iterable[Record]) -> dict[int, list[Record]]:
    """Return the flights of each solution, by its rank among the flown ones."""
    solutions: dict[int, list[Record]] = {}
    for record in flown(records):
        solutions.setdefault(record["solution"], []).append(record)
    return dict(sorted(solutions.items()))


def value_of(record: Record, key: str) -> float | None:
    """Return a quantity of a completed flight; None for a failed one or a missing value."""
    if record["outcome"] != "completed":
        return None
    value = (record["metrics"] or {}).get(key)
    return None if value is None or not np.isfinite(value) else float(value)


def values_of(records: Iterable[Record], key: str) -> list[float]:
    """Return a quantity of the completed flights."""
    return [v for v in (value_of(record, key) for record in records) if v is not None]


def ranked_value(record: Record, key: str) -> float | None:
    """Return a quantity of a flight; infinite for a failed one, so that it ranks last."""
    return float("inf") if failed(record) else value_of(record, key)


def offset_of(records: Sequence[Record]) -> float | None:
    """Return the horizontal distance of a solution's contact from the centre of mass [m]."""
    return (records[0].get("contact") or {}).get("off_com_m")


def moved_of(record: Record) -> list[float]:
    """Return the distances [m] by which grippers were moved onto the surface."""
    return [moved for moved in record.get("moved_m") or [] if moved and moved > 1e-3]
