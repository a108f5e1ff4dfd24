"""Claims about flights: one method's errors, spread and effort against the baseline's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
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
    outcome_of,
    paper_conditions,
    verdict,
)
from drake_aerial.study.analysis.intervals import percentile_limits
from drake_aerial.study.analysis.quantities import BY_KEY
from drake_aerial.study.analysis.statistics import (
    Group,
    Record,
    by_solution,
    compare,
    flown,
    spread,
    stream,
    value_of,
)
from drake_aerial.study.analysis.timeline import Timeline

# Key, what the paper says, quantity.
MEANS = (
    ("position", "The payload's position error is lower than the baseline's.", "position_rmse_m"),
    ("velocity", "The payload's velocity error is lower.", "velocity_rmse_m_s"),
    ("attitude", "The attitude error is lower in all conditions.", "attitude_rmse_rad"),
    ("thrust", "Thrust is lower.", "thrust_mean_N"),
    ("moments", "Moments are lower.", "moment_rms_N_m"),
)
SPREADS = (
    ("position_spread", "The standard deviation of the position is lower.", "position_error"),
    ("attitude_spread", "The standard deviation of the orientation is lower.", "attitude_error"),
)
_PAIRED_RULE = (
    "better in a condition if the interval of the paired difference lies below zero and the interval of the share of pairs won, with "
    "a failed flight as the worst, lies above one half (if too few pairs completed, the share alone decides); reversed if both lie on "
    f"the other side; undecided otherwise. Not tested with fewer than {FEWEST_SOLUTIONS} paired solutions"
)
_SPREAD_RULE = (
    "better in a condition if the interval of the ratio of spreads lies below one; reversed if above; not tested where either has fewer than "
    f"{FEWEST_SOLUTIONS} solutions with completed flights. Failed flights have no spread and do not enter"
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
        See `statistics.groups_of`.
    conditions : sequence of str
        All of the study, in order.
    timelines : mapping of Group to Timeline
        For the spreads; groups without series are not tested.
    """
    tested = [
        group
        for group in groups
        if group.method == BASELINE and group.inertia == claims_inertia(groups)
    ]
    counted = paper_conditions(conditions)
    tested.sort(key=lambda group: group.condition not in counted)
    claims = []
    for key, text, quantity in MEANS:
        findings = [
            _mean_finding(baseline.other(method), baseline, groups, quantity)
            for method in OURS
            for baseline in tested
            if baseline.other(method) in groups
        ]
        findings = [replace(f, counted=f.condition in counted) for f in findings]
        unit = BY_KEY[quantity].unit
        figure = f"{BY_KEY[quantity].name}: ours minus the baseline's, mean over pairs of flights [{unit}]"
        if key == "attitude":
            figure += "; it holds the heading, which a single cable does not control: the tilt, in the tables, is without"
        claims.append(
            _claim(key, text, _PAIRED_RULE, figure, findings, _why(findings, groups, quantity))
        )
    for key, text, name in SPREADS:
        findings = [
            _spread_finding(baseline.other(method), baseline, timelines, name)
            for method in OURS
            for baseline in tested
            if baseline.other(method) in groups
        ]
        findings = [replace(f, counted=f.condition in counted) for f in findings]
        figure = f"spread of the {name.replace('_', ' ')} over time: ours over the baseline's"
        claims.append(_claim(key, text, _SPREAD_RULE, figure, findings, ()))
    order = [
        "position",
        "velocity",
        "position_spread",
        "attitude_spread",
        "attitude",
        "thrust",
        "moments",
    ]
    return sorted(claims, key=lambda claim: order.index(claim.key))


def claims_inertia(groups: Mapping[Group, Any]) -> str:
    """Return the inertia on which the claims are tested: the paper's table, or what the study has."""
    found = {group.inertia for group in groups}
    return "table" if "table" in found or not found else min(found)


def paired_outcome(comparison: Mapping[str, Any], fewest: int = FEWEST_SOLUTIONS) -> str:
    """Return what a comparison says about "the first is smaller", by the stated rule."""
    if comparison["ranks"] < fewest:
        return NOT_TESTED
    _, low, high = comparison["wins"]
    # Winning more than half is a loss rate below one half.
    won = NOT_TESTED if low is None else outcome_of(1.0 - high, 1.0 - low, 0.5)
    _, low, high = comparison["difference"]
    if low is None:
        return won
    mean = outcome_of(low, high, 0.0)
    return mean if mean == won and mean in (BETTER, WORSE) else UNDECIDED


