"""Surface densities: integrals, samples, conditionals, shapes, bandwidths."""

import numpy as np
import pytest

from drake_aerial.density.kernels import log_gaussian, log_theta
from drake_aerial.density.surface_density import Bandwidth, SurfaceDensity
from drake_aerial.geometry import Pose, random_rotation

WIDE = Bandwidth(position=0.05, rotation=0.8, descriptor=0.3)


def make(rng, n=6, bandwidth=WIDE):
    pose = Pose(rng.uniform(-0.1, 0.1, (n, 3)) + [1.0, 2.0, 3.0], random_rotation(rng, n))
    return SurfaceDensity(
        pose, rng.normal(size=(n, 2)), rng.uniform(0.1, 1.0, n), bandwidth=bandwidth
    )


def test_integrates_to_one():
    rng = np.random.default_rng(0)
    density = make(rng, n=3)
    lower = np.concatenate(
        [density.pose.p.min(axis=0) - 0.18, density.descriptor.min(axis=0) - 1.0]
    )
    upper = np.concatenate(
        [density.pose.p.max(axis=0) + 0.18, density.descriptor.max(axis=0) + 1.0]
    )
    x = rng.uniform(lower, upper, (600_000, 5))
    values = np.exp(density.log_density(Pose(x[:, :3], random_rotation(rng, len(x))), x[:, 3:]))
    values *= np.prod(upper - lower) * 2 * np.pi**2
    error = values.std() / np.sqrt(len(values))
    assert error < 0.03
    assert values.mean() == pytest.approx(1.0, abs=4 * error)


def test_samples_follow_the_density():
    rng = np.random.default_rng(2)
    wide = make(rng, n=4)
    narrow = SurfaceDensity(
        wide.pose, wide.descriptor, wide.weights, bandwidth=Bandwidth(0.035, 0.6, 0.22)
    )
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
    np.testing.assert_allclose(
        np.bincount(drawn, minlength=3) / 20_000, expected / expected.sum(), atol=0.015
    )


def one_by_one(density, x, r):
    b, k = density.bandwidth, density.pose
    position, rotation = (
        log_gaussian(x.p[:, None], k.p, b.position),
        log_theta(x.q[:, None], k.q, b.rotation),
    )
    terms = (
        np.log(density.weights)
        + position
        + rotation
        + log_gaussian(r[:, None], density.descriptor, b.descriptor)
    )
    return np.logaddexp.reduce(terms, axis=1)


@pytest.mark.parametrize("place", [0.0, 1e4])
def test_equals_the_sum_of_its_kernels_anywhere(place):
    # Far from the origin squares of coordinates would lose what tells the kernels apart.
    rng = np.random.default_rng(5)
    near = make(rng, bandwidth=Bandwidth(0.03, 0.4, 0.2))
    density = SurfaceDensity(
        Pose(near.pose.p + place, near.pose.q),
        near.descriptor,
        7.0 * near.weights,
        bandwidth=near.bandwidth,
    )
    assert len(density) == 6
    np.testing.assert_allclose(density.weights.sum(), 1.0)
    x, r = density.sample(30, rng)
    x = Pose(x.p + 0.05 * rng.standard_normal((30, 3)), x.q)
    np.testing.assert_allclose(
        density.log_density(x, r), one_by_one(density, x, r), rtol=1e-9, atol=1e-8
    )


def test_shapes_are_those_of_the_points():
    rng = np.random.default_rng(6)
    density = make(rng)
    x, r = density.sample(6, rng)
    grid, places = Pose(x.p.reshape(2, 3, 3), x.q.reshape(2, 3, 4)), r.reshape(2, 3, 2)
    np.testing.assert_array_equal(
        density.log_density(grid, places).ravel(), density.log_density(x, r)
    )
    assert density.log_density(grid, places).shape == (2, 3)
    np.testing.assert_array_equal(
        density.log_descriptor_density(places).ravel(), density.log_descriptor_density(r)
    )
    assert density.log_descriptor_density(r[0]).shape == ()


def test_the_descriptors_marginal_is_the_sum_of_its_gaussians():
    rng = np.random.default_rng(7)
    density, r = make(rng), rng.normal(size=(50, 2))
    terms = np.log(density.weights) + log_gaussian(r[:, None], density.descriptor, 0.3)
    np.testing.assert_allclose(
        density.log_descriptor_density(r), np.logaddexp.reduce(terms, axis=1), rtol=1e-9
    )


def test_samples_have_the_bandwidths_of_their_kernel():
    rng = np.random.default_rng(8)
    centre = Pose(np.array([[1.0, -2.0, 0.5]]), random_rotation(rng, 1))
    density = SurfaceDensity(centre, [[0.7, -0.4]], bandwidth=Bandwidth(0.03, 0.1, 0.2))
    x, r = density.sample(20_000, rng)
    np.testing.assert_allclose(x.p.mean(axis=0), centre.p[0], atol=1e-3)
    np.testing.assert_allclose(x.p.std(axis=0), 0.03, rtol=0.03)
    np.testing.assert_allclose(r.mean(axis=0), [0.7, -0.4], atol=6e-3)
    np.testing.assert_allclose(r.std(axis=0), 0.2, rtol=0.03)
    # The dot product of quaternions at an angle t is cos(t / 2); three axes of 0.1 rad each.
    angle = 2.0 * np.arccos(np.clip(np.abs(x.q @ centre.q[0]), 0.0, 1.0))
    assert np.sqrt(np.mean(angle**2)) == pytest.approx(0.1 * np.sqrt(3.0), rel=0.03)


def test_kernels_of_no_weight_are_never_drawn():
    rng = np.random.default_rng(9)
    pose = Pose(np.zeros((4, 3)), np.tile([1.0, 0, 0, 0], (4, 1)))
    density = SurfaceDensity(pose, np.zeros((4, 2)), [0.0, 1.0, 3.0, 0.0])
    drawn = density.sample_kernels(np.zeros((8000, 2)), rng)
    np.testing.assert_allclose(
        np.bincount(drawn, minlength=4) / 8000, [0, 0.25, 0.75, 0], atol=0.02
    )


def test_default_bandwidths_are_those_of_the_documents():
    b = Bandwidth()
    assert (b.position, b.descriptor) == (0.02, 0.2)
    assert np.rad2deg(b.rotation) == pytest.approx(15.0)
    assert SurfaceDensity(Pose(np.zeros((1, 3)), np.eye(4)[:1]), [[0.0, 0.0]]).bandwidth == b
