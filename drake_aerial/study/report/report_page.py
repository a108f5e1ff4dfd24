"""The page of a study's report: readable without the paper, on a screen of any width."""

from __future__ import annotations

import html
from pathlib import Path

from drake_aerial.study.analysis.claims import OURS, paper_conditions
from drake_aerial.study.analysis.flight_claims import claims_inertia
from drake_aerial.study.analysis.quantities import FAILURES, MAIN
from drake_aerial.study.analysis.statistics import FORMULAS
from drake_aerial.study.analysis.study_files import StudyFiles
from drake_aerial.study.analysis.summary import StudyNumbers
from drake_aerial.study.report.claims_section import claims_parts
from drake_aerial.study.report.comparison_tables import comparisons
from drake_aerial.study.report.condition_section import Figures, condition_section
from drake_aerial.study.report.overview_tables import glance, tested
from drake_aerial.study.report.page_tables import STYLE, method_name
from drake_aerial.visualization.report import Section, write_report


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
        Section("What was tested", tested(files, numbers)),
        Section("At a glance: how far the payload strays from its path", glance(files, numbers)),
        Section("What the paper claims, and what was found", claims_parts(numbers.claims)),
        *[condition_section(files, numbers, figures, name) for name in numbers.conditions],
        Section("One method against another", comparisons(numbers)),
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
        (s["condition"], s["method"]): s["quantities"][MAIN]["mean"]
        for s in numbers.summaries
        if s["inertia"] == claims_inertia(numbers.groups) and s["belief"] == numbers.beliefs[0]
    }
    both = [c for c in wanted if all(cells.get((c, m)) is not None for m in ("task", "kopicki"))]
    if not both:
        return ""
    text = "; ".join(
        f"{c}: {100 * cells[c, 'task']:.1f} cm against the baseline's {100 * cells[c, 'kopicki']:.1f}"
        for c in both
    )
    return f"Mean distance from the path ({html.escape(numbers.beliefs[0])}), this package's method: {text}."


def _formulas(files: StudyFiles, numbers: StudyNumbers) -> list[str]:
    rows = "".join(
        f"<li><b>{html.escape(name)}</b>: {html.escape(text)}.</li>"
        for name, text in FORMULAS.items()
    )
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
