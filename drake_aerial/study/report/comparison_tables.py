"""One method against another on a study's page, pair by pair of flights."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import Any

from drake_aerial.study.analysis.flight_claims import claims_inertia
from drake_aerial.study.analysis.quantities import BY_KEY, INERTIA_WORDS
from drake_aerial.study.analysis.summary import StudyNumbers
from drake_aerial.study.report.page_tables import method_name, table


def comparisons(numbers: StudyNumbers) -> list[str]:
    """Return one folded table for each two methods that were flown in one condition; as HTML."""
    parts = [
        "Flights are paired: the same condition, scan and noise, solutions of the same rank. Difference is first minus second, so that below zero "
        "the first is better; wins counts every pair, failed flights as the worst."
    ]
    inertias = dict.fromkeys(c["inertia"] for c in numbers.comparisons)
    for first, second in dict.fromkeys((c["first"], c["second"]) for c in numbers.comparisons):
        for inertia in sorted(inertias, key=lambda i: i != claims_inertia(numbers.groups)):
            chosen = [
                c
                for c in numbers.comparisons
                if (c["first"], c["second"], c["inertia"]) == (first, second, inertia)
            ]
            if not chosen:
                continue
            rows = [_comparison_row(c) for c in chosen]
            heads = [
                "condition, belief",
                "quantity",
                "difference [95 %]",
                "ratio [95 %]",
                "wins [95 %]",
                "pairs",
            ]
            body = table(heads, rows, left=2)
            extra = (
                ""
                if inertia == claims_inertia(numbers.groups)
                else f", {html.escape(INERTIA_WORDS.get(inertia, inertia))}"
            )
            parts.append(
                f"<details><summary>{method_name(first)} against {method_name(second)}{extra}</summary>{body}</details>"
            )
    return parts if len(parts) > 1 else ["No two methods were flown in one condition."]


def _comparison_row(c: Mapping[str, Any]) -> list[str]:
    quantity = BY_KEY[c["quantity"]]
    difference, ratio, wins = c["difference"], c["ratio"], c["wins"]

    def bracket(values: Sequence[float | None], write: Any) -> str:
        if values[0] is None:
            return "–"
        text = write(values[0])
        return text if values[1] is None else f"{text} [{write(values[1])}, {write(values[2])}]"

    left = f", {c['unpaired']} without partner" if c["unpaired"] else ""
    return [
        f"{html.escape(c['condition'])} <code>{html.escape(c['belief'])}</code>",
        f"{quantity.name} [{quantity.unit}]",
        bracket(difference, lambda v: quantity.write(v, sign=True)),
        bracket(ratio, lambda v: f"{v:.2f}"),
        bracket(wins, lambda v: f"{100 * v:.0f} %"),
        f"{c['pairs']} ({c['pairs_completed']} completed){left}",
    ]
