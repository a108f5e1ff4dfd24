"""Claims about flights: a method's errors, spread and effort against the baseline's."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from drake_aerial.study.analysis.claims import (
    BASELINE,
    FEWEST_SOLUTIONS,
    OURS,
    Claim,
    Finding,
    Outcome,
    outcome_of,
    paper_conditions,
    verdicts_of_methods,
)
from drake_aerial.study.analysis.comparisons import compare
from drake_aerial.study.analysis.groups import Group, by_solution, flown, offset_of, values_of
from drake_aerial.study.analysis.intervals import named_generator, percentile_limits
from drake_aerial.study.analysis.quantities import BY_KEY
from drake_aerial.study.analysis.statistics import spread
from drake_aerial.study.analysis.timeline import Timeline
from drake_aerial.study.records import Record

# Key, statement of the paper, quantity of the records or series of the timelines.
_CLAIMS = (
    ("position", "The payload's position error is lower than the baseline's.", "position_rmse_m"),
    ("velocity", "The payload's velocity error is lower.", "velocity_rmse_m_s"),
    ("position_spread", "The standard deviation of the position is lower.", "position_error"),
    ("attitude_spread", "The standard deviation of the orientation is lower.", "attitude_error"),
    ("attitude", "The attitude error is lower in all conditions.", "attitude_rmse_rad"),
    ("thrust", "Thrust is lower.", "thrust_mean_N"),
    ("moments", "Moments are lower.", "moment_rms_N_m"),
)
_PAIRED_RULE = (
    "holds in a condition if the interval of the paired difference lies below zero and the "
    "interval of the share of pairs won, in which a failed flight loses, lies above one half (if "
    "too few pairs completed, the share decides alone); reversed if both lie on the other side; "
    f"undecided otherwise. Not tested with fewer than {FEWEST_SOLUTIONS} paired solutions"
)
_SPREAD_RULE = (
    "holds in a condition if the interval of the ratio of spreads lies below one; reversed if it "
    "lies above one; undecided otherwise. Not tested if either method has fewer than "
    f"{FEWEST_SOLUTIONS} solutions with completed flights. Failed flights are left out"
)


def flight_claims(
    groups: Mapping[Group, list[Record]],
    conditions: Sequence[str],
    timelines: Mapping[Group, Timeline],
) -> list[Claim]:
    """Return the claims on errors, spread and effort, of each of our methods against the baseline.

    Parameters
    ----------
    groups : mapping of Group to records
        See `groups.groups_of`.
    conditions : sequence of str
        All conditions of the study, in order.
    timelines : mapping of Group to Timeline
        For the spreads; groups without series are not tested.
    """
    inertia, counted = claims_inertia(groups), paper_conditions(conditions)
    baselines = [g for g in groups if g.method == BASELINE and g.inertia == inertia]
    baselines.sort(key=lambda group: group.condition not in counted)
    tests = [
        (baseline.other(method), baseline, baseline.condition in counted)
        for method in OURS
        for baseline in baselines
        if baseline.other(method) in groups
    ]
    claims = []
    for key, text, name in _CLAIMS:
        if name in BY_KEY:
            findings = [_mean_finding(*test, groups, name) for test in tests]
            rule, figure = _PAIRED_RULE, _mean_figure(name)
            why = _why(findings, groups, name)
        else:
            findings = [_spread_finding(*test, timelines, name) for test in tests]
            rule = _SPREAD_RULE
            figure = f"spread of the {name.replace('_', ' ')} over time: ours over the baseline's"
            why = ()
        verdicts = verdicts_of_methods(findings)
        claims.append(Claim(key, text, rule, figure, tuple(findings), verdicts, why))
    return claims


def claims_inertia(groups: Mapping[Group, Any]) -> str:
    """Return the inertia on which claims are tested: the paper's table, or what the study has."""
    found = {group.inertia for group in groups}
    return "table" if "table" in found or not found else min(found)


def paired_outcome(comparison: Mapping[str, Any], fewest: int = FEWEST_SOLUTIONS) -> Outcome:
    """Return the outcome of the claim "the first is smaller" from a comparison."""
    if comparison["ranks"] < fewest:
        return Outcome.NOT_TESTED
    _, low, high = comparison["wins"]
    # A share of wins above one half is a share of losses below one half.
    won = Outcome.NOT_TESTED if low is None else outcome_of(1.0 - high, 1.0 - low, 0.5)
    _, low, high = comparison["difference"]
    if low is None:
        return won
    mean = outcome_of(low, high, 0.0)
    decided = mean == won and mean in (Outcome.HOLDS, Outcome.REVERSED)
    return mean if decided else Outcome.UNDECIDED


def _mean_figure(key: str) -> str:
    quantity = BY_KEY[key]
    figure = (
        f"{quantity.name}: ours minus the baseline's, mean over pairs of flights [{quantity.unit}]"
    )
    if key == "attitude_rmse_rad":
        figure += (
            "; it includes the heading, which a single cable does not control; the tilt in the "
            "tables does not"
        )
    return figure


