"""The page of a study's report: readable without the paper, on a screen of any width."""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.drawing.report import Section, embedded_image, write_report
from drake_aerial.study.claims import OURS, Claim, paper_conditions
from drake_aerial.study.flight_claims import claims_inertia
from drake_aerial.study.page_tables import STYLE, badge, method_name, table
from drake_aerial.study.quantities import (
    BELIEF_ORDER,
    BELIEF_WORDS,
    BY_KEY,
    FAILURES,
    INERTIA_WORDS,
    METHOD_ORDER,
    METHOD_WORDS,
    position,
)
from drake_aerial.study.statistics import FORMULAS, Record
from drake_aerial.study.study_files import StudyFiles
from drake_aerial.study.summary import StudyNumbers

_MAIN = "position_rmse_m"
_COLUMNS = (
    "position_rmse_m",
    "velocity_rmse_m_s",
    "attitude_rmse_rad",
    "position_max_m",
    "tilt_mean_rad",
    "tilt_max_rad",
    "thrust_mean_N",
    "moment_rms_N_m",
    "slack_fraction",
    "saturated_fraction",
)
_VIEWS = {"top": "its top face alone", "partial": "one side, as a depth camera sees it", "full": "all around"}


@dataclass(frozen=True)
class Figures:
    """PNG files of the page: contacts and offsets by condition, panels by (condition, belief, inertia)."""

    contacts: dict[str, Path]
    panels: dict[tuple[str, str, str], Path]
    offsets: dict[str, Path]


def write_page(path: Path, files: StudyFiles, numbers: StudyNumbers, figures: Figures) -> None:
    """Write report.html.

    Parameters
    ----------
    path : Path
        The page.
    files : StudyFiles
        For the conditions' words.
    numbers : StudyNumbers
        Everything computed.
    figures : Figures
        What was drawn.
    """
    sections = [
        Section("What was tested", _tested(files, numbers)),
        Section("At a glance: how far the payload strays from its path", _glance(files, numbers)),
        Section("What the paper claims, and what was found", _claims(numbers.claims)),
        *[_condition(files, numbers, figures, name) for name in numbers.conditions],
        Section("One method against another", _comparisons(numbers)),
        Section("How the figures are made", _formulas(files, numbers)),
    ]
    write_report(
        path,
        title=f"Where grippers belong, and how it flies: {files.plan.get('name', 'a study')}",
        answer=_answer(numbers),
        sections=sections,
        style=STYLE,
    )


def _answer(numbers: StudyNumbers) -> str:
    flights = sum(s["flights"] for s in numbers.summaries)
    failures = sum(s[outcome] for s in numbers.summaries for outcome in FAILURES)
    parts = [
        f"<b>{flights} flights</b> in {len(numbers.conditions)} condition{'s' * (len(numbers.conditions) != 1)}, "
        f"{failures} of them failed."
    ]
    for method in OURS:
        words = [claim.verdicts[method] for claim in numbers.claims if method in claim.verdicts]
        if not words:
            continue
        full = sum(word == "holds" for word in words)
        none = sum(word == "does not hold" for word in words)
        untested = sum(word == "not tested" for word in words)
        unsure = sum(word == "undecided" for word in words)
        part = len(words) - full - none - untested - unsure
        counts = [
            f"{number} {what}"
            for number, what in (
                (full, "hold"),
                (part, "hold in part"),
                (none, "do not hold"),
                (unsure, "remain undecided"),
                (untested, "could not be tested"),
            )
            if number
        ]
        parts.append(
            f"Of the paper's {len(words)} claims on how contacts fly, for {method_name(method)}: {', '.join(counts)}."
        )
    main = _overall(numbers)
    return " ".join([*parts, main]).strip()


