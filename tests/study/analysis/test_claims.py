import numpy as np
import pytest

from drake_aerial.study.analysis.claims import Finding, Outcome, outcome_of, verdict
from drake_aerial.study.analysis.contact_claims import (
    feature_rich_claim,
    local_minima_claim,
    places_claim,
    top_view_claim,
)
from drake_aerial.study.analysis.flight_claims import flight_claims
from drake_aerial.study.analysis.groups import groups_of
from drake_aerial.study.analysis.own_likelihood import OwnLikelihood
from tests.study.small_study import method_study, record


def finding(outcome, condition="A", belief="below_contact"):
    return Finding(condition, belief, "task", outcome)


@pytest.mark.parametrize(
    ("outcomes", "expected"),
    [
        ([("A", "b", Outcome.HOLDS), ("B", "b", Outcome.HOLDS)], "holds"),
        ([("A", "b", Outcome.HOLDS), ("B", "b", Outcome.NOT_TESTED)], "holds"),
        ([("A", "b", Outcome.HOLDS), ("B", "b", Outcome.UNDECIDED)], "holds in A only"),
        ([("A", "b", Outcome.REVERSED), ("B", "b", Outcome.UNDECIDED)], "does not hold"),
        ([("A", "b", Outcome.UNDECIDED), ("B", "b", Outcome.UNDECIDED)], "undecided"),
        ([("A", "b", Outcome.NOT_TESTED)], "not tested"),
        ([], "not tested"),
        ([("A", "below_contact", Outcome.HOLDS), ("A", "true", Outcome.HOLDS)], "holds"),
        (
            [("A", "below_contact", Outcome.HOLDS), ("A", "true", Outcome.UNDECIDED)],
            "holds under belief below_contact; undecided under true",
        ),
        ([("A", "below_contact", Outcome.HOLDS), ("A", "true", Outcome.NOT_TESTED)], "holds"),
    ],
)
def test_verdicts_follow_the_stated_rule(outcomes, expected):
    assert verdict([finding(outcome, c, b) for c, b, outcome in outcomes]) == expected


def test_a_figure_without_an_upper_limit_is_written_as_infinite():
    found = Finding("A", "", "task", Outcome.UNDECIDED, figure=(0.02, 0.0, 1e300), unit="×")
    assert found.text() == "0.02 [0.00, ∞] ×"


def test_an_interval_decides():
    assert outcome_of(-2.0, -1.0, 0.0) == Outcome.HOLDS
    assert outcome_of(1.0, 2.0, 0.0) == Outcome.REVERSED
    assert outcome_of(-1.0, 1.0, 0.0) == Outcome.UNDECIDED
    assert outcome_of(None, None, 0.0) == Outcome.NOT_TESTED


def claims_of(records):
    groups = groups_of(records)
    return {claim.key: claim for claim in flight_claims(groups, ("A", "B"), {})}


def test_a_clear_difference_holds_and_its_mirror_is_reversed():
    rng = np.random.default_rng(0)
    claims = claims_of(method_study(rng, ratio=3.0))
    assert claims["position"].verdicts == {"task": "holds"}
    assert claims["position_spread"].verdicts == {"task": Outcome.NOT_TESTED}  # no series
    mirrored = claims_of(method_study(rng, ratio=1.0 / 3.0))["position"]
    assert mirrored.verdicts == {"task": "does not hold"}
    assert {f.outcome for f in mirrored.findings} == {Outcome.REVERSED}
    assert len(mirrored.why) == 2
    assert "rank correlation" in mirrored.why[0]


def test_no_difference_is_undecided():
    claim = claims_of(method_study(np.random.default_rng(0), ratio=1.0))["position"]
    assert {f.outcome for f in claim.findings} == {Outcome.UNDECIDED}


def test_a_better_mean_of_few_completed_flights_does_not_hold():
    # The first is more precise where it completes, and fails in most flights.
    records = method_study(np.random.default_rng(0), conditions=("A",))
    for r in records:
        if r["method"] == "task" and r["trial"] > 0:
            r["outcome"] = "crashed"
    (found,) = claims_of(records)["position"].findings
    assert found.figure[2] < 0.0
    assert found.outcome == Outcome.UNDECIDED


