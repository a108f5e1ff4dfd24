"""Query densities: what normalisation removes, what resampling keeps, and when there is nothing to find."""

import numpy as np
import pytest
from box_scans import box_cloud, box_demonstration

from drake_aerial.errors import JobError
from drake_aerial.geometry import Pose, axis_of
from drake_aerial.learning.hull import HorizontalHull
from drake_aerial.learning.learn import learn
from drake_aerial.perception.point_cloud import PointCloud
from drake_aerial.perception.surface_features import compute_features
from drake_aerial.transferring.cuts import Cuts
from drake_aerial.transferring.hull_votes import HullVotes
from drake_aerial.transferring.parameters import TransferParameters
from drake_aerial.transferring.query_density import NormalisedQuery, ResampledQuery, draw_candidates

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


def test_normalised_density_does_not_see_how_densely_a_surface_was_sampled():
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


def votes(skill, features, **options):
    hull = HorizontalHull.of_points(features.p)
    parameters = TransferParameters(**options)
    return HullVotes(skill, features, hull, Cuts.none(), "support", parameters, np.random.default_rng(4))


def test_votes_agree_on_the_middle(skill, features):
    found = votes(skill, features)
    assert len(found.positions) == len(found.weights) == 50 * 1000
    np.testing.assert_allclose(found.density.mode, [0.0, 0.0], atol=0.02)


def test_votes_that_are_all_zero_are_an_error():
    # A top view's rims, strictly compared, resemble nothing on a smooth ball.
    top = learn(box_demonstration(SIZE, view="top"))
    rng = np.random.default_rng(5)
    v = rng.standard_normal((20_000, 3))
    ball = 0.15 * v / np.linalg.norm(v, axis=1, keepdims=True)
    smooth = compute_features(PointCloud.read(ball))
    with pytest.raises(JobError, match="votes are zero"):
        votes(top, smooth, vote_descriptor=0.1)
