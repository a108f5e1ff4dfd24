"""Pose densities: integrals, gradients, sampling, contract."""

import tracemalloc

import numpy as np
import pytest

from drake_aerial.density.kernels import log_axis, log_gaussian, log_theta
from drake_aerial.density.pose_density import PoseDensity
from drake_aerial.errors import InputError
from drake_aerial.geometry import Pose, axis_of, quat_exp, quat_multiply, random_rotation


def make(rng, n=30, **options):
    poses = Pose(rng.uniform(-0.1, 0.1, (n, 3)) + [3.0, -2.0, 1.0], random_rotation(rng, n))
    options = {"sigma_p": 0.03, "sigma_q": 0.4} | options
    return PoseDensity(poses, rng.uniform(0.1, 1.0, n), **options)


@pytest.mark.parametrize("axial", [False, True])
def test_equals_the_sum_of_its_kernels(axial):
    rng = np.random.default_rng(0)
    density = make(rng, axial=axial)
    x = Pose(rng.uniform(-0.2, 0.2, (7, 3)) + [3.0, -2.0, 1.0], random_rotation(rng, 7))
    k = density.kernels_at
    if axial:
        rotation = log_axis(axis_of(x.q, 2)[:, None], axis_of(k.q, 2), 0.4)
    else:
        rotation = log_theta(x.q[:, None], k.q, 0.4)
    terms = np.log(density.weights) + log_gaussian(x.p[:, None], k.p, 0.03) + rotation
    np.testing.assert_allclose(
        density.log_density(x), np.logaddexp.reduce(terms, axis=1), rtol=1e-9, atol=1e-9
    )


@pytest.mark.parametrize(("axial", "measure"), [(False, 2 * np.pi**2), (True, 4 * np.pi)])
def test_integrates_to_one(axial, measure):
    # Importance sampling: positions from a box that holds all kernels, rotations uniform.
    rng = np.random.default_rng(1)
    density = make(rng, n=5, axial=axial, sigma_p=0.05, sigma_q=0.8)
    lower, upper = density.kernels_at.p.min(axis=0) - 0.2, density.kernels_at.p.max(axis=0) + 0.2
    x = Pose(rng.uniform(lower, upper, (400_000, 3)), random_rotation(rng, 400_000))
    values = np.exp(density.log_density(x)) * np.prod(upper - lower) * measure
    error = values.std() / np.sqrt(len(values))
    assert error < 0.02
    assert values.mean() == pytest.approx(1.0, abs=4 * error)


def test_is_antipodally_symmetric():
    rng = np.random.default_rng(2)
    density = make(rng)
    x = density.sample(50, rng)
    np.testing.assert_allclose(
        density.log_density(x), density.log_density(Pose(x.p, -x.q)), rtol=0, atol=1e-12
    )


