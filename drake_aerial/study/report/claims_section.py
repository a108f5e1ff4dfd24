"""The claims on a study's page: a verdict each, and what it rests on."""

from __future__ import annotations

import html
from collections.abc import Sequence

from drake_aerial.study.analysis.claims import OURS, Claim
from drake_aerial.study.report.page_tables import badge, method_name, table


def claims_parts(claims: Sequence[Claim]) -> list[str]:
    """Return the table of verdicts and, folded below it, what each rests on; as HTML."""
    subjects = [method for method in OURS if any(method in claim.verdicts for claim in claims)]
    rows = []
    for index, claim in enumerate(claims, 1):
        cells = [badge(claim.verdicts[s]) if s in claim.verdicts else "" for s in subjects]
        others = [word for s, word in claim.verdicts.items() if s not in subjects]
        if others:
            subject = next(s for s in claim.verdicts if s not in subjects)
            cells = [f"{method_name(subject)}<br>{badge(others[0])}"] + [""] * (len(subjects) - 1)
        rows.append([_link(index), html.escape(claim.text), *cells])
    parts = [
        "Every verdict is computed from the records by a rule that stands with the claim below. <i>Undecided</i> means that the interval "
        "allows both. Where the study has the paper's conditions (A to D), verdicts rest on them alone; others are shown and not counted. A claim that is about contacts, or about the baseline, has one verdict.",
        table(["", "the paper's claim", *map(method_name, subjects)], rows, left=2 + len(subjects)),
    ]
    parts += [_claim_details(index, claim) for index, claim in enumerate(claims, 1)]
    return parts


def _link(index: int) -> str:
    # A browser goes to a folded claim, but leaves it folded.
    return f'<a href="#claim-{index}" onclick="document.getElementById(this.hash.slice(1)).open = true">{index}</a>'


def _claim_details(index: int, claim: Claim) -> str:
    rows = [
        [
            html.escape(f.condition)
            + ("" if f.counted else ' <span class="muted">(not counted)</span>'),
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
        f'<details id="claim-{index}"><summary>{index}. {html.escape(claim.text)} {verdicts}</summary>'
        f"<p>Figure: {html.escape(claim.figure)}. Rule: {html.escape(claim.rule)}.</p>{body}{why}</details>"
    )
