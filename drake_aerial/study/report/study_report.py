"""The report of a study: figures, summary.json and one self-contained page, from the records alone."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from drake_aerial.errors import InputError
from drake_aerial.io.files import write_text
from drake_aerial.study.analysis.flight_claims import claims_inertia
from drake_aerial.study.analysis.quantities import BY_KEY, METHOD_ORDER, position
from drake_aerial.study.analysis.statistics import Record, by_solution, flown, value_of
from drake_aerial.study.analysis.study_files import StudyFiles
from drake_aerial.study.analysis.summary import StudyNumbers, summarize_study
from drake_aerial.study.records import read_records
from drake_aerial.study.report.condition_section import Figures
from drake_aerial.study.report.contacts_gallery import GalleryCell, draw_gallery
from drake_aerial.study.report.figure_files import FIGURES
from drake_aerial.study.report.offset_figure import draw_offsets
from drake_aerial.study.report.panels import draw_panels
from drake_aerial.study.report.report_page import write_page

Progress = Callable[[float, str], None]
PAGE = "report.html"
SUMMARY = "summary.json"
SHOWN = 5


@dataclass(frozen=True)
class ReportSummary:
    """What `write_report` wrote, and what the study took.

    Attributes
    ----------
    page : Path
        report.html.
    lines : tuple of str
        What the study says, in a few lines.
    timing : dict
        Seconds: `flights_wall_s`, `flights_cpu_s`, `transfers_wall_s`, `transfers_cpu_s`; not part of the report.
    """

    page: Path
    lines: tuple[str, ...]
    timing: dict[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        took = [
            f"{name}: {self.timing[f'{name}_wall_s']:.1f} s, {self.timing[f'{name}_cpu_s']:.1f} s of processor time"
            for name in ("transfers", "flights")
            if f"{name}_cpu_s" in self.timing
        ]
        return "\n".join([*self.lines, *took, f"open {self.page}"])


def write_report(folder: str | Path, *, progress: Progress | None = None) -> ReportSummary:
    """Rebuild figures, summary.json and report.html of a study from its records.

    The same records, in any order, give the same bytes: no dates and no timing enter.

    Parameters
    ----------
    folder : str or Path
        The study's, with records.jsonl; study.yaml, contacts, scans, skills and series beside it where they are there.
    progress : callable, optional
        Called with the fraction done and what is being done.

    Raises
    ------
    InputError
        If there is not one record that can be read.

    Examples
    --------
    >>> import tempfile
    >>> from drake_aerial import Condition, StudyPlan, run_study, write_report
    >>> from drake_aerial.references.trajectory import HoverTrajectory
    >>> from drake_aerial.study.plan import Flights
    >>> middle = ("middle", ((0.0, 0.0, 0.14),))
    >>> held = Condition("held", "box_68x68x28", trajectory=HoverTrajectory(hover_time=1.0), contacts=(middle,))
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
            f"{folder} is no folder; give the folder of a study, with its records.jsonl"
        )
    records, complaints = read_records(folder)
    if not records:
        skipped = f" ({len(complaints)} lines in it cannot be read)" if complaints else ""
        raise InputError(
            f"{folder} has no records{skipped}; give the folder of a study, with its records.jsonl"
        )
    tell(0.0, "reading the records")
    files = StudyFiles.open(folder)
    numbers = summarize_study(files, records, complaints)
    figures = _draw(files, numbers, tell)
    tell(0.97, "writing the page")
    write_text(folder / SUMMARY, json.dumps(numbers.to_dict(), indent=1, allow_nan=False) + "\n")
    write_page(folder / PAGE, files, numbers, figures)
    tell(1.0, "done")
    return ReportSummary(folder / PAGE, tuple(_lines(numbers)), _timing(files, records))