def test_two_solutions_are_too_few():
    claim = claims_of(method_study(np.random.default_rng(0), solutions=2))["position"]
    assert claim.verdicts == {"task": Outcome.NOT_TESTED}


def test_places_on_the_bunny_are_two_steps():
    rng = np.random.default_rng(0)
    level = {"head": 0.02, "middle": 0.1, "thigh": 0.09}
    records = [
        record("H", m, 1, t, v * rng.uniform(0.95, 1.0)) for m, v in level.items() for t in range(3)
    ]
    claim = places_claim(groups_of(records))
    assert [(f.condition, f.outcome) for f in claim.findings] == [
        ("head < middle", Outcome.HOLDS),
        ("middle < thigh", Outcome.REVERSED),
    ]
    assert claim.verdicts == {"contact given": "holds in head < middle only"}


def test_feature_rich_is_above_chance():
    rich, poor = [0.9, 0.8, 0.95, 0.85], [0.1, 0.2, 0.15, 0.1]
    claim = feature_rich_claim({("A", "kopicki"): rich, ("B", "kopicki"): poor}, ("A", "B", "C"))
    assert [f.outcome for f in claim.findings] == [
        Outcome.HOLDS,
        Outcome.REVERSED,
        Outcome.NOT_TESTED,
    ]
    assert claim.verdicts == {"kopicki": "holds in A only"}


def test_a_search_is_stuck_if_a_better_solution_is_known():
    stuck = OwnLikelihood("C", (1.0, 0.5, 0.2, 0.1), 2.0, "task")
    found = OwnLikelihood("D", (3.0, 2.5, 2.2, 0.1), 2.0, "task")
    claim = local_minima_claim([stuck, found])
    assert [f.outcome for f in claim.findings] == [Outcome.HOLDS, Outcome.REVERSED]
    assert claim.verdicts == {"kopicki": "holds in C only"}
    assert "the optimum of local likeness" in claim.why[0]


@pytest.mark.parametrize(("more", "outcome"), [(0.0, Outcome.HOLDS), (0.05, Outcome.REVERSED)])
def test_a_top_view_may_cost_a_centimetre(more, outcome):
    rng = np.random.default_rng(0)
    records = []
    for condition, extra in (("A", more), ("A_full", 0.0)):
        for k in range(1, 6):
            records += [
                record(condition, "task", k, t, 0.02 + extra + 0.001 * rng.uniform())
                for t in range(3)
            ]
    views = {
        "A": ("flat", "box", "top"),
        "A_full": ("flat", "box", "full"),
        "B": ("curved", "box", "full"),
    }
    claim = top_view_claim(groups_of(records), views)
    assert [(f.condition, f.outcome) for f in claim.findings] == [("A v A_full", outcome)]


def test_without_a_full_view_the_reference_is_centroid():
    records = [record("A", "task", k, t, 0.02 + 0.001 * k) for k in range(1, 6) for t in range(3)]
    records += [record("A", "centroid", 1, t, 0.02) for t in range(3)]
    claim = top_view_claim(
        groups_of(records), {"A": ("flat", "box", "top"), "G": ("edge", "box", "top")}
    )
    assert [(f.condition, f.outcome) for f in claim.findings] == [("A v A centroid", Outcome.HOLDS)]


def test_conditions_that_the_paper_does_not_have_are_shown_and_do_not_count():
    rng = np.random.default_rng(0)
    records = method_study(rng, conditions=("A",)) + method_study(rng, conditions=("E",), ratio=0.3)
    claim = flight_claims(groups_of(records), ("A", "E"), {})[0]
    assert [(f.condition, f.outcome, f.counted) for f in claim.findings] == [
        ("A", Outcome.HOLDS, True),
        ("E", Outcome.REVERSED, False),
    ]
    assert claim.verdicts == {"task": "holds"}
