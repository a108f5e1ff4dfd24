"""Kernels against independent integrals, symmetries and moments."""

import numpy as np
import pytest
from scipy.integrate import quad

from drake_aerial.density import kernels
from drake_aerial.geometry import quat_about_axis, quat_log, quat_multiply, random_rotation

SIGMAS = np.deg2rad([5.0, 15.0, 40.0, 90.0])


@pytest.mark.parametrize("sigma", SIGMAS)
def test_theta_integrates_to_one_over_the_sphere(sigma):
    # On S^3, at angle t from the centre, a shell has the area 4 pi sin^2 t.
    mu = np.array([1.0, 0.0, 0.0, 0.0])

    def shell(t):
        q = np.array([np.cos(t), np.sin(t), 0.0, 0.0])
        return 4.0 * np.pi * np.sin(t) ** 2 * np.exp(kernels.log_theta(q, mu, sigma))

    total = quad(shell, 0.0, np.pi / 2)[0] + quad(shell, np.pi / 2, np.pi)[0]
    assert total == pytest.approx(1.0, abs=1e-7)


def test_theta_integrates_to_one_by_monte_carlo():
    rng = np.random.default_rng(0)
    q, mu = random_rotation(rng, 400_000), random_rotation(rng)
    values = np.exp(kernels.log_theta(q, mu, np.deg2rad(40.0)))
    error = values.std() / np.sqrt(len(values))
    assert abs(2.0 * np.pi**2 * values.mean() - 1.0) < 4.0 * 2.0 * np.pi**2 * error
    assert 2.0 * np.pi**2 * error < 0.01


@pytest.mark.parametrize("sigma", SIGMAS)
def test_axial_kernel_integrates_to_one_over_the_sphere(sigma):
    mu = np.array([0.0, 0.0, 1.0])

    def ring(t):
        z = np.array([np.sin(t), 0.0, np.cos(t)])
        return 2.0 * np.pi * np.sin(t) * np.exp(kernels.log_axis(z, mu, sigma))

    assert quad(ring, 0.0, np.pi / 2)[0] + quad(ring, np.pi / 2, np.pi)[0] == pytest.approx(
        1.0, abs=1e-7
    )


def test_theta_is_antipodally_symmetric():
    rng = np.random.default_rng(1)
    q, mu = random_rotation(rng, 100), random_rotation(rng, 100)
    there = kernels.log_theta(q, mu, 0.3)
    np.testing.assert_array_equal(there, kernels.log_theta(-q, mu, 0.3))
    np.testing.assert_array_equal(there, kernels.log_theta(q, -mu, 0.3))
    assert np.ptp(there) > 10.0


def test_gaussian_is_the_product_of_its_components():
    rng = np.random.default_rng(2)
    x, mu = rng.normal(size=(5, 3)), rng.normal(size=(5, 3))
    one = np.exp(-((x - mu) ** 2) / (2 * 0.7**2)) / np.sqrt(2 * np.pi * 0.7**2)
    np.testing.assert_allclose(
        np.exp(kernels.log_gaussian(x, mu, 0.7)), one.prod(axis=1), rtol=1e-12
    )


def test_bandwidth_is_the_angle_of_the_rotation_vector():
    # Small bandwidths: each component of the rotation vector is Gaussian with the given deviation.
    rng, sigma = np.random.default_rng(3), np.deg2rad(5.0)
    mu = np.broadcast_to(random_rotation(rng), (40_000, 4))
    q = kernels.sample_theta(mu, sigma, rng)
    w = quat_log(quat_multiply(q, mu * [1, -1, -1, -1]))
    np.testing.assert_allclose(w.std(axis=0), sigma, rtol=0.02)
    np.testing.assert_allclose(np.cov(w.T)[np.triu_indices(3, 1)], 0.0, atol=2e-4)
    z = kernels.sample_axis(np.broadcast_to([0.0, 0.0, 1.0], (40_000, 3)), sigma, rng)
    np.testing.assert_allclose(z[:, :2].std(axis=0), sigma, rtol=0.02)


@pytest.mark.parametrize("sigma", SIGMAS)
def test_theta_samples_follow_the_density(sigma):
    # The distribution of the angle to the centre, against the integral of the density.
    rng = np.random.default_rng(4)
    mu = np.array([1.0, 0.0, 0.0, 0.0])
    q = kernels.sample_theta(np.broadcast_to(mu, (20_000, 4)), sigma, rng)
    angle = np.arccos(np.clip(np.abs(q[:, 0]), 0.0, 1.0))
    for t in np.quantile(angle, [0.2, 0.5, 0.8]):
        expected = quad(
            lambda a: (
                8.0
                * np.pi
                * np.sin(a) ** 2
                * np.exp(kernels.log_theta(np.array([np.cos(a), np.sin(a), 0, 0]), mu, sigma))
            ),
            0.0,
            t,
        )[0]
        assert np.mean(angle < t) == pytest.approx(expected, abs=0.012)
    assert np.mean(q[:, 0] > 0.0) == pytest.approx(0.5, abs=0.015)


@pytest.mark.parametrize("sigma", SIGMAS)
def test_axis_samples_follow_the_density(sigma):
    rng, mu = np.random.default_rng(5), np.array([0.6, 0.0, 0.8])
    z = kernels.sample_axis(np.broadcast_to(mu, (20_000, 3)), sigma, rng)
    np.testing.assert_allclose(np.linalg.norm(z, axis=1), 1.0, atol=1e-12)
    # Langevin's mean of the cosine.
    kappa = 1.0 / sigma**2
    assert np.mean(z @ mu) == pytest.approx(1.0 / np.tanh(kappa) - 1.0 / kappa, abs=0.012)


def test_turned_to_axis_keeps_the_rest_of_the_frame():
    rng = np.random.default_rng(6)
    q = random_rotation(rng, 50)
    tilt = quat_about_axis(np.broadcast_to([1.0, 0.0, 0.0], (50, 3)), np.full(50, 0.1))
    z = np.array([kernels.axis_of(quat_multiply(t, f), 2) for t, f in zip(tilt, q)])
    turned = kernels.turned_to_axis(q, z)
    np.testing.assert_allclose(kernels.axis_of(turned, 2), z, atol=1e-12)
    assert np.all(2 * np.arccos(np.clip(np.abs(np.sum(turned * q, axis=1)), 0, 1)) <= 0.1 + 1e-6)
