"""All numbers of a study, computed from its folder: what summary.json holds and what the report shows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.study.analysis.claims import BASELINE, OURS, Claim, paper_conditions
from drake_aerial.study.analysis.contact_claims import (
    feature_rich_claim,
    local_minima_claim,
    places_claim,
    top_view_claim,
)
from drake_aerial.study.analysis.flight_claims import flight_claims
from drake_aerial.study.analysis.own_likelihood import OwnLikelihood, own_likelihood
from drake_aerial.study.analysis.quantities import BELIEF_ORDER, METHOD_ORDER, position
from drake_aerial.study.analysis.saliency import SalientSurface
from drake_aerial.study.analysis.statistics import (
    FORMULAS,
    SEED,
    Group,
    Record,
    by_solution,
    compare,
    flown,
    groups_of,
    summarize,
)
from drake_aerial.study.analysis.study_files import StudyFiles
from drake_aerial.study.analysis.timeline import Timeline, read_timeline

SCHEMA = "drake_aerial/study_summary"
VERSION = 1
COMPARED = (("task", "kopicki"), ("paper", "kopicki"), ("task", "paper"), ("task", "centroid"))
COMPARED_QUANTITIES = (
    "position_rmse_m",
    "velocity_rmse_m_s",
    "attitude_rmse_rad",
    "tilt_mean_rad",
    "thrust_mean_N",
    "moment_rms_N_m",
)


@dataclass(frozen=True, eq=False)
class StudyNumbers:
    """What a study's folder says.

    Attributes
    ----------
    groups : dict of Group to records
        In the report's order.
    conditions : tuple of str
        Those with records, in the plan's order.
    timelines : dict of Group to Timeline
        Flights over time.
    surfaces : dict of str to SalientSurface
        Scans by condition, where they could be read.
    saliency : dict
        (condition, method) to one value a solution.
    summaries, comparisons : list of dict
        See `statistics.summarize` and `statistics.compare`.
    claims : list of Claim
        The paper's.
    complaints : tuple of str
        What could not be read.
    """

    groups: dict[Group, list[Record]]
    conditions: tuple[str, ...]
    timelines: dict[Group, Timeline]
    surfaces: dict[str, SalientSurface]
    saliency: dict[tuple[str, str], list[float]]
    summaries: list[dict[str, Any]]
    comparisons: list[dict[str, Any]]
    claims: list[Claim]
    complaints: tuple[str, ...]

    @property
    def beliefs(self) -> list[str]:
        """All that were flown, in the report's order."""
        return sorted(
            {group.belief for group in self.groups},
            key=lambda belief: position(BELIEF_ORDER, belief),
        )

    def methods(self, conditions: Iterable[str] | None = None) -> list[str]:
        """Return the methods with records in some conditions, or in any, in the report's order."""
        wanted = set(self.conditions if conditions is None else conditions)
        found = {group.method for group in self.groups if group.condition in wanted}
        return sorted(found, key=lambda method: position(METHOD_ORDER, method))

    def to_dict(self) -> dict[str, Any]:
        """Return the content of summary.json: SI units, no dates, no timing."""
        return {
            "schema": SCHEMA,
            "version": VERSION,
            "bootstrap_seed": SEED,
            "formulas": FORMULAS,
            "conditions": list(self.conditions),
            "groups": self.summaries,
            "comparisons": self.comparisons,
            "saliency_percentile": [
                {"condition": c, "method": m, "solutions": values}
                for (c, m), values in self.saliency.items()
            ],
            "claims": [claim.to_dict() for claim in self.claims],
            "complaints": list(self.complaints),
        }


