"""Claims about where contacts lie: feature-rich areas, places on the bunny, local minima, and what a top view is worth."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from drake_aerial.study.analysis.claims import (
    BASELINE,
    BETTER,
    FEWEST_SOLUTIONS,
    NOT_TESTED,
    OURS,
    UNDECIDED,
    WORSE,
    Claim,
    Finding,
    paper_conditions,
    verdict,
)
from drake_aerial.study.analysis.flight_claims import claims_inertia, paired_outcome
from drake_aerial.study.analysis.intervals import cluster_bootstrap
from drake_aerial.study.analysis.own_likelihood import OwnLikelihood
from drake_aerial.study.analysis.statistics import Group, Record, compare, stream

PLACES = ("head", "middle", "thigh")
TOP_VIEW_MARGIN = 0.01
"""How much worse flights may be and still count as alike: the noise of the measured position [m]."""


def feature_rich_claim(
    saliency: Mapping[tuple[str, str], Sequence[float]], conditions: Sequence[str]
) -> Claim:
    """Return the claim that the baseline is drawn to feature-rich areas.

    Parameters
    ----------
    saliency : mapping of (condition, method) to values
        One a solution: the part of the scan that is less salient than the contacts' surroundings (see `saliency`).
    conditions : sequence of str
        All of the study.
    """
    findings = []
    for condition in paper_conditions(conditions):
        values = saliency.get((condition, BASELINE), ())
        if len(values) < FEWEST_SOLUTIONS:
            detail = f"{len(values)} solution(s) with a scan"
            findings.append(Finding(condition, "", BASELINE, NOT_TESTED, detail=detail))
            continue
        drawn = cluster_bootstrap([[v] for v in values], stream("saliency", condition, BASELINE))
        assert drawn.low is not None
        assert drawn.high is not None
        assert drawn.value is not None
        outcome = BETTER if drawn.low > 0.5 else WORSE if drawn.high < 0.5 else UNDECIDED
        others = [
            f"{method} {100 * np.mean(saliency[condition, method]):.0f} %"
            for method in (*OURS, "centroid")
            if saliency.get((condition, method))
        ]
        findings.append(
            Finding(
                condition,
                "",
                BASELINE,
                outcome,
                figure=(100 * drawn.value, 100 * drawn.low, 100 * drawn.high),
                unit="%",
                detail=f"other methods: {', '.join(others)}" if others else "",
                digits=0,
            )
        )
    why = [
        f"{f.condition}: the surroundings of the baseline's contacts are more salient than {f.figure[0]:.0f} % of the scan; {f.detail}. "
        "A contact drawn blindly would have 50 %."
        for f in findings
        if f.outcome in (WORSE, UNDECIDED)
    ]
    return Claim(
        "feature_rich",
        "The baseline is drawn to feature-rich areas (edges).",
        "holds in a condition if the interval of the mean over the baseline's solutions lies above 50 %, reversed if below",
        "part of the scan whose surroundings (5 cm) are less salient than those of the baseline's contacts [%]; 50 is chance",
        tuple(findings),
        {BASELINE: verdict(findings)},
        tuple(why),
    )


def places_claim(groups: Mapping[Group, list[Record]]) -> Claim:
    """Return the claim that the bunny's head is better than its middle, and that better than its thigh (contacts given)."""
    findings = []
    heads = [
        group
        for group in groups
        if group.method == PLACES[0] and group.inertia == claims_inertia(groups)
    ]
    for group in heads:
        for first, second in itertools.pairwise(PLACES):
            comparison = compare(
                group.other(first), group.other(second), dict(groups), "position_rmse_m"
            )
            outcome = (
                paired_outcome(comparison, fewest=1) if comparison["pairs"] > 1 else NOT_TESTED
            )
            difference = [None if x is None else 100 * x for x in comparison["difference"]]
            findings.append(
                Finding(
                    f"{first} < {second}",
                    group.belief,
                    "contact given",
                    outcome,
                    figure=(difference[0], difference[1], difference[2]),
                    unit="cm",
                    detail=f"{comparison['pairs']} pairs, {comparison['pairs_completed']} completed",
                )
            )
    return Claim(
        "bunny_places",
        "On the bunny, a contact on the head is better than one on the middle, and that better than one on the thigh.",
        "each of the two steps like the claims on errors, with one given contact a place: the interval covers the noise of flights "
        "with that contact, not the choice of a place on the head",
        "distance from the path, RMS: one place minus the next [cm]",
        tuple(findings),
        {"contact given": verdict(findings)},
        tuple(
            f"{f.condition} under {f.belief}: {f.text()} ({f.outcome})"
            for f in findings
            if f.outcome in (WORSE, UNDECIDED)
        ),
    )


