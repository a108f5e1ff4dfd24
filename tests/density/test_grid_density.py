"""The votes' density on a grid, against the direct sum of Gaussians."""

import numpy as np
import pytest

from drake_aerial.density.grid_density import GridDensity


def direct(x, votes, weights, sigma, periodic):
    d = x[:, None] - votes
    wrapped = (d + np.pi) % (2 * np.pi) - np.pi
    d = np.where(periodic, wrapped, d) / sigma
    norm = np.prod(np.sqrt(2 * np.pi) * np.asarray(sigma))
    return np.exp(-0.5 * np.sum(d**2, axis=-1)) @ (weights / weights.sum()) / norm


@pytest.mark.parametrize("with_yaw", [False, True])
def test_equals_the_direct_sum(with_yaw):
    rng = np.random.default_rng(0)
    votes, weights = rng.uniform(-0.3, 0.3, (300, 3)), rng.uniform(0.1, 1.0, 300)
    votes[:, 2] = rng.uniform(0, 2 * np.pi, 300)
    sigma, low, high = [0.05, 0.05, 0.35], [-0.3, -0.3, 0.0], [0.3, 0.3, 2 * np.pi]
    periodic = [False, False, True]
    keep = slice(0, 3 if with_yaw else 2)
    votes = votes[:, keep]
    density = GridDensity(votes, weights, sigma[keep], low[keep], high[keep], periodic[keep])
    x = rng.uniform(-0.3, 0.3, (200, 3))
    x[:, 2] = rng.uniform(-7.0, 7.0, 200)
    x = x[:, keep]
    expected = direct(x, votes, weights, sigma[keep], periodic[keep])
    # Cells of a quarter bandwidth widen the kernels by one per cent.
    np.testing.assert_allclose(
        np.exp(density.log_density(x)), expected, rtol=0.05, atol=0.03 * expected.max()
    )


def test_gradient_equals_finite_differences():
    rng = np.random.default_rng(1)
    votes = np.column_stack([rng.uniform(-0.2, 0.2, (100, 2)), rng.uniform(0, 2 * np.pi, 100)])
    upper = [0.2, 0.2, 2 * np.pi]
    density = GridDensity(
        votes, np.ones(100), [0.05, 0.05, 0.35], [-0.2, -0.2, 0.0], upper, [False, False, True]
    )
    x = np.column_stack([rng.uniform(-0.25, 0.25, (50, 2)), rng.uniform(-4, 4, 50)])
    _, gradient = density.log_density_and_gradient(x)
    for i, step in enumerate(1e-6 * np.eye(3)):
        difference = density.log_density(x + step) - density.log_density(x - step)
        np.testing.assert_allclose(gradient[:, i], difference / 2e-6, rtol=1e-4, atol=1e-3)


def test_integrates_to_one_and_finds_its_mode():
    votes = np.array([[0.1, 0.2], [0.1, 0.2], [-0.2, 0.0]])
    density = GridDensity(votes, np.ones(3), [0.05, 0.05], [-0.3, -0.3], [0.3, 0.3], [False, False])
    axis = np.arange(-0.5, 0.5, 0.005)
    grid = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1)
    assert np.exp(density.log_density(grid)).sum() * 0.005**2 == pytest.approx(1.0, abs=0.01)
    np.testing.assert_allclose(density.mode, [0.1, 0.2], atol=0.0125)


def test_is_flat_far_away_and_never_infinite():
    density = GridDensity(
        np.zeros((1, 2)), np.ones(1), [0.05, 0.05], [-1, -1], [1, 1], [False, False]
    )
    far = density.log_density(np.array([[5.0, 5.0], [50.0, -50.0]]))
    assert np.isfinite(far).all()
    assert far[0] == pytest.approx(far[1], abs=1e-9)
    assert far[0] < density.log_density(np.zeros((1, 2)))[0] - 15.0
    _, gradient = density.log_density_and_gradient(np.array([[5.0, 5.0]]))
    np.testing.assert_array_equal(gradient, 0.0)


def test_best_of_last_counts_votes_together_only_where_they_agree():
    # Two votes at one place with one yaw outweigh three at another with three yaws.
    agreed, scattered = [[-0.2, 0.0, 1.0]] * 2, [[0.2, 0.0, 1.0], [0.2, 0.0, 3.0], [0.2, 0.0, 5.0]]
    args = ([0.05, 0.05, 0.35], [-0.3, -0.3, 0.0], [0.3, 0.3, 2 * np.pi], [False, False, True])
    votes = np.array(agreed + scattered)
    together = GridDensity(votes, np.ones(5), *args, best_of_last=True)
    np.testing.assert_allclose(together.mode, [-0.2, 0.0], atol=0.0125)
    np.testing.assert_allclose(
        GridDensity(votes[:, :2], np.ones(5), *(a[:2] for a in args)).mode, [0.2, 0.0], atol=0.0125
    )
    assert together.log_density(np.zeros((4, 2))).shape == (4,)


def test_coordinates_other_than_the_last_stay_periodic_or_not():
    periodic, upper = [True, False, True], [2 * np.pi, 0.3, 2 * np.pi]
    args = ([0.35, 0.05, 0.35], [0.0, -0.3, 0.0], upper, periodic)
    density = GridDensity(np.array([[6.1, -0.25, 1.0]]), np.ones(1), *args, best_of_last=True)
    there, round_once, beyond = density.log_density(
        np.array([[6.1, -0.25], [6.1 - 2 * np.pi, -0.25], [6.1, 0.75]])
    )
    assert round_once == pytest.approx(there, abs=1e-9)
    assert beyond < there - 15.0


