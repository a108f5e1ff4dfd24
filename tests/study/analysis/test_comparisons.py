import itertools

import numpy as np
import pytest

from drake_aerial.study.analysis.comparisons import compare, pair_flights
from drake_aerial.study.analysis.groups import Group, groups_of
from tests.study.small_study import record

KEY = "position_rmse_m"


def test_differences_are_paired_by_solution_and_trial():
    # The second flies 1 cm worse in each pair; unpaired, the spread of contacts would hide it.
    rng = np.random.default_rng(1)
    level = rng.uniform(0.01, 0.5, 5)
    records = []
    for method, more in (("task", 0.0), ("kopicki", 0.01)):
        for k, t in itertools.product(range(5), range(3)):
            records.append(record("A", method, k + 1, t, level[k] + 0.001 * t + more))
    groups = groups_of(records)
    task = Group("A", "task", "below_contact", "table")
    result = compare(task, task.other("kopicki"), groups, KEY)
    np.testing.assert_allclose(result["difference"], [-0.01, -0.01, -0.01], atol=1e-12)
    assert result["wins"] == [1.0, 1.0, 1.0]
    assert (result["pairs"], result["ranks"], result["unpaired"]) == (15, 5, 0)
    ours = [r["metrics"][KEY] for r in records if r["method"] == "task"]
    theirs = [r["metrics"][KEY] for r in records if r["method"] == "kopicki"]
    assert result["ratio"][0] == pytest.approx(np.mean(ours) / np.mean(theirs))


def test_a_failed_flight_loses_and_has_no_difference():
    records = [record("A", "task", 1, 0, 0.5), record("A", "task", 1, 1, 0.5)]
    records += [
        record("A", "kopicki", 1, 0, 0.1),
        record("A", "kopicki", 1, 1, 0.1, outcome="crashed"),
    ]
    task = Group("A", "task", "below_contact", "table")
    result = compare(task, task.other("kopicki"), groups_of(records), KEY)
    assert result["wins"][0] == 0.5
    assert result["difference"][0] == pytest.approx(0.4)
    assert (result["pairs"], result["pairs_completed"]) == (2, 1)


def test_a_method_with_fewer_solutions_pairs_as_said():
    five = [record("A", "task", k, t, 0.1) for k in range(1, 6) for t in range(2)]
    one = [record("A", "centroid", 1, t, 0.1) for t in range(2)]
    three = [record("A", "kopicki", k, t, 0.1) for k in range(1, 4) for t in range(2)]
    pairs, unpaired = pair_flights(five, one)
    assert [len(rank) for rank in pairs] == [2] * 5
    assert unpaired == 0
    pairs, unpaired = pair_flights(five, three)
    assert [len(rank) for rank in pairs] == [2] * 3
    assert unpaired == 4
    assert all(
        a["trial"] == b["trial"] and a["seed"] == b["seed"] for rank in pairs for a, b in rank
    )
    assert pair_flights(five, []) == ([], 10)
