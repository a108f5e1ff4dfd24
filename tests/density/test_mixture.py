"""Sums of many kernels against sums one by one, weights, blocks, overflow and underflow."""

import numpy as np
import pytest

from drake_aerial.density import mixture
from drake_aerial.density.mixture import (
    checked_weights,
    exponent_blocks,
    exponentiate,
    lift,
    lifted_gaussian,
    systematic_resample,
)
from drake_aerial.errors import InputError


def test_weights_are_scaled_and_uniform_by_default():
    np.testing.assert_allclose(checked_weights([1.0, 0.0, 3.0], 3, "a density"), [0.25, 0.0, 0.75])
    np.testing.assert_allclose(checked_weights(None, 4, "a density"), np.full(4, 0.25))


@pytest.mark.parametrize(
    ("weights", "count", "message"),
    [
        (None, 0, "a density must have at least one kernel"),
        ([1.0, 1.0], 3, r"`weights` must be of shape \(3,\), got \(2,\)"),
        ([[1.0]], 1, "`weights` must be of shape"),
        ([1.0, -1e-9], 2, "not negative"),
        ([1.0, np.inf], 2, "finite"),
        ([0.0, 0.0], 2, "not all zero"),
    ],
)
def test_bad_weights_are_refused(weights, count, message):
    with pytest.raises(InputError, match=message):
        checked_weights(weights, count, "a density")


def test_lifted_exponents_are_those_of_gaussians():
    rng = np.random.default_rng(0)
    x, mu = rng.normal(size=(40, 3)), rng.normal(size=(7, 3))
    expected = -np.sum((x[:, None] - mu) ** 2, axis=-1) / (2 * 0.7**2)
    np.testing.assert_allclose(lift(x) @ lifted_gaussian(mu, 0.7), expected, atol=1e-12)


@pytest.mark.parametrize("block", [1, 300, 1000, 10**6])
def test_blocks_cover_all_points_once_and_are_no_larger_than_asked(monkeypatch, block):
    monkeypatch.setattr(mixture, "BLOCK_BYTES", block)
    rng = np.random.default_rng(1)
    points, coefficients = rng.normal(size=(37, 4)), rng.normal(size=(4, 5))
    out = np.zeros((37, 5))
    for rows, e in exponent_blocks(points, coefficients):
        assert e.nbytes <= max(block, 4 * 5 * 8)  # a few points at least
        out[rows] += e
    np.testing.assert_allclose(out, points @ coefficients, atol=1e-14)


@pytest.mark.parametrize(("kind", "digits"), [(np.float64, 1e-13), (np.float32, 2e-5)])
def test_log_sums_neither_overflow_nor_underflow(kind, digits):
    rng = np.random.default_rng(2)
    coefficients = rng.normal(size=(3, 30)).astype(kind)
    points = np.array([[1.0, 2.0, -1.0], [900.0, -500.0, 300.0], [-900.0, 0.0, 0.0]])
    weights = rng.uniform(0.1, 1.0, (30, 2))
    weights[::2, 1] *= 1e-6
    exact = points @ coefficients.astype(float)
    expected = [np.logaddexp.reduce(exact + np.log(w), axis=1) for w in weights.T]
    got = mixture.log_weighted_sums(points, coefficients, weights)
    assert np.isfinite(got).all()
    np.testing.assert_allclose(got, np.transpose(expected), rtol=digits, atol=10 * digits)
    nothing = mixture.log_weighted_sums(points, coefficients, np.zeros((30, 1)))
    np.testing.assert_array_equal(nothing, np.full((3, 1), -np.inf))


def test_log_sums_far_below_and_above_every_exponent_that_can_be_taken_as_it_is():
    offsets = np.arange(-1100.0, 1100.0, 0.7)
    spread = np.array([0.0, -1.3, -40.0, -350.0])
    points, coefficients = (
        np.column_stack([offsets, np.ones_like(offsets)]),
        np.vstack([np.ones(4), spread]),
    )
    expected = offsets + np.logaddexp.reduce(spread)
    got = mixture.log_weighted_sums(points, coefficients, np.ones((4, 1)))[:, 0]
    np.testing.assert_allclose(got, expected, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_exponentials_are_relative_to_the_largest_of_their_row(kind):
    e = np.array([[700.0, 695.0, -400.0], [-3.0, -1e4, -4.0]], kind)
    given = e.copy()
    top = exponentiate(e)
    np.testing.assert_array_equal(top, [[700.0], [-3.0]])
    assert e.dtype == kind
    np.testing.assert_allclose(e, np.exp((given - top).astype(float)), rtol=1e-6, atol=1e-30)
    # Subnormal numbers are slow.
    assert e.min() > np.finfo(kind).tiny


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
