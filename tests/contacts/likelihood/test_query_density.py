"""Query densities: normalised and resampled ones, their candidates, and their errors."""

import numpy as np
import pytest

from drake_aerial.contacts.likelihood.query_density import (
    NormalisedQuery,
    ResampledQuery,
    draw_candidates,
)
from drake_aerial.density.kernels import log_axis, log_gaussian, log_theta
from drake_aerial.errors import JobError
from drake_aerial.features.surface_features import compute_features
from drake_aerial.geometry import Pose, axis_of, quat_exp, quat_multiply, random_rotation
from drake_aerial.skill.learn import learn
from tests.contacts.box_scans import box_cloud, box_demonstration

SIZE = [0.68, 0.61, 0.28]


@pytest.fixture(scope="module")
def skill():
    return learn(box_demonstration(SIZE))


@pytest.fixture(scope="module")
def features():
    return compute_features(box_cloud([0.5, 0.4, 0.3], seed=1))


def plane(n, rng):
    """Poses on a plane, axes up, three times denser on its right half."""
    x = rng.uniform(-0.5, 0.5, n)
    x = np.where((x < 0.0) & (rng.random(n) < 0.5), -x, x)
    p = np.column_stack([x, rng.uniform(-0.5, 0.5, n), np.zeros(n)])
    return Pose(p, np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)))


def test_normalised_density_does_not_depend_on_how_densely_a_surface_was_sampled():
    rng = np.random.default_rng(0)
    candidates = plane(8000, rng)
    uniform = np.zeros(8000)
    at = Pose(np.array([[-0.25, 0.0, 0.0], [0.25, 0.0, 0.0]]), np.tile([1.0, 0, 0, 0], (2, 1)))
    normalised = NormalisedQuery(candidates, uniform, 0.02, 0.26, True, 0.1).log_density(at)
    resampled = ResampledQuery(candidates, uniform, 4000, 0.02, 0.26, True, rng).log_density(at)
    # What is left is the floor's: d0 is a tenth of the denser half's D, and 0.3 of the other's.
    assert normalised[1] - normalised[0] == pytest.approx(np.log(1.3 / 1.1), abs=0.1)
    assert resampled[1] - resampled[0] == pytest.approx(np.log(3.0), abs=0.35)


def test_normalised_density_is_the_mean_weight_nearby():
    rng = np.random.default_rng(1)
    candidates = plane(8000, rng)
    weights = np.where(candidates.p[:, 1] > 0.0, 0.0, np.log(0.2))
    at = Pose(np.array([[0.2, 0.3, 0.0], [0.2, -0.3, 0.0]]), np.tile([1.0, 0, 0, 0], (2, 1)))
    c = NormalisedQuery(candidates, weights, 0.02, 0.26, True, 1e-6).log_density(at)
    np.testing.assert_allclose(np.exp(c), [1.0, 0.2], rtol=1e-3)


def test_single_precision_is_close(skill, features):
    rng = np.random.default_rng(2)
    candidates, weights = draw_candidates(skill, 0, features, 800, rng)
    query = NormalisedQuery(candidates, weights, 0.02, 0.26, True, 0.1)
    exact, coarse = query.log_density(candidates), query.log_density(candidates, coarse=True)
    np.testing.assert_allclose(coarse, exact, atol=5e-3)


def test_candidates_like_the_contact_lie_flat_on_faces(skill, features):
    candidates, weights = draw_candidates(skill, 0, features, 4000, np.random.default_rng(3))
    best = candidates.take(np.flatnonzero(weights >= np.quantile(weights, 0.7)))
    # Demonstrated on a flat face: along a face's normal, on the face, away from edges.
    outward = np.abs(axis_of(best.q, 2)).max(axis=1)
    assert np.quantile(outward, 0.1) > 0.99
    assert np.quantile(np.abs(best.p / [0.25, 0.2, 0.15]).max(axis=1), 0.1) > 0.95


def scattered(rng, count=60):
    X = Pose(rng.uniform(-0.06, 0.06, (count, 3)), random_rotation(rng, count))
    return X, rng.uniform(-4.0, 1.0, count)


@pytest.mark.parametrize("axial", [True, False])
def test_normalised_density_is_its_formula(axial):
    rng = np.random.default_rng(6)
    candidates, log_weights = scattered(rng, 61)  # an odd number has a median of its own
    query = NormalisedQuery(candidates, log_weights, 0.03, 0.5, axial, 0.2)

    def kernels_at(x):
        if axial:
            rotation = log_axis(axis_of(x.q, 2)[:, None], axis_of(candidates.q, 2), 0.5)
        else:
            rotation = log_theta(x.q[:, None], candidates.q, 0.5)
        return np.exp(log_gaussian(x.p[:, None], candidates.p, 0.03) + rotation)

    contact = np.exp(log_weights - log_weights.max())
    floor = 0.2 * np.median(kernels_at(candidates).mean(axis=1))
    x = Pose(candidates.p + 0.04 * rng.standard_normal((61, 3)), random_rotation(rng, 61))
    expected = (kernels_at(x) * contact).mean(axis=1) / (kernels_at(x).mean(axis=1) + floor)
    np.testing.assert_allclose(np.exp(query.log_density(x)), expected, rtol=1e-9)
    assert expected.min() < 0.1 * expected.max()
    value, *_ = query.log_density_and_gradient(x)
    np.testing.assert_allclose(np.exp(value), expected, rtol=1e-9)
    # No place is more alike than the best candidate.
    assert query.log_density(x).max() < 0.0