def _draw(files: StudyFiles, numbers: StudyNumbers, tell: Progress) -> Figures:
    figures = Figures({}, {}, {})
    out = files.folder / FIGURES
    for index, condition in enumerate(numbers.conditions):
        tell(0.1 + 0.85 * index / len(numbers.conditions), f"drawing condition {condition}")
        own = {
            group: members
            for group, members in numbers.groups.items()
            if group.condition == condition
        }
        name = "".join(c if c.isalnum() or c in "-_" else "_" for c in condition)
        gallery = _gallery(files, numbers, condition, out / f"contacts-{name}")
        if gallery is not None:
            figures.contacts[condition] = gallery
        for belief, inertia in dict.fromkeys((group.belief, group.inertia) for group in own):
            shown = {
                g.method: numbers.timelines[g]
                for g in own
                if (g.belief, g.inertia) == (belief, inertia)
            }
            drawn = draw_panels(out / f"flights-{name}-{belief}-{inertia}", shown)
            if drawn is not None:
                figures.panels[condition, belief, inertia] = drawn
        drawn = draw_offsets(out / f"offset-{name}", own, claims_inertia(numbers.groups))
        if drawn is not None:
            figures.offsets[condition] = drawn
    return figures


def _gallery(files: StudyFiles, numbers: StudyNumbers, condition: str, stem: Path) -> Path | None:
    """Draw the contacts of one condition as flown."""
    surface = numbers.surfaces.get(condition)
    if surface is None:
        return None
    own = [group for group in numbers.groups if group.condition == condition]
    rows, com = {}, None
    for method in sorted({group.method for group in own}, key=lambda m: position(METHOD_ORDER, m)):
        contacts = files.contacts(condition, method)
        known = contacts.solutions if contacts is not None else ()
        group = next(g for g in own if g.method == method)
        cells = []
        for members in by_solution(flown(numbers.groups[group])).values():
            first = members[0]
            solution = next((s for s in known if s.rank == first["rank"]), None)
            com = com or (first.get("contact") or {}).get("com_S")
            if solution is not None:
                cells.append(GalleryCell(solution, _caption(members)))
        if cells:
            rows[method] = cells[:SHOWN]
    if not rows:
        return None
    return draw_gallery(stem, files.skill(condition), surface, rows, com, columns=SHOWN)


def _caption(members: list[Record]) -> str:
    quantity = BY_KEY["position_rmse_m"]
    offset = (members[0].get("contact") or {}).get("off_com_m")
    values = [v for v in (value_of(record, quantity.key) for record in members) if v is not None]
    moved = max([m for m in members[0].get("moved_m") or [] if m] or [0.0])
    off = "" if offset is None else f"{100 * offset:.1f} cm off"
    flew = f"{quantity.write(sum(values) / len(values))} cm RMS" if values else "failed"
    note = f"\nmoved {100 * moved:.0f} cm" if moved > 1e-3 else ""
    return f"{off}, {flew}{note}".lstrip(", ")


def _lines(numbers: StudyNumbers) -> list[str]:
    flights = sum(s["flights"] for s in numbers.summaries)
    failures = sum(s["dropped"] + s["crashed"] + s["diverged"] for s in numbers.summaries)
    lines = [f"flights: {flights}, conditions: {len(numbers.conditions)}, failed: {failures}"]
    for claim in numbers.claims:
        verdicts = ", ".join(f"{subject}: {word}" for subject, word in claim.verdicts.items())
        lines.append(f"{claim.text} [{verdicts}]")
    return [*lines, *numbers.complaints]


def _timing(files: StudyFiles, records: list[Record]) -> dict[str, float]:
    timing: dict[str, float] = {}

    def add(name: str, values: Any) -> None:
        number = values if isinstance(values, (int, float)) else 0.0
        timing[name] = timing.get(name, 0.0) + float(number)

    for record in records:
        for name in ("wall_s", "cpu_s"):
            add(f"flights_{name}", (record.get("timing") or {}).get(name))
    for values in (files.timing().get("transfers") or {}).values():
        for name in ("wall_s", "cpu_s"):
            add(f"transfers_{name}", (values or {}).get(name))
    return timing
