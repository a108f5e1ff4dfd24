"""Claims about contacts: feature-rich areas, places on the bunny, local minima, the top view."""

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from drake_aerial.choices import BASELINES
from drake_aerial.study.analysis.claims import (
    BASELINE,
    FEWEST_SOLUTIONS,
    OURS,
    Claim,
    Finding,
    Outcome,
    paper_conditions,
    verdict,
    verdicts_of_methods,
)
from drake_aerial.study.analysis.comparisons import compare
from drake_aerial.study.analysis.flight_claims import claims_inertia, paired_outcome
from drake_aerial.study.analysis.groups import Group
from drake_aerial.study.analysis.intervals import cluster_bootstrap, named_generator
from drake_aerial.study.analysis.own_likelihood import OwnLikelihood
from drake_aerial.study.records import Record

PLACES = ("head", "middle", "thigh")
TOP_VIEW_MARGIN = 0.01
"""Largest difference that counts as equal: the noise of the measured position [m]."""
_NOT_SHOWN = (Outcome.REVERSED, Outcome.UNDECIDED)


def feature_rich_claim(
    saliency: Mapping[tuple[str, str], Sequence[float]], conditions: Sequence[str]
) -> Claim:
    """Return the claim that the baseline prefers feature-rich areas.

    Parameters
    ----------
    saliency : mapping of (condition, method) to values
        One per solution: the part of the scan that is less salient than the surroundings of the
        contacts; see `saliency.SalientSurface`.
    conditions : sequence of str
        All conditions of the study.
    """
    findings = []
    for condition in paper_conditions(conditions):
        place = (condition, "", BASELINE)
        values = saliency.get((condition, BASELINE), ())
        if len(values) < FEWEST_SOLUTIONS:
            detail = f"{len(values)} solution(s) with a scan"
            findings.append(Finding(*place, Outcome.NOT_TESTED, detail=detail))
            continue
        mean = cluster_bootstrap(
            [[v] for v in values], named_generator("saliency", condition, BASELINE)
        )
        assert mean.low is not None
        assert mean.high is not None
        assert mean.value is not None
        others = [
            f"{method} {100 * np.mean(saliency[condition, method]):.0f} %"
            for method in (*OURS, *BASELINES)
            if saliency.get((condition, method))
        ]
        findings.append(
            Finding(
                *place,
                Outcome.HOLDS
                if mean.low > 0.5
                else Outcome.REVERSED
                if mean.high < 0.5
                else Outcome.UNDECIDED,
                figure=(100 * mean.value, 100 * mean.low, 100 * mean.high),
                unit="%",
                detail=f"other methods: {', '.join(others)}" if others else "",
                digits=0,
            )
        )
    return Claim(
        key="feature_rich",
        text="The baseline is drawn to feature-rich areas (edges).",
        rule="holds in a condition if the interval of the mean over the baseline's solutions lies "
        "above 50 %, reversed if it lies below",
        figure="part of the scan whose surroundings (5 cm) are less salient than those of the "
        "baseline's contacts [%]; 50 % is chance",
        findings=tuple(findings),
        verdicts={BASELINE: verdict(findings)},
        why=tuple(
            f"{f.condition}: the surroundings of the baseline's contacts are more salient than "
            f"{f.figure[0]:.0f} % of the scan; {f.detail}. A random contact would have 50 %."
            for f in findings
            if f.outcome in _NOT_SHOWN
        ),
    )


def places_claim(groups: Mapping[Group, list[Record]]) -> Claim:
    """Return the claim that contacts on the bunny rank as head, middle, thigh (given contacts)."""
    findings = []
    heads = [g for g in groups if g.method == PLACES[0] and g.inertia == claims_inertia(groups)]
    for group in heads:
        for first, second in itertools.pairwise(PLACES):
            comparison = compare(group.other(first), group.other(second), groups, "position_rmse_m")
            few = comparison["pairs"] < 2
            value, low, high = (None if x is None else 100 * x for x in comparison["difference"])
            findings.append(
                Finding(
                    f"{first} < {second}",
                    group.belief,
                    "contact given",
                    Outcome.NOT_TESTED if few else paired_outcome(comparison, fewest=1),
                    figure=(value, low, high),
                    unit="cm",
                    detail=f"{comparison['pairs']} pairs, {comparison['pairs_completed']} "
                    "completed",
                )
            )
    return Claim(
        key="bunny_places",
        text="On the bunny, a contact on the head is better than one on the middle, and that "
        "better than one on the thigh.",
        rule="each of the two steps as for the claims on errors, with one given contact per place: "
        "the interval covers the noise of flights with that contact, not the choice of a place on "
        "the head",
        figure="distance from the path, RMS: one place minus the next [cm]",
        findings=tuple(findings),
        verdicts={"contact given": verdict(findings)},
        why=tuple(
            f"{f.condition} under {f.belief}: {f.text()} ({f.outcome})"
            for f in findings
            if f.outcome in _NOT_SHOWN
        ),
    )


