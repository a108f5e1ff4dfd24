"""The votes' density on a grid, against the direct sum of Gaussians."""

import numpy as np
import pytest

from drake_aerial.transferring.grid_density import GridDensity


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
    np.testing.assert_allclose(np.exp(density.log_density(x)), expected, rtol=0.05, atol=0.03 * expected.max())


def test_gradient_equals_finite_differences():
    rng = np.random.default_rng(1)
    votes = np.column_stack([rng.uniform(-0.2, 0.2, (100, 2)), rng.uniform(0, 2 * np.pi, 100)])
    upper = [0.2, 0.2, 2 * np.pi]
    density = GridDensity(votes, np.ones(100), [0.05, 0.05, 0.35], [-0.2, -0.2, 0.0], upper, [False, False, True])
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
    density = GridDensity(np.zeros((1, 2)), np.ones(1), [0.05, 0.05], [-1, -1], [1, 1], [False, False])
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
