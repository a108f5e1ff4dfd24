"""The report of a study: figures, summary.json and one self-contained page, from its folder."""

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from drake_aerial.errors import InputError
from drake_aerial.io.files import write_text
from drake_aerial.study.analysis.flight_claims import claims_inertia
from drake_aerial.study.analysis.groups import by_solution, moved_of, offset_of, values_of
from drake_aerial.study.analysis.labels import METHOD_ORDER, position
from drake_aerial.study.analysis.quantities import BY_KEY, FAILURES, MAIN
from drake_aerial.study.analysis.summary import StudyNumbers, summarize_study
from drake_aerial.study.records import Record, read_records
from drake_aerial.study.report.condition_section import Figures
from drake_aerial.study.report.contact_offset_figure import draw_contact_offsets
from drake_aerial.study.report.flown_contacts_figure import FlownSolution, draw_flown_contacts
from drake_aerial.study.report.study_page import write_study_page
from drake_aerial.study.report.time_series_figure import draw_time_series
from drake_aerial.study.study_folder import StudyFolder

Progress = Callable[[float, str], None]
PAGE = "report.html"
SUMMARY = "summary.json"
FIGURES = "figures"
_COLUMNS = 5
"""Largest number of solutions of a method in the figure of contacts."""


@dataclass(frozen=True)
class ReportSummary:
    """The result of `write_report`.

    Attributes
    ----------
    page : Path
        report.html.
    lines : tuple of str
        Number of flights, and the verdict on each claim.
    timing : dict
        `flights_wall_s`, `flights_cpu_s`, `transfers_wall_s` and `transfers_cpu_s` [s]; not part of
        the report.
    """

    page: Path
    lines: tuple[str, ...]
    timing: dict[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        took = [
            f"{name}: {self.timing[f'{name}_wall_s']:.1f} s, "
            f"{self.timing[f'{name}_cpu_s']:.1f} s of processor time"
            for name in ("transfers", "flights")
            if f"{name}_cpu_s" in self.timing
        ]
        return "\n".join([*self.lines, *took, f"open {self.page}"])


def write_report(folder: str | Path, *, progress: Progress | None = None) -> ReportSummary:
    """Build figures, summary.json and report.html of a study from its folder.

    The same records, in any order, give the same bytes: the report has no dates and no timing.

    Parameters
    ----------
    folder : str or Path
        Folder of the study, with records.jsonl and, if they exist, study.yaml, contacts, scans,
        skills and series.
    progress : callable, optional
        Called with the fraction done and the current step.

    Raises
    ------
    InputError
        If there is no valid record.

    Examples
    --------
    >>> import tempfile
    >>> from drake_aerial import Condition, StudyPlan, run_study, write_report
    >>> from drake_aerial.references.trajectory import HoverTrajectory
    >>> from drake_aerial.study.plan import Flights
    >>> hover = HoverTrajectory(hover_time=1.0)
    >>> contacts = (("middle", ((0.0, 0.0, 0.14),)),)
    >>> held = Condition("held", "box_68x68x28", trajectory=hover, contacts=contacts)
    >>> plan = StudyPlan("small", (held,), (Flights(("held",), ("task",), solutions=1, trials=2),))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = run_study(plan, folder)
    ...     write_report(folder).page.name
    'report.html'
    """
    tell = progress or (lambda fraction, what: None)
    folder = Path(folder)
    if not os.path.isdir(folder):
        raise InputError(
            f"{folder} is not a folder; give the folder of a study, with its records.jsonl"
        )
    tell(0.0, "reading the records")
    records, complaints = read_records(folder)
    if not records:
        skipped = f" ({len(complaints)} lines in it cannot be read)" if complaints else ""
        raise InputError(
            f"{folder} has no records{skipped}; give the folder of a study, with its records.jsonl"
        )
    study = StudyFolder(folder)
    numbers = summarize_study(study, records, complaints)
    figures = _draw(study, numbers, tell)
    tell(0.97, "writing the page")
    write_text(folder / SUMMARY, json.dumps(numbers.to_dict(), indent=1, allow_nan=False) + "\n")
    write_study_page(folder / PAGE, study, numbers, figures)
    tell(1.0, "done")
    return ReportSummary(folder / PAGE, tuple(_lines(numbers)), _timing(study, records))


def _draw(folder: StudyFolder, numbers: StudyNumbers, tell: Progress) -> Figures:
    figures = Figures()
    out = folder.path / FIGURES
    for index, condition in enumerate(numbers.conditions):
        tell(0.1 + 0.85 * index / len(numbers.conditions), f"drawing condition {condition}")
        own = {g: members for g, members in numbers.groups.items() if g.condition == condition}
        name = "".join(c if c.isalnum() or c in "-_" else "_" for c in condition)
        drawn = _draw_contacts(folder, numbers, condition, out / f"contacts-{name}")
        if drawn is not None:
            figures.contacts[condition] = drawn
        for belief, inertia in dict.fromkeys((group.belief, group.inertia) for group in own):
            shown = {
                g.method: numbers.timelines[g]
                for g in own
                if (g.belief, g.inertia) == (belief, inertia)
            }
            drawn = draw_time_series(out / f"flights-{name}-{belief}-{inertia}", shown)
            if drawn is not None:
                figures.time_series[condition, belief, inertia] = drawn
        inertia = claims_inertia(numbers.groups)
        drawn = draw_contact_offsets(out / f"offset-{name}", own, inertia)
        if drawn is not None:
            figures.offsets[condition] = drawn
    return figures


def _draw_contacts(
    folder: StudyFolder, numbers: StudyNumbers, condition: str, stem: Path
) -> Path | None:
    """Draw the flown contacts of one condition; return None if there is no scan."""
    surface = numbers.surfaces.get(condition)
    if surface is None:
        return None
    # Contacts do not depend on belief and inertia: take the first group of each method.
    own: dict[str, list[Record]] = {}
    for group, members in numbers.groups.items():
        if group.condition == condition:
            own.setdefault(group.method, members)
    rows, com = {}, None
    for method in sorted(own, key=lambda m: position(METHOD_ORDER, m)):
        contacts = folder.contacts(condition, method)
        known = {s.rank: s for s in contacts.solutions} if contacts is not None else {}
        solutions = by_solution(own[method]).values()
        coms = [(members[0].get("contact") or {}).get("com_S") for members in solutions]
        com = com or next((c for c in coms if c), None)
        cells = [
            FlownSolution(known[members[0]["rank"]], _caption(members))
            for members in solutions
            if members[0]["rank"] in known
        ]
        if cells:
            rows[method] = cells[:_COLUMNS]
    if not rows:
        return None
    skill = folder.skill(condition)
    return draw_flown_contacts(stem, skill, surface, rows, com, columns=_COLUMNS)


def _caption(members: list[Record]) -> str:
    quantity, offset = BY_KEY[MAIN], offset_of(members)
    values = values_of(members, MAIN)
    moved = max(moved_of(members[0]), default=0.0)
    parts = [] if offset is None else [f"{100 * offset:.1f} cm off"]
    parts.append(f"{quantity.write(sum(values) / len(values))} cm RMS" if values else "failed")
    return ", ".join(parts) + (f"\nmoved {100 * moved:.0f} cm" if moved else "")


def _lines(numbers: StudyNumbers) -> list[str]:
    flights = sum(s["flights"] for s in numbers.summaries)
    failures = sum(s[outcome] for s in numbers.summaries for outcome in FAILURES)
    lines = [f"flights: {flights}, conditions: {len(numbers.conditions)}, failed: {failures}"]
    for claim in numbers.claims:
        verdicts = ", ".join(f"{subject}: {word}" for subject, word in claim.verdicts.items())
        lines.append(f"{claim.text} [{verdicts}]")
    return [*lines, *numbers.complaints]


def _timing(folder: StudyFolder, records: list[Record]) -> dict[str, float]:
    """Return the total times of flights and of transfers, if any."""
    times: dict[str, list[Mapping[str, Any]]] = {
        "flights": [record.get("timing") or {} for record in records],
        "transfers": [values or {} for values in folder.timing()["transfers"].values()],
    }
    totals = {}
    for part, entries in times.items():
        for key in ("wall_s", "cpu_s") if entries else ():
            numbers = [entry.get(key) for entry in entries]
            totals[f"{part}_{key}"] = sum(float(n) for n in numbers if isinstance(n, (int, float)))
    return totals
