"""Values of the overview on a study's page: verdict counts, conditions, and error tables."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drake_aerial.study.analysis.claims import OURS, Outcome, paper_conditions
from drake_aerial.study.analysis.flight_claims import claims_inertia
from drake_aerial.study.analysis.quantities import BY_KEY, FAILURES, MAIN
from drake_aerial.study.analysis.summary import StudyNumbers
from drake_aerial.study.study_folder import StudyFolder

_VIEWS = {
    "top": "top face only",
    "partial": "one side, from a depth camera",
    "full": "all sides",
}
_LEARNT = ("task", "paper", "kopicki", "registration", "obb", "centroid")


@dataclass(frozen=True)
class ErrorTable:
    """Distance from the path by condition and method.

    Attributes
    ----------
    head : str
        Head of the first column.
    methods : list of str
        Heads of the other columns.
    rows : list of (label, cells)
        A cell is None where a method was not run.
    """

    head: str
    methods: list[str]
    rows: list[tuple[str, list[dict[str, Any] | None]]]


def titles_of(folder: StudyFolder, numbers: StudyNumbers) -> dict[str, str]:
    """Return the titles of the conditions by name."""
    return {name: folder.title(name).replace("->", "→") for name in numbers.conditions}


def condition_rows(folder: StudyFolder, numbers: StudyNumbers) -> list[dict[str, str]]:
    """Return the rows of the table of conditions."""
    titles = titles_of(folder, numbers)
    rows = []
    for name in numbers.conditions:
        known = folder.conditions.get(name, {})
        view = str(known.get("view", ""))
        given = "contacts are given" if known else ""
        rows.append(
            {
                "name": name,
                "title": titles[name],
                "demonstration": str(known.get("demonstration") or given),
                "payload": str(known.get("payload", "")),
                "view": _VIEWS.get(view, view),
            }
        )
    return rows


def verdict_counts(numbers: StudyNumbers) -> Iterator[tuple[str, int, list[str]]]:
    """Yield for each of our methods the number of claims, and the number per verdict."""
    for method in OURS:
        words = [claim.verdicts[method] for claim in numbers.claims if method in claim.verdicts]
        exact = {
            word: words.count(word)
            for word in (Outcome.HOLDS, "does not hold", Outcome.UNDECIDED, Outcome.NOT_TESTED)
        }
        counts = (
            (exact[Outcome.HOLDS], "hold"),
            (len(words) - sum(exact.values()), "hold in part"),
            (exact["does not hold"], "do not hold"),
            (exact[Outcome.UNDECIDED], "are undecided"),
            (exact[Outcome.NOT_TESTED], "could not be tested"),
        )
        if words:
            yield method, len(words), [f"{number} {what}" for number, what in counts if number]


def mean_errors(numbers: StudyNumbers) -> list[tuple[str, str, str]]:
    """Return condition, our mean error and the baseline's [cm], under the first belief."""
    cells = {
        (s["condition"], s["method"]): s["quantities"][MAIN]["mean"]
        for s in numbers.summaries
        if s["inertia"] == claims_inertia(numbers.groups) and s["belief"] == numbers.beliefs[0]
    }
    write = BY_KEY[MAIN].write
    return [
        (c, write(cells[c, "task"]), write(cells[c, "kopicki"]))
        for c in paper_conditions(numbers.conditions)
        if all(cells.get((c, m)) is not None for m in ("task", "kopicki"))
    ]


def error_tables(
    folder: StudyFolder, numbers: StudyNumbers
) -> Iterator[tuple[str, list[ErrorTable]]]:
    """Yield for each belief its tables: transferred contacts, then each set of given ones."""
    titles = titles_of(folder, numbers)
    inertia = claims_inertia(numbers.groups)
    for belief in numbers.beliefs:
        cells = {
            (s["condition"], s["method"]): s
            for s in numbers.summaries
            if (s["belief"], s["inertia"]) == (belief, inertia)
        }
        conditions = [c for c in numbers.conditions if any(c == own for own, _ in cells)]
        learnt = [c for c in conditions if any((c, m) in cells for m in _LEARNT)]
        parts = [("condition", learnt)]
        parts += [("contacts given", [c]) for c in conditions if c not in learnt]
        tables = []
        for head, own in parts:
            methods = [m for m in numbers.methods() if any((c, m) in cells for c in own)]
            rows = [(f"{c}: {titles[c]}", _cells(cells, c, methods)) for c in own]
            if rows:
                tables.append(ErrorTable(head, methods, rows))
        yield belief, tables


def _cells(
    summaries: Mapping[tuple[str, str], dict[str, Any]], condition: str, methods: Sequence[str]
) -> list[dict[str, Any] | None]:
    quantity = BY_KEY[MAIN]
    row = [summaries.get((condition, method)) for method in methods]
    means = [s["quantities"][MAIN]["mean"] for s in row if s is not None]
    best = min((mean for mean in means if mean is not None), default=None)
    cells: list[dict[str, Any] | None] = []
    for summary in row:
        if summary is None:
            cells.append(None)
            continue
        figure = summary["quantities"][MAIN]
        cells.append(
            {
                "mean": quantity.write(figure["mean"]),
                "best": best is not None and figure["mean"] == best,
                "interval": quantity.bracket(*figure["interval"]),
                "failures": sum(summary[outcome] for outcome in FAILURES),
                "flights": summary["flights"],
            }
        )
    return cells