def _overall(numbers: StudyNumbers) -> str:
    """One sentence on the paper's conditions under the first belief, ours against the baseline."""
    wanted = paper_conditions(numbers.conditions)
    cells = {
        (s["condition"], s["method"]): s["quantities"][_MAIN]["mean"]
        for s in numbers.summaries
        if s["inertia"] == claims_inertia(numbers.groups) and s["belief"] == _beliefs(numbers)[0]
    }
    both = [c for c in wanted if all(cells.get((c, m)) is not None for m in ("task", "kopicki"))]
    if not both:
        return ""
    text = "; ".join(
        f"{c}: {100 * cells[c, 'task']:.1f} cm against the baseline's {100 * cells[c, 'kopicki']:.1f}" for c in both
    )
    return f"Mean distance from the path ({html.escape(_beliefs(numbers)[0])}), this package's method: {text}."


def _beliefs(numbers: StudyNumbers) -> list[str]:
    return sorted({group.belief for group in numbers.groups}, key=lambda b: position(BELIEF_ORDER, b))


def _methods(numbers: StudyNumbers, conditions: Iterable[str] | None = None) -> list[str]:
    wanted = set(numbers.conditions if conditions is None else conditions)
    found = {group.method for group in numbers.groups if group.condition in wanted}
    return sorted(found, key=lambda m: position(METHOD_ORDER, m))


