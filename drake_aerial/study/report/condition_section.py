"""One condition on a study's page: its contacts, its flights over time, and its tables."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.study.analysis.flight_claims import claims_inertia
from drake_aerial.study.analysis.quantities import BY_KEY, FAILURES, INERTIA_WORDS, MAIN
from drake_aerial.study.analysis.statistics import Record
from drake_aerial.study.analysis.study_files import StudyFiles
from drake_aerial.study.analysis.summary import StudyNumbers
from drake_aerial.study.report.page_tables import method_name, table
from drake_aerial.visualization.report import Section, embedded_image

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


@dataclass(frozen=True)
class Figures:
    """PNG files of the page: contacts and offsets by condition, panels by (condition, belief, inertia)."""

    contacts: dict[str, Path]
    panels: dict[tuple[str, str, str], Path]
    offsets: dict[str, Path]


def condition_section(
    files: StudyFiles, numbers: StudyNumbers, figures: Figures, name: str
) -> Section:
    """Return the section on the condition called `name`."""
    own = [s for s in numbers.summaries if s["condition"] == name]
    parts = [_discarded(numbers, name)]
    if name in figures.contacts:
        parts.append(
            embedded_image(
                figures.contacts[name],
                _contacts_caption(
                    numbers, given=not files.conditions.get(name, {}).get("demonstration")
                ),
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
                + (
                    " Thrust and moments are the mean over the quadrotors."
                    if _teams(numbers, name)
                    else ""
                ),
                kind="wide-figure",
            )
            for (condition, belief, used), image in figures.panels.items()
            if (condition, used) == (name, shown)
        )
        label = html.escape(INERTIA_WORDS.get(shown, shown))
        parts.append(
            f"<div>{body}</div>"
            if shown == inertia
            else f"<details><summary>With {label}</summary>{body}</details>"
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
        for m in numbers.methods([name])
        if numbers.saliency.get((name, m))
    ]
    if salient:
        parts.append(
            "How rich in features the contacts' surroundings are (50 %: as the average place on the scan; 100 %: the richest): "
            + ", ".join(salient)
            + "."
        )
    return Section(
        f"{name}: {files.title(name).replace('->', '→')}", [part for part in parts if part]
    )


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
        f"{numbers.beliefs[0]}). The darker the scan, the richer in features; the magenta line goes up from the true centre of mass, which no "
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
                {
                    reason
                    for r in out
                    for reason in r.get("reasons") or [r.get("outcome_reason") or "no reason given"]
                }
            )
            notes.append(
                f"{method_name(method)}: {len(out)} discarded ({html.escape('; '.join(reasons))})"
            )
        moved = {
            r["solution"]: max(r.get("moved_m") or [0.0])
            for r in members
            if r["outcome"] != "not_flown"
        }
        far = [value for value in moved.values() if value and value > 1e-3]
        if far:
            notes.append(
                f"{method_name(method)}: {len(far)} solution(s) with a gripper that touched nothing, moved to the closest point of the payload "
                f"(up to {100 * max(far):.1f} cm)"
            )
    return (
        f"Not flown as found: {'; '.join(notes)}."
        if notes
        else "Every solution was flown as it was found."
    )


def _group_table(summaries: Sequence[dict[str, Any]]) -> str:
    heads = ["belief, method", "flights", "contact off the vertical [cm]"]
    heads += [f"{BY_KEY[key].name} [{BY_KEY[key].unit}]" for key in _COLUMNS] + [
        "median of all [cm]"
    ]
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
        ranked = s["quantities"][MAIN]
        last = (
            "a failure"
            if ranked["median_all"] is None and s["flights"]
            else BY_KEY[MAIN].write(ranked["median_all"])
        )
        name = f"<code>{html.escape(s['belief'])}</code> {method_name(s['method'])}"
        flights = f"{s['flights']} ({s['solutions']} solution{'s' * (s['solutions'] != 1)}){fails}"
        rows.append([name, flights, offset, *cells, last])
    note = '<p class="muted">Mean ± standard deviation over completed flights; "median of all" counts a failed flight as the worst.</p>'
    return table(heads, rows) + note