UNEVEN = ([0.04, 0.07, 0.35], [-0.3, -0.2, 0.0], [0.3, 0.4, 2 * np.pi], [False, False, True])


def test_one_vote_is_one_gaussian_where_it_fell():
    vote, sigma = np.array([0.123, 0.057, 6.2]), np.array(UNEVEN[0])
    density = GridDensity(vote[None], np.array([3.0]), *UNEVEN)
    assert density.total == pytest.approx(3.0)
    rng = np.random.default_rng(2)
    offset = rng.uniform(-2.5, 2.5, (300, 3)) * sigma
    expected = -0.5 * np.sum((offset / sigma) ** 2, axis=1) - np.log(
        np.prod(np.sqrt(2 * np.pi) * sigma)
    )
    # Sharing a vote among the corners of a cell widens it by less than a cell (a quarter sigma).
    np.testing.assert_allclose(density.log_density(vote + offset), expected, atol=0.08)
    assert np.all(np.abs(density.mode - vote) < 0.6 * sigma / 4)
    # The maximum is at the vote, not at a grid point: the slope vanishes there, and half a
    # bandwidth away it is that of a Gaussian.
    slopes = [
        density.log_density_and_gradient(vote + s * sigma)[1] * sigma for s in (-0.5, 0.0, 0.5)
    ]
    np.testing.assert_allclose(slopes, np.outer([0.5, 0.0, -0.5], np.ones(3)), atol=0.03)


def test_angles_wrap_around():
    rng = np.random.default_rng(3)
    votes = np.column_stack([rng.uniform(-0.2, 0.2, (40, 2)), rng.uniform(-0.3, 0.3, 40)])
    density = GridDensity(votes, np.ones(40), *UNEVEN)
    assert density.total == pytest.approx(40.0)
    x = np.column_stack([rng.uniform(-0.2, 0.2, (60, 2)), rng.uniform(-1.0, 1.0, 60)])
    for turns in (-2.0, 1.0):
        there = x + [0.0, 0.0, 2 * np.pi * turns]
        np.testing.assert_allclose(density.log_density(there), density.log_density(x), atol=1e-9)
        for got, expected in zip(
            density.log_density_and_gradient(there), density.log_density_and_gradient(x)
        ):
            np.testing.assert_allclose(got, expected, atol=1e-6)
    # Votes about zero: as likely on the one side of the seam as on the other.
    even = GridDensity(np.vstack([votes, votes * [1, 1, -1]]), np.ones(80), *UNEVEN)
    np.testing.assert_allclose(even.log_density(x), even.log_density(x * [1, 1, -1]), atol=0.02)


def test_votes_beside_the_region_count_as_far_as_they_reach_into_it():
    args = ([0.05, 0.05], [0.0, 0.0], [0.4, 0.4], [False, False])
    inside, beside, far = [0.2, 0.2], [-0.1, 0.2], [-0.4, 0.2]
    assert GridDensity(
        np.array([inside, beside, far]), np.array([1.0, 2.0, 4.0]), *args
    ).total == pytest.approx(3.0)
    for side in ([0.0, 0.1], [0.4, 0.1], [0.1, 0.0], [0.1, 0.4]):
        density = GridDensity(np.array([side]), np.ones(1), *args)
        outward = (np.array(side) - 0.2) * (np.abs(np.array(side) - 0.2) > 0.15)
        outward /= np.linalg.norm(outward)
        for s in (0.0, 1.0, 2.0, 3.0, 4.0):  # the region ends here, the density does not
            there = np.array(side) + 0.05 * s * outward
            expected = -0.5 * s**2 - np.log(2 * np.pi * 0.05**2)
            assert density.log_density(there) == pytest.approx(expected, abs=0.12)
    # Beyond the last line of the grid by part of a cell: that part falls off.
    partly = GridDensity(np.array([[0.605, 0.2]]), np.ones(1), *args)
    assert 0.1 < partly.total < 0.9
    nothing = GridDensity(np.array([far]), np.ones(1), *args)
    assert nothing.total == 0.0
    assert np.isfinite(nothing.log_density(np.zeros((3, 2)))).all()


def test_the_floor_is_relative_to_the_largest_density():
    density = GridDensity(
        np.zeros((1, 2)), np.ones(1), [0.05, 0.05], [-1, -1], [1, 1], [False, False]
    )
    drop = density.log_density(np.zeros(2)) - density.log_density(np.array([0.9, -0.9]))
    assert drop == pytest.approx(np.log(1e8), abs=0.01)
    assert drop.shape == ()


def test_yaws_that_agree_add_up_and_those_that_do_not_hardly():
    places = np.array([[-0.2, -0.2], [-0.2, 0.2], [0.2, -0.2], [0.2, 0.2]])
    yaws = ([1.0], [1.0, 1.0], [1.0, 4.0], [0.02, -0.02])
    votes = np.array([[*place, yaw % (2 * np.pi)] for place, of in zip(places, yaws) for yaw in of])
    args = ([0.05, 0.05, 0.35], [-0.3, -0.4, 0.0], [0.3, 0.35, 2 * np.pi], [False, False, True])
    density = GridDensity(votes, np.ones(len(votes)), *args, best_of_last=True)
    one, agreed, apart, about_zero = density.log_density(places)
    assert agreed - one == pytest.approx(np.log(2.0), abs=0.01)
    assert about_zero - one == pytest.approx(np.log(2.0), abs=0.03)
    # The fourth root of twice the fourth powers.
    assert apart - one == pytest.approx(np.log(2.0) / 4.0, abs=0.01)
    value, gradient = density.log_density_and_gradient(places + 0.02)
    assert value.shape == (4,)
    assert gradient.shape == (4, 2)
    assert np.all(gradient < 0.0)