@pytest.mark.parametrize("axial", [True, False])
@pytest.mark.parametrize("kind", ["normalised", "resampled"])
def test_gradients_equal_finite_differences(kind, axial):
    rng = np.random.default_rng(7)
    candidates, log_weights = scattered(rng)
    if kind == "normalised":
        query = NormalisedQuery(candidates, log_weights, 0.03, 0.5, axial, 0.2)
    else:
        query = ResampledQuery(candidates, log_weights, 40, 0.03, 0.5, axial, rng)
    x = Pose(candidates.p + 0.04 * rng.standard_normal((60, 3)), random_rotation(rng, 60))
    value, by_p, by_w = query.log_density_and_gradient(x)
    np.testing.assert_allclose(value, query.log_density(x), rtol=1e-9, atol=1e-9)
    h = 1e-6
    for i, step in enumerate(h * np.eye(3)):
        difference = query.log_density(Pose(x.p + step, x.q)) - query.log_density(
            Pose(x.p - step, x.q)
        )
        np.testing.assert_allclose(by_p[:, i], difference / (2 * h), rtol=1e-5, atol=1e-4)
        plus, minus = quat_multiply(quat_exp(step), x.q), quat_multiply(quat_exp(-step), x.q)
        difference = query.log_density(Pose(x.p, plus)) - query.log_density(Pose(x.p, minus))
        np.testing.assert_allclose(by_w[:, i], difference / (2 * h), rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize("kind", ["normalised", "resampled"])
def test_coarse_is_single_precision(kind):
    rng = np.random.default_rng(8)
    candidates, log_weights = scattered(rng)
    if kind == "normalised":
        query = NormalisedQuery(candidates, log_weights, 0.03, 0.5, True, 0.2)
    else:
        query = ResampledQuery(candidates, log_weights, 40, 0.03, 0.5, True, rng)
    error = np.abs(query.log_density(candidates, coarse=True) - query.log_density(candidates))
    assert 1e-9 < error.max() < 1e-3


def test_resampling_draws_candidates_by_their_weights():
    candidates = plane(4, np.random.default_rng(9))
    query = ResampledQuery(
        candidates,
        np.log([1.0, 2.0, 3.0, 4.0]) - 900.0,
        1000,
        0.02,
        0.26,
        True,
        np.random.default_rng(0),
    )
    assert len(query.candidates.p) == 1000
    counts = [(query.candidates.p == p).all(axis=1).sum() for p in candidates.p]
    np.testing.assert_allclose(counts, [100, 200, 300, 400], atol=1)


def test_candidates_are_weighed_by_both_models_of_their_feature(skill, features):
    same = features.take(np.full(50, 7))
    _, weights = draw_candidates(skill, 0, same, 20, np.random.default_rng(10))
    assert len(weights) == 20
    r = same.r[0]
    contact, surface = skill.contacts[0].density, skill.objects[0].density
    expected = contact.log_descriptor_density(r) + surface.log_descriptor_density(r)
    np.testing.assert_allclose(weights, expected, rtol=1e-12)


def test_features_are_drawn_evenly_over_the_surface(skill, features):
    rng = np.random.default_rng(11)
    marked = features.take(np.flatnonzero(np.abs(features.p[:, 2]) < 0.1))
    upper = np.mean(marked.p[:, 2] > 0.0)
    candidates, _ = draw_candidates(skill, 0, marked, 4000, rng)
    assert np.mean(candidates.p[:, 2] > 0.0) == pytest.approx(upper, abs=0.03)


@pytest.mark.parametrize(("bandwidths", "found"), [(7.0, True), (8.5, False)])
def test_what_is_curved_otherwise_does_not_resemble_the_contact(skill, features, bandwidths, found):
    few = features.take(np.arange(30))
    contact = skill.contacts[0].density
    top = contact.descriptor.max(axis=0)
    few.r[:] = top + [bandwidths * contact.bandwidth.descriptor, 0.0]
    if found:
        assert len(draw_candidates(skill, 0, few, 10, np.random.default_rng(12))[1]) == 10
    else:
        with pytest.raises(JobError, match="contact density of gripper 1 is zero"):
            draw_candidates(skill, 0, few, 10, np.random.default_rng(12))


def test_one_feature_that_resembles_the_contact_is_enough(skill, features):
    few = features.take(np.arange(30))
    contact = skill.contacts[0].density
    few.r[:] = contact.descriptor.max(axis=0) + 9.0 * contact.bandwidth.descriptor
    few.r[11] = contact.descriptor[0]
    _, weights = draw_candidates(skill, 0, few, 300, np.random.default_rng(13))
    # A thirtieth of the draws; all the others weigh next to nothing.
    assert np.sum(weights > weights.max() - 5.0) == pytest.approx(10, abs=1)
