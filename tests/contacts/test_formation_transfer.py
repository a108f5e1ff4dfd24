"""Transfer of the shipped formations: to another size, another outline, another length."""

from functools import cache

import numpy as np
import pytest
import trimesh

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.likelihood.contact_likelihood import ScalePrior
from drake_aerial.contacts.transfer import transfer
from drake_aerial.contacts.votes.scan_cuts import ScanCuts
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.surface_features import compute_features
from drake_aerial.geometry import Pose, invert, quat_about_axis, transform
from drake_aerial.io import model_files
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn
from tests.contacts.box_scans import box_cloud
from tests.contacts.formations import FAST

COMPARED = ("task", "control", "kopicki")
SIDE = 0.32 * np.sqrt(3.0)


@cache
def skill(name):
    return learn(Demonstration.read(name))


def hollow_triangle(scale, yaw, seed=3):
    mesh = trimesh.load(model_files.models_dir() / "meshes" / "hollow_triangle.obj", force="mesh")
    mesh.apply_scale(scale)
    points = np.asarray(trimesh.sample.sample_surface(mesh, 12000, seed=seed)[0])
    X = Pose(
        np.array([0.4, -0.2, 0.1]), quat_about_axis(np.array([0.0, 0.0, 1.0]), np.asarray(yaw))
    )
    return PointCloud.read(transform(X, points)), X


@pytest.mark.parametrize("scale", [0.7, 1.4])
def test_three_grippers_on_a_triangle_of_another_size(scale):
    cloud, X = hollow_triangle(scale, yaw=0.8)
    best = transfer(skill("formation"), cloud)[0]
    p = transform(invert(X), best.X_SG.p)
    assert best.feasible
    assert np.linalg.norm(p.mean(axis=0)[:2]) < 0.015
    np.testing.assert_allclose(p[:, 2], 0.06 * scale, atol=0.003)
    np.testing.assert_allclose(
        np.linalg.norm(p - np.roll(p, 1, axis=0), axis=1), scale * SIDE, atol=0.03
    )
    # Over the corners: at 0, 120 or 240 degrees.
    angle = np.arctan2(p[:, 1], p[:, 0]) * 1.5 / np.pi
    np.testing.assert_allclose(angle, np.round(angle), atol=0.1)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_votes_of_a_triangle_agree_on_the_middle_of_a_box(seed):
    # No edge of a triangle is parallel to a box's second one: the ends of an edge fix its middle.
    cloud = box_cloud([1.0, 0.8, 0.3], seed, spacing=0.012)
    query = transfer(skill("formation"), cloud, seed=seed, parameters=FAST).query
    votes = query.likelihood.votes
    x, y, yaw = votes.density.mode
    np.testing.assert_allclose(transform(query.scan.X_SN, [x, y, 0.0])[:2], 0, atol=0.025)
    angle = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    beside = np.array([x, y, 0.0]) + 0.15 * np.column_stack(
        [np.cos(angle), np.sin(angle), 0.0 * angle]
    )
    drop = votes.density.log_density([x, y, yaw]) - votes.log_density(beside, np.full(12, yaw))
    # The mode is a hill, not a ridge: 15 cm off in any direction V is less than half as large.
    assert drop.min() > np.log(2.0)


def test_three_grippers_on_a_box():
    best = transfer(skill("formation"), box_cloud([1.0, 0.8, 0.3], seed=1, spacing=0.012))[0]
    assert best.feasible
    assert np.linalg.norm(best.X_SG.p.mean(axis=0)[:2]) < 0.04
    np.testing.assert_allclose(best.X_SG.p[:, 2], 0.15, atol=0.003)


def test_two_grippers_on_a_longer_bar():
    best = transfer(skill("bar"), box_cloud([1.4, 0.1, 0.06], seed=2), parameters=FAST)[0]
    x = np.sort(best.X_SG.p[:, 0])
    np.testing.assert_allclose(x, [-0.448, 0.448], atol=0.04)
    np.testing.assert_allclose(best.X_SG.p[:, 1], 0, atol=0.02)
    assert best.feasible