def summarize_study(
    files: StudyFiles, records: Sequence[Record], complaints: Sequence[str]
) -> StudyNumbers:
    """Compute everything that the report shows.

    Parameters
    ----------
    files : StudyFiles
        What lies beside the records.
    records : sequence of dict
        The records, in any order.
    complaints : sequence of str
        On lines that were skipped.
    """
    groups = groups_of(records, tuple(files.conditions))
    conditions = tuple(dict.fromkeys(group.condition for group in groups))
    timelines = {
        group: read_timeline(files.folder, members, files.phases(group.condition))
        for group, members in groups.items()
    }
    missing = sum(timeline.missing for timeline in timelines.values())
    surfaces = {
        name: surface for name in conditions if (surface := _surface(files, name)) is not None
    }
    saliency = _saliency(groups, surfaces)
    claims = flight_claims(groups, conditions, timelines)
    claims.append(feature_rich_claim(saliency, conditions))
    claims.append(places_claim(groups))
    claims.append(local_minima_claim(_own(files, conditions, groups)))
    views = {
        name: (str(c.get("demonstration")), str(c.get("payload")), str(c.get("view")))
        for name, c in files.conditions.items()
    }
    claims.append(top_view_claim(groups, views))
    if missing:
        files.complaints.append(
            f"the series of {missing} flight(s) could not be read: they are in every table, and in no curve over time"
        )
    return StudyNumbers(
        groups=groups,
        conditions=conditions,
        timelines=timelines,
        surfaces=surfaces,
        saliency=saliency,
        summaries=[summarize(group, members) for group, members in groups.items()],
        comparisons=_comparisons(groups),
        claims=claims,
        complaints=(*complaints, *files.complaints),
    )


def _comparisons(groups: dict[Group, list[Record]]) -> list[dict[str, Any]]:
    return [
        compare(group, group.other(second), groups, key)
        for group in groups
        for first, second in COMPARED
        if group.method == first and group.other(second) in groups
        for key in COMPARED_QUANTITIES
    ]


def _surface(files: StudyFiles, condition: str) -> SalientSurface | None:
    scan = files.scan(condition)
    if scan is None:
        files.complaints.append(f"condition {condition}: no scan, so no picture of its contacts")
        return None
    skill = files.skill(condition)
    try:
        return SalientSurface(scan, None if skill is None else skill.parameters.features)
    except InputError as error:
        files.complaints.append(f"condition {condition}: the scan has no surface features: {error}")
        return None


def _saliency(
    groups: dict[Group, list[Record]], surfaces: dict[str, SalientSurface]
) -> dict[tuple[str, str], list[float]]:
    """Return, by condition and method, how salient the surroundings of each flown solution's contacts are (mean over grippers)."""
    found: dict[tuple[str, str], dict[int, float]] = {}
    for group, members in groups.items():
        surface = surfaces.get(group.condition)
        if surface is None:
            continue
        for rank, flights in by_solution(flown(members)).items():
            positions = (flights[0].get("contact") or {}).get("positions_S")
            if positions:
                percentile = float(np.mean(surface.percentile(np.array(positions, float))))
                found.setdefault((group.condition, group.method), {}).setdefault(rank, percentile)
    return {place: [values[rank] for rank in sorted(values)] for place, values in found.items()}


def _own(
    files: StudyFiles, conditions: Sequence[str], groups: dict[Group, list[Record]]
) -> list[OwnLikelihood]:
    results = []
    for condition in paper_conditions(conditions):
        baseline = files.contacts(condition, BASELINE)
        if baseline is None or not baseline.solutions or len(baseline[0].X_SG.p) < 2:
            continue
        skill, scan = files.skill(condition), files.scan(condition)
        flights = [
            m for g, m in groups.items() if g.condition == condition and g.method == BASELINE
        ]
        count = max((len(by_solution(flown(members))) for members in flights), default=0) or 5
        for method in OURS:
            rival = files.contacts(condition, method)
            if rival is None:
                continue
            if skill is None or scan is None:
                results.append(
                    OwnLikelihood(
                        condition, (), None, method, "no scan or no skill beside the records"
                    )
                )
            else:
                results.append(own_likelihood(condition, skill, scan, baseline, rival, count))
    return results
