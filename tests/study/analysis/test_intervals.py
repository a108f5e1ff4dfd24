import numpy as np
import pytest
from scipy import stats

from drake_aerial.errors import InputError
from drake_aerial.study.analysis.intervals import cluster_bootstrap, cluster_weights, wilson


def scipys(values, rng):
    """SciPy's percentile interval at the level that makes a normal sample's interval Student's."""
    n = len(values)
    level = 1.0 - 2.0 * stats.norm.cdf(np.sqrt(n / (n - 1)) * stats.t.ppf(0.025, n - 1))
    return stats.bootstrap(
        (values,), np.mean, method="percentile", n_resamples=9000, confidence_level=level, rng=rng
    ).confidence_interval


def test_clusters_of_one_are_the_ordinary_bootstrap():
    values = np.random.default_rng(1).normal(3.0, 2.0, 40)
    ours = cluster_bootstrap([[v] for v in values], np.random.default_rng(2), resamples=9000)
    assert ours.value == pytest.approx(values.mean())
    np.testing.assert_allclose(
        [ours.low, ours.high], scipys(values, np.random.default_rng(3)), atol=0.06
    )


def test_five_solutions_of_ten_flights_cover_as_often_as_they_say():
    rng, hits, runs = np.random.default_rng(0), 0, 400
    for _ in range(runs):
        clusters = [mean + 0.3 * rng.normal(size=10) for mean in rng.normal(size=5)]
        interval = cluster_bootstrap(clusters, rng, resamples=1000)
        hits += interval.low <= 0.0 <= interval.high
    assert 0.91 < hits / runs < 0.99


def test_the_interval_knows_that_flights_of_one_solution_are_alike():
    rng = np.random.default_rng(4)
    level = rng.normal(size=20)
    clusters = [rng.normal(mean, 0.01, 10) for mean in level]
    interval = cluster_bootstrap(clusters, np.random.default_rng(5), resamples=3000)
    # The exact variance of the mean: between solutions, plus within (negligible here).
    expected = stats.t.ppf(0.975, 19) * np.std([c.mean() for c in clusters], ddof=1) / np.sqrt(20)
    assert 0.5 * (interval.high - interval.low) == pytest.approx(expected, rel=0.08)
    alike = cluster_bootstrap([[v] for c in clusters for v in c], np.random.default_rng(5))
    assert interval.high - interval.low > 2.5 * (alike.high - alike.low)


def test_resamples_are_those_of_drawing_solutions_and_then_their_flights():
    sizes = [3, 1, 5]
    weights = cluster_weights(sizes, np.random.default_rng(0), 20000)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    rng, plain = np.random.default_rng(1), []
    start = np.cumsum([0, *sizes])
    for _ in range(20000):
        rows = [start[k] + rng.integers(sizes[k], size=sizes[k]) for k in rng.integers(3, size=3)]
        count = np.bincount(np.concatenate(rows), minlength=9)
        plain.append(count / count.sum())
    np.testing.assert_allclose(weights.mean(axis=0), np.mean(plain, axis=0), atol=0.005)
    np.testing.assert_allclose(np.cov(weights.T), np.cov(np.transpose(plain)), atol=0.004)


def test_a_ratio_of_means_is_not_a_mean_of_ratios():
    pairs = np.array([[1.0, 2.0], [3.0, 1.0], [2.0, 4.0]])
    interval = cluster_bootstrap(
        [pairs[:1], pairs[1:]], np.random.default_rng(0), of_means=lambda m: m[:, 0] / m[:, 1]
    )
    assert interval.value == pytest.approx(6.0 / 7.0)
    assert 0.5 <= interval.low < interval.value < interval.high <= 3.0


def test_same_generator_same_interval_and_nothing_from_one_value():
    clusters = [[1.0, 2.0], [4.0]]
    first = cluster_bootstrap(clusters, np.random.default_rng(7))
    assert first == cluster_bootstrap(clusters, np.random.default_rng(7))
    assert cluster_bootstrap([[2.0]], np.random.default_rng(7)).to_list() == [2.0, None, None]
    assert cluster_bootstrap([], np.random.default_rng(7)).to_list() == [None, None, None]


@pytest.mark.parametrize(("failures", "attempts"), [(0, 10), (3, 10), (10, 10), (1, 50), (25, 50)])
def test_wilsons_limits_are_the_rates_at_which_the_score_is_at_its_quantile(failures, attempts):
    interval = wilson(failures, attempts)
    assert interval.value == failures / attempts
    for limit in (interval.low, interval.high):
        deviation = abs(failures / attempts - limit)
        assert deviation == pytest.approx(
            1.959964 * np.sqrt(limit * (1 - limit) / attempts), abs=1e-7
        )
    assert 0.0 <= interval.low <= interval.value <= interval.high <= 1.0


def test_wilson_refuses_more_failures_than_attempts():
    assert wilson(0, 0).value is None
    with pytest.raises(InputError, match="`failures` must be in 0 to 10, got 11"):
        wilson(11, 10)