def _mean_finding(
    group: Group, baseline: Group, groups: Mapping[Group, list[Record]], key: str
) -> Finding:
    comparison = compare(group, baseline, dict(groups), key)
    quantity = BY_KEY[key]
    outcome = paired_outcome(comparison)
    if outcome == NOT_TESTED:
        return Finding(
            group.condition,
            group.belief,
            group.method,
            outcome,
            detail=f"{comparison['ranks']} paired solution(s) only",
        )
    scaled = [None if x is None else quantity.factor * x for x in comparison["difference"]]
    wins = comparison["wins"]
    return Finding(
        group.condition,
        group.belief,
        group.method,
        outcome,
        figure=(scaled[0], scaled[1], scaled[2]),
        unit=quantity.unit,
        detail=f"{_ratio_text(comparison)}wins {100 * wins[0]:.0f} % of {comparison['pairs']} pairs [{100 * wins[1]:.0f}, {100 * wins[2]:.0f}]; "
        f"{comparison['pairs_completed']} pairs completed",
        digits=max(quantity.digits, 2),
    )


def _ratio_text(comparison: Mapping[str, Any]) -> str:
    ratio = comparison["ratio"][0]
    return "" if ratio is None else f"{ratio:.3g} times the baseline's; "


def _spread_finding(
    group: Group, baseline: Group, timelines: Mapping[Group, Timeline], name: str
) -> Finding:
    clusters = [timelines[a].clusters(name) if a in timelines else [] for a in (group, baseline)]
    if min(map(len, clusters)) < FEWEST_SOLUTIONS:
        detail = f"completed flights with series of {len(clusters[0])} and {len(clusters[1])} solution(s)"
        return Finding(group.condition, group.belief, group.method, NOT_TESTED, detail=detail)
    # The two methods' grids end alike but for a step.
    length = min(cluster.shape[1] for side in clusters for cluster in side)
    (ours, our_samples), (theirs, their_samples) = [
        spread([cluster[:, :length] for cluster in side], stream("spread", str(a), name))
        for side, a in zip(clusters, (group, baseline))
    ]
    if not ours or not theirs:
        return Finding(
            group.condition, group.belief, group.method, NOT_TESTED, detail="a spread is zero"
        )
    low, high = percentile_limits(
        our_samples / np.maximum(their_samples, 1e-300), min(map(len, clusters))
    )
    return Finding(
        group.condition,
        group.belief,
        group.method,
        outcome_of(low, high, 1.0),
        figure=(ours / theirs, low, high),
        unit="×",
        detail="",
    )


def _claim(
    key: str, text: str, rule: str, figure: str, findings: Sequence[Finding], why: Sequence[str]
) -> Claim:
    verdicts = {method: verdict([f for f in findings if f.subject == method]) for method in OURS}
    verdicts = {
        method: word
        for method, word in verdicts.items()
        if any(f.subject == method for f in findings)
    }
    return Claim(
        key, text, rule, figure, tuple(findings), verdicts or {OURS[0]: NOT_TESTED}, tuple(why)
    )


def _why(findings: Sequence[Finding], groups: Mapping[Group, list[Record]], key: str) -> list[str]:
    """Say, where a finding does not hold, how far the contacts lie from below the centre of mass and whether that explains the quantity."""
    reasons = []
    for finding in findings:
        if finding.outcome not in (WORSE, UNDECIDED) or not finding.counted:
            continue
        inertia = claims_inertia(groups)
        ours = Group(finding.condition, finding.subject, finding.belief, inertia)
        sides = [
            f"{group.method} {_offsets(groups[group])}" for group in (ours, ours.other(BASELINE))
        ]
        everyone = [
            record
            for group, records in groups.items()
            if (group.condition, group.belief, group.inertia)
            == (finding.condition, finding.belief, inertia)
            for record in flown(records)
        ]
        rank = offset_correlation(everyone, key)
        explains = (
            ""
            if rank is None
            else f"; rank correlation of the figure with that distance over all solutions: {rank:.2f}"
        )
        where = ", ".join(
            part for part in (finding.condition, finding.belief, finding.subject) if part
        )
        reasons.append(
            f"{where} ({finding.outcome}): contacts off the centre of mass's vertical, median and range: {', '.join(sides)}{explains}."
        )
    return reasons


def _offsets(records: Sequence[Record]) -> str:
    offsets = [
        m[0]["contact"]["off_com_m"]
        for m in by_solution(flown(records)).values()
        if m[0].get("contact")
    ]
    if not offsets:
        return "unknown"
    return f"{100 * np.median(offsets):.1f} cm ({100 * min(offsets):.1f}–{100 * max(offsets):.1f})"


def offset_correlation(records: Sequence[Record], key: str) -> float | None:
    """Return Spearman's rank correlation, over solutions, of a quantity's mean with the contact's offset from the centre of mass."""
    from scipy.stats import spearmanr

    solutions: dict[tuple[str, int], list[tuple[float, float]]] = {}
    for record in records:
        value = value_of(record, key)
        if value is not None and (record.get("contact") or {}).get("off_com_m") is not None:
            solutions.setdefault((record["method"], record["solution"]), []).append(
                (record["contact"]["off_com_m"], value)
            )
    points = np.array([np.mean(members, axis=0) for members in solutions.values()])
    if len(points) < 4 or np.ptp(points[:, 0]) == 0 or np.ptp(points[:, 1]) == 0:
        return None
    return float(spearmanr(points[:, 0], points[:, 1]).statistic)
