"""Systematic resampling: how often each index is drawn, and in which order."""

import numpy as np

from drake_aerial.density.resampling import systematic_resample


def test_draws_are_in_order_and_in_proportion():
    weight = np.array([0.0, 1.0, 3.0, 0.0, 6.0])
    for seed in range(20):
        drawn = systematic_resample(weight, 100, np.random.default_rng(seed))
        assert np.all(np.diff(drawn) >= 0)
        # Systematic: each as often as its share, but for one.
        np.testing.assert_allclose(np.bincount(drawn, minlength=5), [0, 10, 30, 0, 60], atol=1)
    few = sum(
        np.bincount(systematic_resample(weight, 3, np.random.default_rng(k)), minlength=5)
        for k in range(2000)
    )
    np.testing.assert_allclose(few / 2000, 3 * weight / 10, atol=0.05)
    # Nothing salient at all: all alike.
    np.testing.assert_array_equal(
        systematic_resample(np.zeros(4), 8, np.random.default_rng(0)), np.repeat(np.arange(4), 2)
    )


class AlmostOne:
    """A generator that returns the largest number below one."""

    def random(self, count):
        return np.full(count, np.nextafter(1.0, 0.0))


def test_rounding_draws_no_feature_beyond_the_last():
    assert systematic_resample(np.full(7, 0.1), 3, AlmostOne()).max() == 6