def _mean_finding(
    group: Group,
    baseline: Group,
    counted: bool,
    groups: Mapping[Group, list[Record]],
    key: str,
) -> Finding:
    comparison = compare(group, baseline, groups, key)
    quantity = BY_KEY[key]
    outcome = paired_outcome(comparison)
    place = (group.condition, group.belief, group.method, outcome)
    if outcome == Outcome.NOT_TESTED:
        detail = f"{comparison['ranks']} paired solution(s) only"
        return Finding(*place, detail=detail, counted=counted)
    value, low, high = (
        None if x is None else quantity.factor * x for x in comparison["difference"]
    )
    wins = [100 * x for x in comparison["wins"]]
    ratio = comparison["ratio"][0]
    times = "" if ratio is None else f"{ratio:.3g} times the baseline's; "
    return Finding(
        *place,
        figure=(value, low, high),
        unit=quantity.unit,
        detail=f"{times}wins {wins[0]:.0f} % of {comparison['pairs']} pairs "
        f"[{wins[1]:.0f}, {wins[2]:.0f}]; {comparison['pairs_completed']} pairs completed",
        digits=max(quantity.digits, 2),
        counted=counted,
    )


def _spread_finding(
    group: Group,
    baseline: Group,
    counted: bool,
    timelines: Mapping[Group, Timeline],
    name: str,
) -> Finding:
    place = (group.condition, group.belief, group.method)
    clusters = [timelines[a].clusters(name) if a in timelines else [] for a in (group, baseline)]
    counts = [len(side) for side in clusters]
    if min(counts) < FEWEST_SOLUTIONS:
        detail = f"completed flights with series of {counts[0]} and {counts[1]} solution(s)"
        return Finding(*place, Outcome.NOT_TESTED, detail=detail, counted=counted)
    # The time grids of two methods may differ by a step at the end.
    length = min(cluster.shape[1] for side in clusters for cluster in side)
    (ours, our_samples), (theirs, their_samples) = [
        spread([cluster[:, :length] for cluster in side], named_generator("spread", str(a), name))
        for side, a in zip(clusters, (group, baseline))
    ]
    if not ours or not theirs:
        return Finding(*place, Outcome.NOT_TESTED, detail="a spread is zero", counted=counted)
    low, high = percentile_limits(our_samples / np.maximum(their_samples, 1e-300), min(counts))
    outcome, figure = outcome_of(low, high, 1.0), (ours / theirs, low, high)
    return Finding(*place, outcome, figure=figure, unit="×", counted=counted)


def _why(
    findings: Sequence[Finding], groups: Mapping[Group, list[Record]], key: str
) -> tuple[str, ...]:
    """Return, for each finding that does not hold, the contacts' offsets and their correlation."""
    reasons = []
    inertia = claims_inertia(groups)
    for finding in findings:
        if finding.outcome not in (Outcome.REVERSED, Outcome.UNDECIDED) or not finding.counted:
            continue
        condition, belief = finding.condition, finding.belief
        ours = Group(condition, finding.subject, belief, inertia)
        sides = [f"{g.method} {_offsets(groups[g])}" for g in (ours, ours.other(BASELINE))]
        everyone = [
            record
            for group, records in groups.items()
            if (group.condition, group.belief, group.inertia) == (condition, belief, inertia)
            for record in flown(records)
        ]
        rank = offset_correlation(everyone, key)
        correlation = (
            ""
            if rank is None
            else f"; rank correlation of error and distance over all solutions: {rank:.2f}"
        )
        reasons.append(
            f"{condition}, {belief}, {finding.subject} ({finding.outcome}): horizontal distance of "
            "the contacts from the centre of mass, median and range: "
            f"{', '.join(sides)}{correlation}."
        )
    return tuple(reasons)


def _offsets(records: Sequence[Record]) -> str:
    offsets = [
        100 * offset
        for members in by_solution(records).values()
        if (offset := offset_of(members)) is not None
    ]
    if not offsets:
        return "unknown"
    return f"{np.median(offsets):.1f} cm ({min(offsets):.1f}–{max(offsets):.1f})"


def offset_correlation(records: Sequence[Record], key: str) -> float | None:
    """Return Spearman's rank correlation, over solutions, of a quantity with the contact's offset.

    The quantity is the mean over the flights of a solution, the offset the horizontal distance of
    the contact from the centre of mass.
    """
    from scipy.stats import spearmanr

    solutions: dict[tuple[str, int], list[Record]] = {}
    for record in records:
        solutions.setdefault((record["method"], record["solution"]), []).append(record)
    points = np.array(
        [
            (offset, np.mean(values))
            for members in solutions.values()
            if (offset := offset_of(members)) is not None and (values := values_of(members, key))
        ]
    )
    if len(points) < 4 or np.ptp(points[:, 0]) == 0 or np.ptp(points[:, 1]) == 0:
        return None
    return float(spearmanr(points[:, 0], points[:, 1]).statistic)