def rectangle(a, b):
    return HorizontalHull.of_points(0.5 * np.array([[a, b], [-a, b], [-a, -b], [a, -b]]))


def test_grippers_in_line_scale_with_the_length_along_them():
    line, triangle = np.array([[0.3, 0, 0], [-0.3, 0, 0]]), skill("formation").configuration.X_FG.p
    long, short = rectangle(1.4, 0.1), rectangle(1.0, 0.1)
    along = ScalePrior.of_hulls(long, short, 0.0, line)
    assert np.exp(along.log_mean) == pytest.approx(1.4, rel=0.02)
    # A regular formation weights all directions alike.
    even, plain = (
        ScalePrior.of_hulls(long, short, 0.3, triangle),
        ScalePrior.of_hulls(long, short, 0.3),
    )
    assert (even.log_mean, even.sigma) == pytest.approx((plain.log_mean, plain.sigma), abs=1e-6)
    # The yaw turns the demonstrated object, its hull and its grippers alike.
    across = ScalePrior.of_hulls(rectangle(0.1, 1.4), short, 0.5 * np.pi, line)
    assert across.log_mean == pytest.approx(along.log_mean, abs=1e-6)


def test_cuts_do_not_shrink_a_formation():
    # A strip of 15 cm is missing at positive x: what is left looks shorter, and is as wide as ever.
    flags = np.zeros(72, bool)
    flags[[70, 71, 0, 1, 2]] = True
    whole, left = rectangle(0.68, 0.61), HorizontalHull(rectangle(0.68, 0.61).vertices.copy())
    left.vertices[:, 0] = np.minimum(left.vertices[:, 0], 0.19)
    layout = skill("formation").configuration.X_FG.p
    assert ScalePrior.of_hulls(left, whole, 0.0, layout).log_mean < -0.05
    for yaw in (0.0, 8.0, -8.0):
        prior = ScalePrior.of_hulls(left, whole, np.deg2rad(yaw), layout, ScanCuts(flags))
        assert prior.log_mean == pytest.approx(0.0, abs=0.03)
    # Turned by a quarter, what is wide now was long.
    turned = ScalePrior.of_hulls(left, whole, 0.5 * np.pi, layout, ScanCuts(flags))
    assert turned.log_mean == pytest.approx(np.log(0.61 / 0.68), abs=0.03)


def test_beams_that_end_in_a_cut_are_found():
    cloud, _ = hollow_triangle(1.0, yaw=0.0)
    features = compute_features(cloud)
    points = features.p[features.p[:, 0] < features.p[:, 0].max() - 0.17]
    for p, count in ((features.p, 0), (points, 3)):
        found = compute_features(PointCloud.read(p))
        cuts = ScanCuts.find(found, HorizontalHull.of_points(found.p), None)
        assert cuts.flags.sum() >= count
        assert bool(cuts) == (count > 0)
        assert not cuts.towards([-0.5, np.sqrt(0.75)])
    np.testing.assert_allclose(np.abs(cuts.axis()), [1.0, 0.0], atol=0.1)


def test_control_expects_the_size_that_task_expects():
    # The methods differ in the votes alone: both read the size of the triangle off the hulls.
    cloud, _ = hollow_triangle(1.4, yaw=0.3)
    priors = {
        m: transfer(skill("formation"), cloud, method=m, parameters=FAST).query.likelihood.prior
        for m in COMPARED
    }
    assert np.exp(priors["task"].log_mean) == pytest.approx(1.4, rel=0.01)
    assert np.exp(priors["control"].log_mean) == pytest.approx(1.4, rel=0.01)
    assert priors["task"].sigma == pytest.approx(priors["control"].sigma, abs=0.03)
    # The paper knows no scale.
    assert priors["kopicki"].log_mean == 0.0
