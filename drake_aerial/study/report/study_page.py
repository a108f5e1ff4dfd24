"""The page of a study's report: its values, for the template study_report.html."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from drake_aerial.study.analysis.claims import OURS, Outcome
from drake_aerial.study.analysis.flight_claims import claims_inertia
from drake_aerial.study.analysis.labels import BELIEF_WORDS, INERTIA_WORDS, METHOD_WORDS
from drake_aerial.study.analysis.quantities import BY_KEY, FAILURES
from drake_aerial.study.analysis.statistics import FORMULAS
from drake_aerial.study.analysis.summary import StudyNumbers
from drake_aerial.study.report.condition_section import COLUMNS, Figures, condition_section
from drake_aerial.study.report.method_styles import method_color
from drake_aerial.study.report.overview import (
    condition_rows,
    error_tables,
    mean_errors,
    verdict_counts,
)
from drake_aerial.study.study_folder import StudyFolder
from drake_aerial.visualization.html_report import write_html_report


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


def write_study_page(
    path: Path, folder: StudyFolder, numbers: StudyNumbers, figures: Figures
) -> None:
    """Write report.html.

    Parameters
    ----------
    path : Path
    folder : StudyFolder
        Its plan has the titles of the conditions.
    numbers : StudyNumbers
    figures : Figures
        PNG files to embed.
    """
    methods, summaries = numbers.methods(), numbers.summaries
    values: dict[str, Any] = {
        "title": f"Contacts and flights: {folder.plan.get('name', 'a study')}",
        "colors": method_color,
        "mark": verdict_mark,
        "methods": methods,
        "method_words": {method: METHOD_WORDS.get(method, "") for method in methods},
        "beliefs": numbers.beliefs,
        "belief_words": {belief: BELIEF_WORDS.get(belief, "") for belief in numbers.beliefs},
        "flights": sum(s["flights"] for s in summaries),
        "failures": sum(s[outcome] for s in summaries for outcome in FAILURES),
        "conditions": condition_rows(folder, numbers),
        "verdict_counts": verdict_counts(numbers),
        "overall": mean_errors(numbers),
        "glance": error_tables(folder, numbers),
        "claims": numbers.claims,
        "subjects": [m for m in OURS if any(m in claim.verdicts for claim in numbers.claims)],
        "columns": COLUMNS,
        "sections": [
            condition_section(folder, numbers, figures, name) for name in numbers.conditions
        ],
        "comparisons": method_comparisons(numbers),
        "formulas": FORMULAS,
        "version": ", ".join(
            f"{label} {folder.plan[key]}"
            for key, label in (("package_version", "drake_aerial"), ("seed", "seed"))
            if key in folder.plan
        ),
        "complaints": numbers.complaints,
    }
    write_html_report(path, "study_report.html", values, package=__package__)


def verdict_mark(word: str) -> tuple[str, str]:
    """Return the CSS class and the sign of a verdict or an outcome."""
    if word == Outcome.HOLDS or (word.startswith("holds under") and ";" not in word):
        return "yes", "✓"
    if word.startswith("holds") or ";" in word:
        return "part", "◐"
    if word == Outcome.NOT_TESTED:
        return "none", "–"
    if word == Outcome.UNDECIDED:
        return "part", "?"
    return "no", "✗"
