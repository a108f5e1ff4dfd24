"""The overview on a study's page: what was tested, and how far the payload strayed in every condition."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import Any

from drake_aerial.study.analysis.flight_claims import claims_inertia
from drake_aerial.study.analysis.quantities import (
    BELIEF_WORDS,
    BY_KEY,
    FAILURES,
    MAIN,
    METHOD_WORDS,
)
from drake_aerial.study.analysis.study_files import StudyFiles
from drake_aerial.study.analysis.summary import StudyNumbers
from drake_aerial.study.report.page_tables import method_name, table

_VIEWS = {
    "top": "its top face alone",
    "partial": "one side, as a depth camera sees it",
    "full": "all around",
}


def tested(files: StudyFiles, numbers: StudyNumbers) -> list[str]:
    """Return what a flight is, which methods and beliefs there are, and the table of conditions; as HTML."""
    methods = "".join(
        f"<li>{method_name(method)}: {html.escape(METHOD_WORDS.get(method, ''))}</li>"
        for method in numbers.methods()
    )
    beliefs = "".join(
        f"<li><code>{html.escape(belief)}</code>: {html.escape(BELIEF_WORDS.get(belief, ''))}</li>"
        for belief in numbers.beliefs
    )
    rows = []
    for name in numbers.conditions:
        known = files.conditions.get(name, {})
        view = str(known.get("view", ""))
        rows.append(
            [
                f"<b>{html.escape(name)}</b>",
                html.escape(files.title(name).replace("->", "→")),
                html.escape(
                    str(known.get("demonstration") or ("contacts are given" if known else ""))
                ),
                html.escape(str(known.get("payload", ""))),
                html.escape(_VIEWS.get(view, view)),
            ]
        )
    return [
        "Quadrotors carry a payload by cables that end in magnetic grippers. Where a gripper belongs was <b>shown once</b>, on one object. "
        "On a new payload, of which there is only a scan (no mass, no centre of mass), a method chooses the contacts; then the same "
        "controller lifts the payload, flies a circle of 1 m radius twice in 12 s, and hovers. Its measured position carries noise.",
        "What decides is the method, of which there are:",
        f"<ul>{methods}</ul>",
        "How a contact flies also depends on what the controller believes of the payload:",
        f"<ul>{beliefs}</ul>",
        table(
            ["", "condition", "demonstration", "payload", "what the scan shows"],
            rows,
            left=5,
        ),
    ]


def glance(files: StudyFiles, numbers: StudyNumbers) -> list[str]:
    """Return a table for each belief: how far the payload strayed, by condition and method; as HTML."""
    parts = [
        "Root mean square over circle and hover, mean of all completed flights [cm], with its 95 % interval; smaller is better, the smallest "
        "of a row is bold. Failed flights stand beside it and have no part in the mean."
    ]
    inertia = claims_inertia(numbers.groups)
    for belief in numbers.beliefs:
        cells = {
            (s["condition"], s["method"]): s
            for s in numbers.summaries
            if (s["belief"], s["inertia"]) == (belief, inertia)
        }
        methods = [m for m in numbers.methods() if any(method == m for _, method in cells)]
        conditions = [
            c for c in numbers.conditions if any(condition == c for condition, _ in cells)
        ]
        given = {
            c
            for c in conditions
            if not any((c, m) in cells for m in ("task", "paper", "kopicki", "centroid"))
        }
        learnt = [m for m in methods if any((c, m) in cells for c in conditions if c not in given)]
        rows = [
            [
                f"{html.escape(c)}: {html.escape(files.title(c).replace('->', '→'))}",
                *_row(cells, c, learnt),
            ]
            for c in conditions
            if c not in given
        ]
        parts.append(
            f"<h3>Belief <code>{html.escape(belief)}</code>: {html.escape(BELIEF_WORDS.get(belief, ''))}</h3>"
        )
        if rows:
            parts.append(table(["condition", *map(method_name, learnt)], rows))
        for c in sorted(given, key=numbers.conditions.index):
            own = [m for m in methods if (c, m) in cells]
            label = f"{html.escape(c)}: {html.escape(files.title(c))}"
            parts.append(
                table(["contacts given", *map(method_name, own)], [[label, *_row(cells, c, own)]])
            )
    return parts


def _row(
    cells: Mapping[tuple[str, str], dict[str, Any]], condition: str, methods: Sequence[str]
) -> list[str]:
    quantity = BY_KEY[MAIN]
    means = [
        cells[condition, m]["quantities"][MAIN]["mean"] for m in methods if (condition, m) in cells
    ]
    best = min([m for m in means if m is not None], default=None)
    row = []
    for method in methods:
        cell = cells.get((condition, method))
        if cell is None:
            row.append('<span class="muted">not run</span>')
            continue
        figure = cell["quantities"][MAIN]
        text = quantity.write(figure["mean"])
        text = f"<b>{text}</b>" if figure["mean"] is not None and figure["mean"] == best else text
        low, high = figure["interval"]
        if low is not None and high is not None:
            text += (
                f'<br><span class="muted">[{quantity.write(low)}, {quantity.write(high)}]</span>'
            )
        row.append(text + _failures(cell))
    return row


def _failures(cell: Mapping[str, Any]) -> str:
    failures = sum(cell[outcome] for outcome in FAILURES)
    text = (
        f'<br><span class="bad">{failures} of {cell["flights"]} failed</span>' if failures else ""
    )
    return text if cell["flights"] else '<br><span class="bad">nothing to fly</span>'
