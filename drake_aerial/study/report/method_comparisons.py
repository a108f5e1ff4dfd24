"""Values of the comparison tables on a study's page: one method against another."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from drake_aerial.study.analysis.flight_claims import claims_inertia
from drake_aerial.study.analysis.labels import INERTIA_WORDS
from drake_aerial.study.analysis.quantities import BY_KEY
from drake_aerial.study.analysis.summary import StudyNumbers


def method_comparisons(numbers: StudyNumbers) -> list[dict[str, Any]]:
    """Return a table for each pair of methods that share a condition, by inertia."""
    main = claims_inertia(numbers.groups)
    tables: dict[tuple[str, str, str], list[dict[str, str]]] = {}
    for c in numbers.comparisons:
        key = (c["first"], c["second"], c["inertia"])
        tables.setdefault(key, []).append(_row(c))
    pairs = list(dict.fromkeys((first, second) for first, second, _ in tables))
    keys = sorted(tables, key=lambda key: (pairs.index(key[:2]), key[2] != main))
    return [
        {
            "first": first,
            "second": second,
            "inertia": "" if inertia == main else INERTIA_WORDS.get(inertia, inertia),
            "rows": tables[first, second, inertia],
        }
        for first, second, inertia in keys
    ]


def _row(comparison: Mapping[str, Any]) -> dict[str, str]:
    quantity = BY_KEY[comparison["quantity"]]
    count = comparison["pairs_completed"]
    unpaired = comparison["unpaired"]
    left = f", {unpaired} without partner" if unpaired else ""
    return {
        "condition": comparison["condition"],
        "belief": comparison["belief"],
        "quantity": f"{quantity.name} [{quantity.unit}]",
        "difference": _bracket(
            comparison["difference"], lambda value: quantity.write(value, sign=True)
        ),
        "ratio": _bracket(comparison["ratio"], lambda value: f"{value:.2f}"),
        "wins": _bracket(comparison["wins"], lambda value: f"{100 * value:.0f} %"),
        "pairs": f"{comparison['pairs']} ({count} completed){left}",
    }


def _bracket(values: Sequence[float | None], write: Callable[[Any], str]) -> str:
    value, low, high = values
    if value is None:
        return "–"
    return write(value) if low is None else f"{write(value)} [{write(low)}, {write(high)}]"