def local_minima_claim(own: Sequence[OwnLikelihood]) -> Claim:
    """Return the claim that with three grippers the baseline is stuck in local minima.

    Parameters
    ----------
    own : sequence of OwnLikelihood
        The baseline's objective at its solutions, and at ours.
    """
    findings = []
    for item in own:
        place = (item.condition, "", item.rival_method)
        if item.rival is None or len(item.own) < FEWEST_SOLUTIONS:
            untested = item.rival is None or not item.own
            detail = item.note if untested else f"{len(item.own)} solution(s) of the baseline"
            findings.append(Finding(*place, Outcome.NOT_TESTED, detail=detail))
            continue
        stuck = sum(value < item.rival for value in item.own)
        findings.append(
            Finding(
                *place,
                Outcome.HOLDS if 2 * stuck > len(item.own) else Outcome.REVERSED,
                figure=(item.rival - max(item.own), None, None),
                unit="(log)",
                detail=f"{stuck} of {len(item.own)} of the baseline's solutions have a lower "
                f"likelihood, under the baseline's objective, than the best of {item.rival_method}",
            )
        )
    return Claim(
        key="local_minima",
        text="With three grippers the baseline is stuck in local minima.",
        rule="a search is stuck if a better solution of its own objective is known: holds in a "
        "condition if more than half of the baseline's solutions have a lower likelihood, under "
        "the baseline's objective, than the best contacts of our method",
        figure="log-likelihood under the baseline's objective: our best contacts minus the "
        "baseline's best (above 0: the baseline missed them)",
        findings=tuple(findings),
        verdicts={BASELINE: verdict(findings)},
        why=tuple(
            f"{f.condition}: {f.detail}. Its contacts are then not a failure of the search: they "
            "are the optimum of local likeness."
            for f in findings
            if f.outcome == Outcome.REVERSED
        ),
    )


def top_view_claim(
    groups: Mapping[Group, list[Record]], views: Mapping[str, tuple[str, str, str]]
) -> Claim:
    """Return the claim that a view of the top face is enough.

    Parameters
    ----------
    groups : mapping of Group to records
        All groups of the study.
    views : mapping
        Condition to (demonstration, payload, view).
    """
    findings = []
    for top in (name for name, (_, _, view) in views.items() if view == "top"):
        full = [name for name, view in views.items() if view == (*views[top][:2], "full")]
        for group in groups:
            if group.condition != top or group.method not in OURS:
                continue
            twins = [Group(name, group.method, group.belief, group.inertia) for name in full]
            if not any(twin in groups for twin in twins) and top in paper_conditions(tuple(views)):
                # On a box of uniform density, no contact is better than the middle of the scan.
                twins = [group.other("centroid")]
            findings += [_top_view_finding(group, twin, groups) for twin in twins if twin in groups]
    return Claim(
        key="top_view",
        text="A view of the top face is enough.",
        rule="holds if flights with contacts found from the top face alone are worse by less than "
        f"{100 * TOP_VIEW_MARGIN:.0f} cm, the noise of the measured position: the upper end of the "
        "interval decides; reversed if the lower end is above that",
        figure="distance from the path, RMS: top view minus full view of the same payload [cm]; "
        "without a full view in the study, minus the contact in the middle of a uniform box "
        "(centroid), the best contact there",
        findings=tuple(findings),
        verdicts=verdicts_of_methods(findings),
        why=tuple(
            f"{f.condition}, {f.subject}: {f.text()}; {f.detail}"
            for f in findings
            if f.outcome in _NOT_SHOWN
        ),
    )


def _top_view_finding(group: Group, twin: Group, groups: Mapping[Group, list[Record]]) -> Finding:
    comparison = compare(group, twin, groups, "position_rmse_m")
    value, low, high = comparison["difference"]
    other = f" {twin.method}" if twin.method != group.method else ""
    place = (f"{group.condition} v {twin.condition}{other}", group.belief, group.method)
    if comparison["ranks"] < FEWEST_SOLUTIONS or high is None:
        detail = f"{comparison['ranks']} paired solution(s) only"
        return Finding(*place, Outcome.NOT_TESTED, detail=detail)
    lost = comparison["pairs"] - comparison["pairs_completed"]
    return Finding(
        *place,
        Outcome.HOLDS
        if high < TOP_VIEW_MARGIN and not lost
        else Outcome.REVERSED
        if low > TOP_VIEW_MARGIN
        else Outcome.UNDECIDED,
        figure=(100 * value, 100 * low, 100 * high),
        unit="cm",
        detail=f"{comparison['pairs']} pairs, {lost} with a failed flight",
    )
