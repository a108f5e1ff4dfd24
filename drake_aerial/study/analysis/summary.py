"""All numbers of a study, computed from its folder: the content of summary.json."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.study.analysis.claims import BASELINE, OURS, Claim, paper_conditions
from drake_aerial.study.analysis.comparisons import compare
from drake_aerial.study.analysis.contact_claims import (
    feature_rich_claim,
    local_minima_claim,
    places_claim,
    top_view_claim,
)
from drake_aerial.study.analysis.flight_claims import flight_claims
from drake_aerial.study.analysis.groups import Group, by_solution, groups_of
from drake_aerial.study.analysis.intervals import SEED
from drake_aerial.study.analysis.labels import BELIEF_ORDER, METHOD_ORDER, position
from drake_aerial.study.analysis.own_likelihood import OwnLikelihood, own_likelihood
from drake_aerial.study.analysis.saliency import SalientSurface
from drake_aerial.study.analysis.statistics import FORMULAS, summarize
from drake_aerial.study.analysis.timeline import Timeline, read_timeline
from drake_aerial.study.records import Record
from drake_aerial.study.study_folder import StudyFolder

SCHEMA = "drake_aerial/study_summary"
VERSION = 1
COMPARED = (
    ("task", "kopicki"),
    ("paper", "kopicki"),
    ("task", "paper"),
    ("task", "registration"),
    ("task", "obb"),
    ("task", "centroid"),
)
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
    """The numbers of a study.

    Attributes
    ----------
    groups : dict of Group to records
        In the report's order.
    conditions : tuple of str
        Conditions with records, in the plan's order.
    timelines : dict of Group to Timeline
    surfaces : dict of str to SalientSurface
        Scans by condition, if they could be read.
    saliency : dict
        (condition, method) to one value per solution; see `contact_claims.feature_rich_claim`.
    summaries, comparisons : list of dict
        See `statistics.summarize` and `comparisons.compare`.
    claims : list of Claim
    complaints : tuple of str
        One line for every file or line that could not be read.
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
        """Beliefs that were flown, in the report's order."""
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
    folder: StudyFolder, records: Sequence[Record], complaints: Sequence[str]
) -> StudyNumbers:
    """Compute all numbers of the report.

    Parameters
    ----------
    folder : StudyFolder
    records : sequence of dict
        In any order.
    complaints : sequence of str
        One line for every line of the records that was skipped.
    """
    groups = groups_of(records, tuple(folder.conditions))
    conditions = tuple(dict.fromkeys(group.condition for group in groups))
    timelines = {
        group: read_timeline(folder, members, folder.phases(group.condition))
        for group, members in groups.items()
    }
    surfaces = {
        name: surface for name in conditions if (surface := _surface(folder, name)) is not None
    }
    saliency = _saliency(groups, surfaces)
    views = {
        name: (str(c.get("demonstration")), str(c.get("payload")), str(c.get("view")))
        for name, c in folder.conditions.items()
    }
    claims = [
        *flight_claims(groups, conditions, timelines),
        feature_rich_claim(saliency, conditions),
        places_claim(groups),
        local_minima_claim(_own_likelihoods(folder, conditions, groups)),
        top_view_claim(groups, views),
    ]
    missing = sum(timeline.missing for timeline in timelines.values())
    if missing:
        folder.warn(
            f"the series of {missing} flight(s) could not be read: these flights are in every "
            "table, but in no curve over time"
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
        complaints=(*complaints, *folder.warnings),
    )


def _comparisons(groups: dict[Group, list[Record]]) -> list[dict[str, Any]]:
    return [
        compare(group, group.other(second), groups, key)
        for group in groups
        for first, second in COMPARED
        if group.method == first and group.other(second) in groups
        for key in COMPARED_QUANTITIES
    ]


def _surface(folder: StudyFolder, condition: str) -> SalientSurface | None:
    scan = folder.scan(condition)
    if scan is None:
        folder.warn(f"condition {condition} has no scan: its contacts are not drawn")
        return None
    skill = folder.skill(condition)
    try:
        return SalientSurface(scan, None if skill is None else skill.parameters.features)
    except InputError as error:
        folder.warn(f"condition {condition}: its scan gives no surface features: {error}")
        return None


def _saliency(
    groups: dict[Group, list[Record]], surfaces: dict[str, SalientSurface]
) -> dict[tuple[str, str], list[float]]:
    """Return the saliency percentile of each flown solution, mean over its grippers."""
    found: dict[tuple[str, str], dict[int, float]] = {}
    for group, members in groups.items():
        surface = surfaces.get(group.condition)
        if surface is None:
            continue
        for rank, flights in by_solution(members).items():
            positions = (flights[0].get("contact") or {}).get("positions_S")
            if positions:
                percentile = float(np.mean(surface.percentile(np.array(positions, float))))
                found.setdefault((group.condition, group.method), {}).setdefault(rank, percentile)
    return {place: [values[rank] for rank in sorted(values)] for place, values in found.items()}


def _own_likelihoods(
    folder: StudyFolder, conditions: Sequence[str], groups: dict[Group, list[Record]]
) -> list[OwnLikelihood]:
    """Return the baseline's objective at its solutions and ours, for several grippers."""
    results = []
    for condition in paper_conditions(conditions):
        baseline = folder.contacts(condition, BASELINE)
        if baseline is None or not baseline.solutions or len(baseline[0].X_SG.p) < 2:
            continue
        skill, scan = folder.skill(condition), folder.scan(condition)
        flights = [
            m for g, m in groups.items() if g.condition == condition and g.method == BASELINE
        ]
        count = max((len(by_solution(members)) for members in flights), default=0) or 5
        for method in OURS:
            rival = folder.contacts(condition, method)
            if rival is None:
                continue
            if skill is None or scan is None:
                note = "no scan or no skill in the study's folder"
                results.append(OwnLikelihood(condition, (), None, method, note))
            else:
                results.append(own_likelihood(condition, skill, scan, baseline, rival, count))
    return results
