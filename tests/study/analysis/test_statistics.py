import numpy as np
import pytest
from scipy import stats

from drake_aerial.study.analysis.groups import Group, groups_of
from drake_aerial.study.analysis.intervals import wilson
from drake_aerial.study.analysis.statistics import spread, summarize
from tests.study.small_study import method_study, record

KEY = "position_rmse_m"


def test_the_statistics_of_a_group_agree_with_numpy_and_scipy():
    records = method_study(np.random.default_rng(0), conditions=("A",))
    groups = groups_of(records)
    kopicki = Group("A", "kopicki", "below_contact", "table")
    summary = summarize(kopicki, groups[kopicki])
    values = [
        r["metrics"][KEY]
        for r in records
        if r["method"] == "kopicki" and r["outcome"] == "completed"
    ]
    figure = summary["quantities"][KEY]
    assert (
        summary["flights"],
        summary["completed"],
        summary["crashed"],
        summary["solutions_failed"],
    ) == (20, 19, 1, 1)
    assert figure["n"] == 19
    assert figure["mean"] == pytest.approx(np.mean(values))
    assert figure["std"] == pytest.approx(stats.tstd(values))
    assert figure["median"] == pytest.approx(np.median(values))
    assert figure["median_all"] == pytest.approx(np.median([*values, np.inf]))
    assert figure["interval"][0] < figure["mean"] < figure["interval"][1]
    np.testing.assert_allclose(summary["failure_rate"], wilson(1, 20).to_list())


def test_the_interval_of_independent_solutions_is_scipys_bootstrap():
    rng = np.random.default_rng(3)
    records = [record("A", "task", k, 0, rng.uniform(0.01, 0.1)) for k in range(1, 41)]
    group = Group.of(records[0])
    low, high = summarize(group, records)["quantities"][KEY]["interval"]
    values = [r["metrics"][KEY] for r in records]
    level = 1.0 - 2.0 * stats.norm.cdf(np.sqrt(40 / 39) * stats.t.ppf(0.025, 39))
    theirs = stats.bootstrap(
        (values,),
        np.mean,
        method="percentile",
        n_resamples=9000,
        confidence_level=level,
        rng=np.random.default_rng(1),
    )
    np.testing.assert_allclose([low, high], theirs.confidence_interval, rtol=0.03)


def test_the_median_is_null_if_more_than_half_failed():
    records = [
        record("A", "task", 1, k, 0.02, outcome="completed" if k < 2 else "dropped")
        for k in range(5)
    ]
    figure = summarize(Group.of(records[0]), records)["quantities"][KEY]
    assert figure["median"] == 0.02
    assert figure["median_all"] is None


def test_infeasible_solutions_are_not_part_of_means_and_rates():
    records = [record("A", "task", k, 0, 0.02) for k in (1, 2)] + [
        record("A", "task", 3, 0, 9.0, outcome="not_flown")
    ]
    summary = summarize(Group.of(records[0]), records)
    assert (summary["flights"], summary["not_flown"], summary["solutions"]) == (2, 1, 2)
    assert summary["quantities"][KEY]["mean"] == pytest.approx(0.02)
    assert summary["failure_rate"][0] == 0.0


def test_neither_order_nor_other_conditions_change_a_figure():
    records = method_study(np.random.default_rng(0))
    group = Group("B", "task", "below_contact", "table")
    alone = summarize(group, [r for r in records if Group.of(r) == group])
    shuffled = [records[k] for k in np.random.default_rng(1).permutation(len(records))]
    assert summarize(group, groups_of(shuffled)[group]) == alone
    assert list(groups_of(shuffled, ("B", "A"))) == list(groups_of(records, ("B", "A")))
    assert groups_of(records + records) == groups_of(records)


def test_spread_is_the_std_over_flights_and_its_interval_covers():
    rng = np.random.default_rng(2)
    clusters = [rng.normal(0.0, 2.0, (4, 30)) for _ in range(5)]
    value, samples = spread(clusters, np.random.default_rng(0), 3000)
    rows = np.concatenate(clusters)
    assert value == pytest.approx(np.sqrt(np.mean(np.std(rows, axis=0, ddof=1) ** 2)))
    assert samples.shape == (3000,)
    assert np.quantile(samples, 0.025) < value < np.quantile(samples, 0.995)
    assert spread([rng.normal(size=(1, 30))], rng)[0] is None