@pytest.mark.parametrize("axial", [False, True])
def test_gradients_equal_finite_differences(axial):
    rng = np.random.default_rng(3)
    density = make(rng, axial=axial)
    x = density.sample(20, rng)
    value, g_p, g_q = density.log_density_and_gradient(x)
    np.testing.assert_allclose(value, density.log_density(x), rtol=1e-12)
    h = 1e-6
    for i, step in enumerate(h * np.eye(3)):
        difference = density.log_density(Pose(x.p + step, x.q)) - density.log_density(
            Pose(x.p - step, x.q)
        )
        np.testing.assert_allclose(g_p[:, i], difference / (2 * h), rtol=1e-5, atol=1e-4)
        plus, minus = quat_multiply(quat_exp(step), x.q), quat_multiply(quat_exp(-step), x.q)
        difference = density.log_density(Pose(x.p, plus)) - density.log_density(Pose(x.p, minus))
        np.testing.assert_allclose(g_q[:, i], difference / (2 * h), rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize("axial", [False, True])
def test_samples_follow_the_density(axial):
    # E[f / g] over samples of g is the integral of f: one, for a density f of narrower kernels.
    rng = np.random.default_rng(4)
    wide = make(rng, n=4, axial=axial, sigma_p=0.06, sigma_q=0.7)
    narrow = PoseDensity(wide.kernels_at, wide.weights, sigma_p=0.04, sigma_q=0.5, axial=axial)
    x = wide.sample(40_000, rng)
    ratio = np.exp(narrow.log_density(x) - wide.log_density(x))
    assert ratio.mean() == pytest.approx(1.0, abs=4 * ratio.std() / np.sqrt(len(ratio)))
    assert ratio.std() / np.sqrt(len(ratio)) < 0.02


def test_axial_density_ignores_turns_about_the_axis():
    rng = np.random.default_rng(5)
    density = make(rng, axial=True)
    x = density.sample(20, rng)
    turned = Pose(x.p, quat_multiply(x.q, quat_exp([0.0, 0.0, 1.3])))
    np.testing.assert_allclose(density.log_density(x), density.log_density(turned), atol=1e-9)


def test_same_generator_same_samples():
    density = make(np.random.default_rng(6))
    a, b = (density.sample(10, np.random.default_rng(7)) for _ in range(2))
    np.testing.assert_array_equal(a.p, b.p)
    np.testing.assert_array_equal(a.q, b.q)


@pytest.mark.parametrize("weights", [[0.0, 0.0], [1.0, -1.0], [1.0, np.nan], [1.0]])
def test_refuses_bad_weights(weights):
    with pytest.raises(InputError, match="weights"):
        PoseDensity(Pose(np.zeros((2, 3)), np.eye(4)[:2]), weights, sigma_p=0.1, sigma_q=0.1)


def test_memory_is_bounded_however_many_poses():
    rng = np.random.default_rng(8)
    density = make(rng, n=1000, axial=True)
    x = Pose(rng.normal(size=(20_000, 3)), random_rotation(rng, 20_000))
    tracemalloc.start()
    density.log_density(x)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # All pairs at once would be 20,000 x 1000 x 8 bytes = 160 MB an array.
    assert peak < 80e6


def test_single_precision_is_close():
    rng = np.random.default_rng(9)
    poses = Pose(rng.uniform(-0.5, 0.5, (200, 3)), random_rotation(rng, 200))
    exact, single = (
        PoseDensity(poses, sigma_p=0.02, sigma_q=0.26, axial=True, single=s) for s in (False, True)
    )
    x = exact.sample(500, rng)
    np.testing.assert_allclose(single.log_density(x), exact.log_density(x), atol=5e-3)


@pytest.mark.parametrize("single", [False, True])
def test_the_number_of_cores_makes_no_difference(monkeypatch, single):
    rng = np.random.default_rng(8)
    density = make(rng, n=1500, single=single)
    x = density.sample(501, rng)
    values = []
    for cores in ("1", "3"):
        monkeypatch.setenv("OMP_NUM_THREADS", cores)
        values.append(density.log_density(x))
    np.testing.assert_array_equal(values[0], values[1])


@pytest.mark.parametrize("axial", [False, True])
def test_far_from_the_origin_no_digits_are_lost(axial):
    rng = np.random.default_rng(10)
    near = make(rng, axial=axial)
    k, shift = near.kernels_at, np.array([1e4, -1e4, 1e4])
    far = PoseDensity(Pose(k.p + shift, k.q), near.weights, sigma_p=0.03, sigma_q=0.4, axial=axial)
    x = near.sample(30, rng)
    moved = Pose(x.p + shift, x.q)
    np.testing.assert_allclose(far.log_density(moved), near.log_density(x), rtol=0, atol=1e-7)
    for got, expected in zip(far.log_density_and_gradient(moved), near.log_density_and_gradient(x)):
        np.testing.assert_allclose(got, expected, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("axial", [False, True])
def test_other_weights_of_the_same_kernels(axial):
    rng = np.random.default_rng(11)
    density = make(rng, axial=axial)
    columns = rng.uniform(0.0, 1.0, (30, 3))
    x = density.sample(10, rng)
    grid = Pose(x.p.reshape(2, 5, 3), x.q.reshape(2, 5, 4))
    got = density.log_densities(grid, columns)
    assert got.shape == (2, 5, 3)
    for m in range(3):
        alone = PoseDensity(
            density.kernels_at, columns[:, m], sigma_p=0.03, sigma_q=0.4, axial=axial
        )
        # Columns are taken as they are, a density's weights are scaled.
        np.testing.assert_allclose(
            got[..., m], alone.log_density(grid) + np.log(columns[:, m].sum()), rtol=1e-9
        )
    for got, flat in zip(
        density.log_density_and_gradient(grid), density.log_density_and_gradient(x)
    ):
        np.testing.assert_array_equal(got.reshape(flat.shape), flat)
        assert got.shape[:2] == (2, 5)


def test_samples_have_the_bandwidths_of_their_kernel():
    rng = np.random.default_rng(12)
    centre = Pose(np.array([[1.0, -2.0, 0.5]]), random_rotation(rng, 1))
    for axial in (False, True):
        x = PoseDensity(centre, sigma_p=0.03, sigma_q=0.1, axial=axial).sample(20_000, rng)
        np.testing.assert_allclose(x.p.mean(axis=0), centre.p[0], atol=1e-3)
        np.testing.assert_allclose(x.p.std(axis=0), 0.03, rtol=0.03)
        tilt = np.arccos(np.clip(axis_of(x.q, 2) @ axis_of(centre.q[0], 2), -1.0, 1.0))
        assert np.sqrt(np.mean(tilt**2)) == pytest.approx(0.1 * np.sqrt(2.0), rel=0.03)
    # About the axis an axial sample is turned by any angle.
    x_axis = axis_of(x.q, 0)
    angle = np.arctan2(x_axis @ axis_of(centre.q[0], 1), x_axis @ axis_of(centre.q[0], 0))
    counts = np.histogram(angle, 8, (-np.pi, np.pi))[0]
    np.testing.assert_allclose(counts / 20_000, 1 / 8, atol=0.012)