def _tested(files: StudyFiles, numbers: StudyNumbers) -> list[str]:
    methods = "".join(
        f"<li>{method_name(method)}: {html.escape(METHOD_WORDS.get(method, ''))}</li>" for method in _methods(numbers)
    )
    beliefs = "".join(
        f"<li><code>{html.escape(belief)}</code>: {html.escape(BELIEF_WORDS.get(belief, ''))}</li>"
        for belief in _beliefs(numbers)
    )
    rows = []
    for name in numbers.conditions:
        known = files.conditions.get(name, {})
        view = str(known.get("view", ""))
        rows.append(
            [
                f"<b>{html.escape(name)}</b>",
                html.escape(files.title(name).replace("->", "→")),
                html.escape(str(known.get("demonstration") or ("contacts are given" if known else ""))),
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


def _glance(files: StudyFiles, numbers: StudyNumbers) -> list[str]:
    parts = [
        "Root mean square over circle and hover, mean of all completed flights [cm], with its 95 % interval; smaller is better, the smallest "
        "of a row is bold. Failed flights stand beside it and have no part in the mean."
    ]
    inertia = claims_inertia(numbers.groups)
    for belief in _beliefs(numbers):
        cells = {
            (s["condition"], s["method"]): s
            for s in numbers.summaries
            if (s["belief"], s["inertia"]) == (belief, inertia)
        }
        methods = [m for m in _methods(numbers) if any(method == m for _, method in cells)]
        conditions = [c for c in numbers.conditions if any(condition == c for condition, _ in cells)]
        given = {c for c in conditions if not any((c, m) in cells for m in ("task", "paper", "kopicki", "centroid"))}
        learnt = [m for m in methods if any((c, m) in cells for c in conditions if c not in given)]
        rows = [
            [f"{html.escape(c)}: {html.escape(files.title(c).replace('->', '→'))}", *_row(cells, c, learnt)]
            for c in conditions
            if c not in given
        ]
        parts.append(f"<h3>Belief <code>{html.escape(belief)}</code>: {html.escape(BELIEF_WORDS.get(belief, ''))}</h3>")
        if rows:
            parts.append(table(["condition", *map(method_name, learnt)], rows))
        for c in sorted(given, key=numbers.conditions.index):
            own = [m for m in methods if (c, m) in cells]
            label = f"{html.escape(c)}: {html.escape(files.title(c))}"
            parts.append(table(["contacts given", *map(method_name, own)], [[label, *_row(cells, c, own)]]))
    return parts


def _row(cells: Mapping[tuple[str, str], dict[str, Any]], condition: str, methods: Sequence[str]) -> list[str]:
    quantity = BY_KEY[_MAIN]
    means = [cells[condition, m]["quantities"][_MAIN]["mean"] for m in methods if (condition, m) in cells]
    best = min([m for m in means if m is not None], default=None)
    row = []
    for method in methods:
        cell = cells.get((condition, method))
        if cell is None:
            row.append('<span class="muted">not run</span>')
            continue
        figure = cell["quantities"][_MAIN]
        text = quantity.write(figure["mean"])
        text = f"<b>{text}</b>" if figure["mean"] is not None and figure["mean"] == best else text
        low, high = figure["interval"]
        if low is not None and high is not None:
            text += f'<br><span class="muted">[{quantity.write(low)}, {quantity.write(high)}]</span>'
        row.append(text + _failures(cell))
    return row


def _failures(cell: Mapping[str, Any]) -> str:
    failures = sum(cell[outcome] for outcome in FAILURES)
    text = f'<br><span class="bad">{failures} of {cell["flights"]} failed</span>' if failures else ""
    return text if cell["flights"] else '<br><span class="bad">nothing to fly</span>'


def _claims(claims: Sequence[Claim]) -> list[str]:
    subjects = [method for method in OURS if any(method in claim.verdicts for claim in claims)]
    rows = []
    for index, claim in enumerate(claims, 1):
        cells = [badge(claim.verdicts[s]) if s in claim.verdicts else "" for s in subjects]
        others = [word for s, word in claim.verdicts.items() if s not in subjects]
        if others:
            subject = next(s for s in claim.verdicts if s not in subjects)
            cells = [f"{method_name(subject)}<br>{badge(others[0])}"] + [""] * (len(subjects) - 1)
        rows.append([f'<a href="#claim-{index}">{index}</a>', html.escape(claim.text), *cells])
    parts = [
        "Every verdict is computed from the records by a rule that stands with the claim below. <i>Undecided</i> means that the interval "
        "allows both. Where the study has the paper's conditions (A to D), verdicts rest on them alone; others are shown and not counted. A claim that is about contacts, or about the baseline, has one verdict.",
        table(["", "the paper's claim", *map(method_name, subjects)], rows, left=2 + len(subjects)),
    ]
    for index, claim in enumerate(claims, 1):
        # What needs an explanation is open.
        open_ = any(word not in ("holds", "not tested") for word in claim.verdicts.values())
        parts.append(_claim_details(index, claim, open_))
    return parts


def _claim_details(index: int, claim: Claim, open_: bool) -> str:
    rows = [
        [
            html.escape(f.condition) + ("" if f.counted else ' <span class="muted">(not counted)</span>'),
            f"<code>{html.escape(f.belief)}</code>" if f.belief else "",
            method_name(f.subject),
            html.escape(f.text()),
            badge(f.outcome),
            f'<div class="more">{html.escape(f.detail if f.figure[0] is not None else "")}</div>',
        ]
        for f in claim.findings
    ]
    body = (
        table(["where", "belief", "of", "figure [95 % interval]", "finding", "more"], rows, left=3)
        if rows
        else "<p>Nothing to test it on.</p>"
    )
    why = "".join(f"<li>{html.escape(text)}</li>" for text in claim.why)
    why = f"<p><b>Where it does not hold, why:</b></p><ul>{why}</ul>" if why else ""
    verdicts = " ".join(f"{html.escape(s)} {badge(w)}" for s, w in claim.verdicts.items())
    return (
        f'<details id="claim-{index}"{" open" if open_ else ""}><summary>{index}. {html.escape(claim.text)} {verdicts}</summary>'
        f"<p>Figure: {html.escape(claim.figure)}. Rule: {html.escape(claim.rule)}.</p>{body}{why}</details>"
    )


def _condition(files: StudyFiles, numbers: StudyNumbers, figures: Figures, name: str) -> Section:
    own = [s for s in numbers.summaries if s["condition"] == name]
    parts = [_discarded(numbers, name)]
    if name in figures.contacts:
        parts.append(
            embedded_image(
                figures.contacts[name],
                _contacts_caption(numbers, given=not files.conditions.get(name, {}).get("demonstration")),
                kind="wide-figure",
            )
        )
    inertia = claims_inertia(numbers.groups)
    for shown in dict.fromkeys([inertia, *(s["inertia"] for s in own)]):
        summaries = [s for s in own if s["inertia"] == shown]
        if not summaries:
            continue
        body = _group_table(summaries) + "".join(
            embedded_image(
                image,
                f"Belief {belief}: mean (line) and one standard deviation (band) over all flights of a method; dotted lines part the phases; "
                "a cross is where a failed flight ends and leaves the mean."
                + (" Thrust and moments are the mean over the quadrotors." if _teams(numbers, name) else ""),
                kind="wide-figure",
            )
            for (condition, belief, used), image in figures.panels.items()
            if (condition, used) == (name, shown)
        )
        label = html.escape(INERTIA_WORDS.get(shown, shown))
        parts.append(
            f"<div>{body}</div>" if shown == inertia else f"<details><summary>With {label}</summary>{body}</details>"
        )
    if name in figures.offsets:
        parts.append(
            embedded_image(
                figures.offsets[name],
                "Each mark is one contact solution, the mean of its flights. Hollow marks on the upper border: at least one of its flights failed. "
                "If the marks of all methods lie on one rising curve, the distance from above the centre of mass is what matters.",
                kind="small-figure",
            )
        )
    salient = [
        f"{method_name(m)} {100 * np.mean(numbers.saliency[name, m]):.0f} %"
        for m in _methods(numbers, [name])
        if numbers.saliency.get((name, m))
    ]
    if salient:
        parts.append(
            "How rich in features the contacts' surroundings are (50 %: as the average place on the scan; 100 %: the richest): "
            + ", ".join(salient)
            + "."
        )
    return Section(f"{name}: {files.title(name).replace('->', '→')}", [part for part in parts if part])


def _contacts_caption(numbers: StudyNumbers, given: bool) -> str:
    if given:
        start = "The contacts that were given, each with"
    else:
        start = (
            "Left: what was shown (red: the surface at the contact, black: the features that say where it lies). Then the solutions flown, the "
            "likeliest first, each with"
        )
    return (
        f"{start} how far from above the centre of mass it lies and how far from its path the payload flew (mean RMS, belief "
        f"{_beliefs(numbers)[0]}). The darker the scan, the richer in features; the magenta line goes up from the true centre of mass, which no "
        "method knows."
    )


def _teams(numbers: StudyNumbers, condition: str) -> bool:
    return any(
        len((record.get("contact") or {}).get("positions_S") or []) > 1
        for group, members in numbers.groups.items()
        if group.condition == condition
        for record in members
    )


def _discarded(numbers: StudyNumbers, condition: str) -> str:
    """Say what was not flown or was moved by hand in the paper: contacts that touch nothing, solutions that cannot be."""
    notes = []
    seen: dict[str, list[Record]] = {}
    for group, members in numbers.groups.items():
        if group.condition == condition:
            seen.setdefault(group.method, members)
    for method, members in seen.items():
        out = [r for r in members if r["outcome"] == "not_flown"]
        if out:
            reasons = sorted(
                {reason for r in out for reason in r.get("reasons") or [r.get("outcome_reason") or "no reason given"]}
            )
            notes.append(f"{method_name(method)}: {len(out)} discarded ({html.escape('; '.join(reasons))})")
        moved = {r["solution"]: max(r.get("moved_m") or [0.0]) for r in members if r["outcome"] != "not_flown"}
        far = [value for value in moved.values() if value and value > 1e-3]
        if far:
            notes.append(
                f"{method_name(method)}: {len(far)} solution(s) with a gripper that touched nothing, moved to the closest point of the payload "
                f"(up to {100 * max(far):.1f} cm)"
            )
    return f"Not flown as found: {'; '.join(notes)}." if notes else "Every solution was flown as it was found."


def _group_table(summaries: Sequence[dict[str, Any]]) -> str:
    heads = ["belief, method", "flights", "contact off the vertical [cm]"]
    heads += [f"{BY_KEY[key].name} [{BY_KEY[key].unit}]" for key in _COLUMNS] + ["median of all [cm]"]
    rows = []
    for s in summaries:
        rate = s["failure_rate"]
        failures = sum(s[outcome] for outcome in FAILURES)
        fails = (
            f'<br><span class="bad">{failures} failed ({", ".join(f"{s[o]} {o}" for o in FAILURES if s[o])}), '
            f"rate {100 * rate[0]:.0f} % [{100 * rate[1]:.0f}, {100 * rate[2]:.0f}]</span>"
            if failures
            else ""
        )
        off = s["contact_off_com_m"]
        offset = (
            "–"
            if off["mean"] is None
            else f'{100 * off["mean"]:.1f} <span class="muted">({100 * off["min"]:.1f} to {100 * off["max"]:.1f})</span>'
        )
        cells = []
        for key in _COLUMNS:
            figure = s["quantities"][key]
            text = BY_KEY[key].write(figure["mean"])
            if figure["std"] is not None:
                text += f' <span class="muted">± {BY_KEY[key].write(figure["std"])}</span>'
            cells.append(text)
        ranked = s["quantities"][_MAIN]
        last = (
            "a failure" if ranked["median_all"] is None and s["flights"] else BY_KEY[_MAIN].write(ranked["median_all"])
        )
        name = f"<code>{html.escape(s['belief'])}</code> {method_name(s['method'])}"
        flights = f"{s['flights']} ({s['solutions']} solution{'s' * (s['solutions'] != 1)}){fails}"
        rows.append([name, flights, offset, *cells, last])
    note = '<p class="muted">Mean ± standard deviation over completed flights; "median of all" counts a failed flight as the worst.</p>'
    return table(heads, rows) + note


def _comparisons(numbers: StudyNumbers) -> list[str]:
    parts = [
        "Flights are paired: the same condition, scan and noise, solutions of the same rank. Difference is first minus second, so that below zero "
        "the first is better; wins counts every pair, failed flights as the worst."
    ]
    inertias = dict.fromkeys(c["inertia"] for c in numbers.comparisons)
    for first, second in dict.fromkeys((c["first"], c["second"]) for c in numbers.comparisons):
        for inertia in sorted(inertias, key=lambda i: i != claims_inertia(numbers.groups)):
            chosen = [
                c for c in numbers.comparisons if (c["first"], c["second"], c["inertia"]) == (first, second, inertia)
            ]
            if not chosen:
                continue
            rows = [_comparison_row(c) for c in chosen]
            heads = ["condition, belief", "quantity", "difference [95 %]", "ratio [95 %]", "wins [95 %]", "pairs"]
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


def _formulas(files: StudyFiles, numbers: StudyNumbers) -> list[str]:
    rows = "".join(f"<li><b>{html.escape(name)}</b>: {html.escape(text)}.</li>" for name, text in FORMULAS.items())
    plan = files.plan
    known = [
        f"{label} {html.escape(str(plan[key]))}"
        for key, label in (("package_version", "drake_aerial"), ("seed", "seed"))
        if key in plan
    ]
    parts = [
        f"<ul>{rows}</ul>",
        "On made-up normal data with five solutions of ten flights, these 95 % intervals covered the truth in 92 to 96 % of cases (with three solutions, "
        "in 79 %: no verdict on methods is given for fewer than four). Each verdict stands alone: nothing is corrected for the number of claims.",
        "Every number of this page is in <code>summary.json</code> beside it, and can be computed again from <code>records.jsonl</code> by the formula named there; "
        f"the figures are in <code>figures/</code> as PNG and PDF. {', '.join(known)}{'.' if known else ''}",
    ]
    if numbers.complaints:
        lines = "".join(f"<li>{html.escape(text)}</li>" for text in numbers.complaints)
        parts.append(f'<div class="answer"><b>What could not be read:</b><ul>{lines}</ul></div>')
    return parts