def local_minima_claim(own: Sequence[OwnLikelihood]) -> Claim:
    """Return the claim that with three grippers the baseline's search is stuck in local minima.

    Parameters
    ----------
    own : sequence of OwnLikelihood
        How likely the baseline's own objective finds its solutions, and ours.
    """
    findings = []
    for item in own:
        if item.rival is None or not item.own:
            findings.append(
                Finding(item.condition, "", item.rival_method, NOT_TESTED, detail=item.note)
            )
            continue
        if len(item.own) < FEWEST_SOLUTIONS:
            detail = f"{len(item.own)} solution(s) of the baseline"
            findings.append(
                Finding(item.condition, "", item.rival_method, NOT_TESTED, detail=detail)
            )
            continue
        stuck = sum(value < item.rival for value in item.own)
        findings.append(
            Finding(
                item.condition,
                "",
                item.rival_method,
                BETTER if 2 * stuck > len(item.own) else WORSE,
                figure=(item.rival - max(item.own), None, None),
                unit="(log)",
                detail=f"{stuck} of {len(item.own)} of the baseline's solutions are less likely, by its own measure, than {item.rival_method}'s best",
            )
        )
    why = [
        f"{f.condition}: {f.detail}. What it found is then no failure of its search; it is what local likeness prefers."
        for f in findings
        if f.outcome == WORSE
    ]
    return Claim(
        "local_minima",
        "With three grippers the baseline is stuck in local minima.",
        "a search is stuck where a better place by its own measure is known: holds in a condition if more than half of the baseline's "
        "solutions are less likely under the baseline's own likelihood than the best contacts of our method are under that same likelihood",
        "log-likelihood under the baseline's measure: our best contacts minus the baseline's best (above 0: the baseline missed them)",
        tuple(findings),
        {"kopicki": verdict(findings)},
        tuple(why),
    )


def top_view_claim(
    groups: Mapping[Group, list[Record]], views: Mapping[str, tuple[str, str, str]]
) -> Claim:
    """Return the claim that a view of the top face is enough.

    Parameters
    ----------
    groups : mapping of Group to records
        Of the study.
    views : mapping
        Condition to (demonstration, payload, view).
    """
    findings = []
    for top in (name for name, (_, _, view) in views.items() if view == "top"):
        full = [name for name, seen in views.items() if seen == (*views[top][:2], "full")]
        for group in groups:
            if group.condition != top or group.method not in OURS:
                continue
            twins = [Group(name, group.method, group.belief, group.inertia) for name in full]
            if not any(twin in groups for twin in twins) and top in paper_conditions(tuple(views)):
                # The contact over the middle of what is seen, which for a box of uniform density is the best there is.
                twins = [group.other("centroid")]
            findings += [_top_view_finding(group, twin, groups) for twin in twins if twin in groups]
    return Claim(
        "top_view",
        "A view of the top face is enough.",
        f"holds if flights with contacts found from the top face alone are worse by less than {100 * TOP_VIEW_MARGIN:.0f} cm, the noise of the "
        "position measurement: the interval's upper end is the judge; reversed if the lower end is above that",
        "distance from the path, RMS: top view minus full view of the same payload [cm]; where the study has no full view of it, minus the "
        "contact over the middle of a uniform box (centroid), the best there is",
        tuple(findings),
        {
            method: verdict([f for f in findings if f.subject == method])
            for method in OURS
            if any(f.subject == method for f in findings)
        }
        or {OURS[0]: NOT_TESTED},
        tuple(
            f"{f.condition}, {f.subject}: {f.text()}; {f.detail}"
            for f in findings
            if f.outcome in (WORSE, UNDECIDED)
        ),
    )


def _top_view_finding(group: Group, twin: Group, groups: Mapping[Group, list[Record]]) -> Finding:
    comparison: dict[str, Any] = compare(group, twin, dict(groups), "position_rmse_m")
    value, low, high = comparison["difference"]
    name = f"{group.condition} v {twin.condition}" + (
        f" {twin.method}" if twin.method != group.method else ""
    )
    if comparison["ranks"] < FEWEST_SOLUTIONS or high is None:
        return Finding(
            name,
            group.belief,
            group.method,
            NOT_TESTED,
            detail=f"{comparison['ranks']} paired solution(s) only",
        )
    lost = comparison["pairs"] - comparison["pairs_completed"]
    outcome = (
        BETTER
        if high < TOP_VIEW_MARGIN and not lost
        else WORSE
        if low > TOP_VIEW_MARGIN
        else UNDECIDED
    )
    return Finding(
        name,
        group.belief,
        group.method,
        outcome,
        figure=(100 * value, 100 * low, 100 * high),
        unit="cm",
        detail=f"{comparison['pairs']} pairs, {lost} with a failed flight",
    )
