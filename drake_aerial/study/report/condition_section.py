"""Values of a condition's section on a study's page: notes, figures and tables."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.study.analysis.flight_claims import claims_inertia
from drake_aerial.study.analysis.groups import by_solution, moved_of
from drake_aerial.study.analysis.labels import INERTIA_WORDS
from drake_aerial.study.analysis.quantities import BY_KEY, FAILURES, MAIN
from drake_aerial.study.analysis.summary import StudyNumbers
from drake_aerial.study.records import Record
from drake_aerial.study.report.overview import titles_of
from drake_aerial.study.study_folder import StudyFolder
from drake_aerial.visualization.html_report import EmbeddedImage

COLUMNS = tuple(
    BY_KEY[key]
    for key in (
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
)


@dataclass(frozen=True)
class Figures:
    """PNG files of the page.

    Attributes
    ----------
    contacts, offsets : dict
        By condition.
    time_series : dict
        By (condition, belief, inertia).
    """

    contacts: dict[str, Path] = field(default_factory=dict)
    time_series: dict[tuple[str, str, str], Path] = field(default_factory=dict)
    offsets: dict[str, Path] = field(default_factory=dict)


def condition_section(
    folder: StudyFolder, numbers: StudyNumbers, figures: Figures, name: str
) -> dict[str, Any]:
    """Return the values of the section on the condition called `name`."""
    own = [s for s in numbers.summaries if s["condition"] == name]
    main = claims_inertia(numbers.groups)
    given = not folder.conditions.get(name, {}).get("demonstration")
    return {
        "name": name,
        "title": titles_of(folder, numbers)[name],
        "notes": _notes(numbers, name),
        "contacts": _image(figures.contacts.get(name)),
        "contacts_caption": _contacts_caption(numbers, given),
        "inertias": [
            {
                "folded": inertia != main,
                "label": INERTIA_WORDS.get(inertia, inertia),
                "groups": [_group_row(s) for s in own if s["inertia"] == inertia],
                "panels": [
                    (belief, _image(path))
                    for (condition, belief, used), path in figures.time_series.items()
                    if (condition, used) == (name, inertia)
                ],
            }
            for inertia in sorted(
                dict.fromkeys(s["inertia"] for s in own), key=lambda inertia: inertia != main
            )
        ],
        "several": _several_grippers(numbers, name),
        "offsets": _image(figures.offsets.get(name)),
        "saliency": [
            (method, f"{100 * np.mean(values):.0f} %")
            for method in numbers.methods([name])
            if (values := numbers.saliency.get((name, method)))
        ],
    }


def _image(path: Path | None) -> EmbeddedImage | None:
    return None if path is None else EmbeddedImage.read(path)


def _contacts_caption(numbers: StudyNumbers, given: bool) -> str:
    start = (
        "The given contacts."
        if given
        else "Left: the demonstration, with the surface at the contact in red and the features "
        "that locate it on the object in black. Then the flown solutions, in order of likelihood."
    )
    return (
        f"{start} Above each: the horizontal distance of the contact from the centre of mass, and "
        "the distance of the payload from its path (mean RMS, belief "
        f"{numbers.beliefs[0]}). Dark areas of the scan are salient. The magenta line goes up from "
        "the true centre of mass, which the methods do not know."
    )


def _several_grippers(numbers: StudyNumbers, condition: str) -> bool:
    return any(
        len((record.get("contact") or {}).get("positions_S") or []) > 1
        for group, members in numbers.groups.items()
        if group.condition == condition
        for record in members
    )


def _notes(numbers: StudyNumbers, condition: str) -> list[tuple[str, str]]:
    """Return, by method, the solutions that were discarded and those with moved grippers."""
    by_method: dict[str, list[Record]] = {}
    for group, members in numbers.groups.items():
        if group.condition == condition:
            by_method.setdefault(group.method, members)
    notes = []
    for method, members in by_method.items():
        discarded = [r for r in members if r["outcome"] == "not_flown"]
        if discarded:
            reasons = sorted(
                {
                    reason
                    for r in discarded
                    for reason in r.get("reasons") or [r.get("outcome_reason") or "unknown reason"]
                }
            )
            notes.append((method, f"{len(discarded)} discarded ({'; '.join(reasons)})"))
        moved = [moved_of(flights[0]) for flights in by_solution(members).values()]
        far = [max(distances) for distances in moved if distances]
        if far:
            notes.append(
                (
                    method,
                    f"{len(far)} solution(s) with a gripper off the surface, moved to the closest "
                    f"point of the payload (up to {100 * max(far):.1f} cm)",
                )
            )
    return notes


def _group_row(summary: dict[str, Any]) -> dict[str, Any]:
    """Return the texts of one row of the table of groups."""
    count = sum(summary[outcome] for outcome in FAILURES)
    rate = [100 * (x or 0.0) for x in summary["failure_rate"]]
    kinds = ", ".join(f"{summary[o]} {o}" for o in FAILURES if summary[o])
    off = {
        key: "–" if value is None else f"{100 * value:.1f}"
        for key, value in summary["contact_off_com_m"].items()
    }
    quantities = summary["quantities"]
    median = quantities[MAIN]["median_all"]
    return {
        "belief": summary["belief"],
        "method": summary["method"],
        "flights": f"{summary['flights']} ({_counted(summary['solutions'], 'solution')})",
        "failures": f"{count} failed ({kinds}), rate {rate[0]:.0f} % [{rate[1]:.0f}, {rate[2]:.0f}]"
        if count
        else "",
        "offset": off["mean"],
        "offset_range": "" if off["mean"] == "–" else f"{off['min']} to {off['max']}",
        "cells": [_mean_and_std(quantity, quantities[quantity.key]) for quantity in COLUMNS],
        "median": "a failure"
        if median is None and summary["flights"]
        else BY_KEY[MAIN].write(median),
    }


def _mean_and_std(quantity: Any, figure: dict[str, Any]) -> tuple[str, str]:
    std = figure["std"]
    return quantity.write(figure["mean"]), "" if std is None else quantity.write(std)


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"
