"""Surface densities: integrals, gradients, conditionals."""

import numpy as np
import pytest

from drake_aerial.density.surface_density import Bandwidth, SurfaceDensity
from drake_aerial.geometry import Pose, quat_exp, quat_multiply, random_rotation

WIDE = Bandwidth(position=0.05, rotation=0.8, descriptor=0.3)


def make(rng, n=6, bandwidth=WIDE):
    pose = Pose(rng.uniform(-0.1, 0.1, (n, 3)) + [1.0, 2.0, 3.0], random_rotation(rng, n))
    return SurfaceDensity(pose, rng.normal(size=(n, 2)), rng.uniform(0.1, 1.0, n), bandwidth=bandwidth)


def test_integrates_to_one():
    rng = np.random.default_rng(0)
    density = make(rng, n=3)
    lower = np.concatenate([density.pose.p.min(axis=0) - 0.18, density.descriptor.min(axis=0) - 1.0])
    upper = np.concatenate([density.pose.p.max(axis=0) + 0.18, density.descriptor.max(axis=0) + 1.0])
    x = rng.uniform(lower, upper, (600_000, 5))
    values = np.exp(density.log_density(Pose(x[:, :3], random_rotation(rng, len(x))), x[:, 3:]))
    values *= np.prod(upper - lower) * 2 * np.pi**2
    error = values.std() / np.sqrt(len(values))
    assert error < 0.03
    assert values.mean() == pytest.approx(1.0, abs=4 * error)


def test_gradients_equal_finite_differences():
    rng = np.random.default_rng(1)
    density = make(rng, n=20, bandwidth=Bandwidth(0.03, 0.4, 0.2))
    x, r = density.sample(15, rng)
    value, g_p, g_q, g_r = density.log_density_and_gradient(x, r)
    np.testing.assert_allclose(value, density.log_density(x, r), rtol=1e-12)
    h = 1e-6
    for i, step in enumerate(h * np.eye(3)):
        difference = density.log_density(Pose(x.p + step, x.q), r) - density.log_density(Pose(x.p - step, x.q), r)
        np.testing.assert_allclose(g_p[:, i], difference / (2 * h), rtol=1e-5, atol=1e-4)
        plus, minus = quat_multiply(quat_exp(step), x.q), quat_multiply(quat_exp(-step), x.q)
        difference = density.log_density(Pose(x.p, plus), r) - density.log_density(Pose(x.p, minus), r)
        np.testing.assert_allclose(g_q[:, i], difference / (2 * h), rtol=1e-5, atol=1e-4)
    for i, step in enumerate(h * np.eye(2)):
        difference = density.log_density(x, r + step) - density.log_density(x, r - step)
        np.testing.assert_allclose(g_r[:, i], difference / (2 * h), rtol=1e-5, atol=1e-4)


def test_samples_follow_the_density():
    rng = np.random.default_rng(2)
    wide = make(rng, n=4)
    narrow = SurfaceDensity(wide.pose, wide.descriptor, wide.weights, bandwidth=Bandwidth(0.035, 0.6, 0.22))
    x, r = wide.sample(40_000, rng)
    ratio = np.exp(narrow.log_density(x, r) - wide.log_density(x, r))
    assert ratio.std() / np.sqrt(len(ratio)) < 0.03
    assert ratio.mean() == pytest.approx(1.0, abs=4 * ratio.std() / np.sqrt(len(ratio)))


def test_descriptor_marginal_integrates_to_one_and_is_antipodal():
    rng = np.random.default_rng(3)
    density = make(rng)
    grid = np.stack(np.meshgrid(*[np.linspace(-6, 6, 401)] * 2, indexing="ij"), axis=-1)
    total = np.exp(density.log_descriptor_density(grid)).sum() * (12 / 400) ** 2
    assert total == pytest.approx(1.0, abs=1e-6)
    x, r = density.sample(10, rng)
    flipped = density.log_density(Pose(x.p, -x.q), r)
    np.testing.assert_allclose(density.log_density(x, r), flipped, atol=1e-12)


def test_kernels_are_drawn_by_their_likelihood_of_the_descriptor():
    rng = np.random.default_rng(4)
    density = make(rng, n=3)
    r = np.array([0.3, -0.2])
    square = np.sum((density.descriptor - r) ** 2, axis=1)
    expected = density.weights * np.exp(-square / (2 * 0.3**2))
    drawn = density.sample_kernels(np.broadcast_to(r, (20_000, 2)), rng)
    np.testing.assert_allclose(np.bincount(drawn, minlength=3) / 20_000, expected / expected.sum(), atol=0.015)
