"""Height profiles of objects with several levels, and the heights of formations on them."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.likelihood.contact_likelihood import ContactLikelihood
from drake_aerial.contacts.likelihood.formation_frame import FormationFrames
from drake_aerial.contacts.refinement.likelihood_factors import ConfigurationFactor
from drake_aerial.contacts.transfer import transfer
from drake_aerial.contacts.votes.height_profile import HeightProfile
from drake_aerial.geometry import Pose, quat_exp, quat_multiply
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn
from tests.contacts.box_scans import box_cloud, box_demonstration
from tests.contacts.formations import FAST, SIZE, learnt_skill, transferred


def two_levels(low, high, seed):
    """Return a parcel of 68 x 68 cm on z = 0: `high` metres at positive x, else `low` metres."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-0.34, 0.34, (9000, 2))
    top = np.column_stack([xy, np.where(xy[:, 0] > 0.0, high, low)])
    walls = []
    for axis, sign in ((0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0)):
        wall = rng.uniform(-0.34, 0.34, (4000, 3))
        wall[:, axis] = 0.34 * sign
        wall[:, 2] = rng.uniform(0.0, high, 4000)
        walls.append(wall[wall[:, 2] < np.where(wall[:, 0] > 0.0, high, low)])
    riser = np.column_stack(
        [np.zeros(3000), rng.uniform(-0.34, 0.34, 3000), rng.uniform(low, high, 3000)]
    )
    points = np.vstack([top, *walls, riser])
    return PointCloud.read(points + 0.0005 * rng.standard_normal(points.shape))


@cache
def profile(low, high):
    return HeightProfile.of_points(two_levels(low, high, 0).points, 0.03)


def test_height_of_levels_is_found_and_walls_do_not_count():
    height = profile(0.2, 0.3).height
    np.testing.assert_allclose(np.unique(np.round(height, 2)), [-0.05, 0.05], atol=0.011)
    assert np.abs(HeightProfile.of_points(box_cloud(SIZE).points, 0.03).height).max() < 0.005


def test_a_sparse_scan_of_a_flat_box_is_flat():
    # 20,000 points at random on 4.2 square metres, the bottom included.
    rng = np.random.default_rng(0)
    size = np.array([1.4, 1.0, 0.3])
    points = rng.uniform(-0.5, 0.5, (20000, 3))
    areas = np.array([0.3, 0.42, 1.4])
    axis = rng.choice(3, 20000, p=areas / areas.sum())
    points[np.arange(20000), axis] = rng.choice([-0.5, 0.5], 20000)
    assert np.abs(HeightProfile.of_points(points * size, 0.03).height).max() < 0.01


def test_levels_stretch_by_their_ratio_and_leave_no_residual():
    stretch, residual = profile(0.2, 0.4).stretch_from(profile(0.2, 0.3), 1.0, 0.005)
    assert stretch == pytest.approx(2.0, rel=0.05)
    assert residual < 0.01
    # The demonstrated object has no levels: the residual is half a step each way.
    flat = HeightProfile(np.zeros(49))
    stretch, residual = profile(0.2, 0.4).stretch_from(flat, 1.3, 0.03)
    assert stretch == pytest.approx(1.3)
    assert residual == pytest.approx(0.1, abs=0.01)


def test_a_flat_object_changes_nothing():
    learnt, used = learnt_skill(3).configuration, transferred(3).query.likelihood.configuration
    assert used.vertical == pytest.approx(1.0, abs=0.01)
    np.testing.assert_allclose(used.X_FG.p, learnt.X_FG.p, atol=1e-3)
    np.testing.assert_allclose(used.cable_direction, learnt.cable_direction, atol=1e-9)


def test_a_formation_demonstrated_on_one_level_stands_upright_on_two():
    three = np.array([[0.22, 0.0, 0.14], [-0.14, 0.2, 0.14], [-0.14, -0.2, 0.14]])
    skill = learn(Demonstration.make(box_cloud(SIZE, seed=100), three, name="three"))
    best = transfer(skill, two_levels(0.28, 0.48, 1), parameters=FAST)[0]
    assert best.feasible
    assert best.normal[:, 2].min() > 0.95
    np.testing.assert_allclose(
        np.sort(np.unique(np.round(best.X_SG.p[:, 2], 2))), [0.28, 0.48], atol=0.011
    )


def test_heights_weigh_as_their_bandwidth_says():
    model = learnt_skill(3).configuration
    loose = model.with_heights(1.0, 0.25)
    at = model.demonstrated_at(np.zeros(3), np.zeros(()))
    up = Pose(at.p + np.array([[0.0, 0.0, 0.02], [0.0, 0.0, -0.01], [0.0, 0.0, -0.01]]), at.q)
    drop = model.log_density(at) - model.log_density(up)
    assert drop == pytest.approx(0.5 * (0.02**2 + 2 * 0.01**2) / model.sigma_p**2, rel=1e-6)
    assert loose.log_density(at) - loose.log_density(up) == pytest.approx(drop / 16.0, rel=1e-6)


def test_gradients_with_heights_of_another_weight():
    likelihood = transferred(3, leaning=True).query.likelihood
    rng = np.random.default_rng(0)
    tall = replace(likelihood.configuration, X_FG=likelihood.configuration.X_FG)
    tall.X_FG.p[:] += 0.05 * rng.standard_normal(tall.X_FG.p.shape) * [0.0, 0.0, 1.0]
    model = tall.with_heights(1.7, 0.4)
    likelihood = ContactLikelihood(model, likelihood.queries, None, likelihood.prior)
    factor = ConfigurationFactor(likelihood, FormationFrames(model))
    at = model.demonstrated_at(np.zeros(3), np.asarray(0.4), 1.1)
    X = Pose(
        at.p + 0.02 * rng.standard_normal(at.p.shape),
        quat_multiply(quat_exp(0.2 * rng.standard_normal((3, 3))), at.q),
    )
    value, by_p, _ = factor(X)
    scale = likelihood.scale(X, X.p.mean(axis=0), model.formation_frames(X)[1])
    prior = 0.5 * ((np.log(scale) - likelihood.prior.log_mean) / likelihood.prior.sigma) ** 2
    assert value == pytest.approx(float(model.log_density(X, scale=scale) - prior), rel=1e-9)
    for i, k in np.ndindex(3, 3):
        d = np.zeros((3, 3))
        d[i, k] = 1e-6
        slope = (factor(Pose(X.p + d, X.q))[0] - factor(Pose(X.p - d, X.q))[0]) / 2e-6
        assert by_p[i, k] == pytest.approx(slope, rel=1e-5, abs=1e-4)


def test_heights_of_the_object_do_not_affect_one_gripper():
    solutions = transfer(learn(box_demonstration(SIZE)), two_levels(0.2, 0.3, 2), parameters=FAST)
    assert solutions.query.likelihood.configuration.vertical == 1.0
