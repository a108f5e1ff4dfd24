"""Cuts of a scan: found where a part is missing, and nowhere else."""

import numpy as np
import pytest

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.transfer import transfer
from drake_aerial.contacts.votes.scan_cuts import ScanCuts
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.surface_features import compute_features
from drake_aerial.skill.learn import learn
from tests.contacts.box_scans import box_cloud, box_demonstration, box_points

SIZE = np.array([0.68, 0.68, 0.28])
AXES = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])


def find(points, viewpoint=None, seen_from=None):
    features = compute_features(PointCloud.read(points, viewpoint=seen_from))
    return ScanCuts.find(features, HorizontalHull.of_points(features.p), viewpoint)


def strip(noise=0.0):
    rng = np.random.default_rng(0)
    points = box_points(SIZE, 0.01, rng)
    points = points + noise * rng.standard_normal(points.shape)
    return points[points[:, 0] < 0.19]


@pytest.mark.parametrize("noise", [0.0, 0.001, 0.003])
def test_a_missing_strip_is_a_cut_on_its_side_alone(noise):
    cuts = find(strip(noise))
    assert cuts
    assert cuts.towards(AXES).tolist() == [True, False, False, False]


def test_whole_boxes_and_balls_have_none():
    rng = np.random.default_rng(1)
    assert not find(box_points(SIZE, 0.01, rng))
    v = rng.standard_normal((8000, 3))
    assert not find(0.2 * v / np.linalg.norm(v, axis=1, keepdims=True))


def test_a_top_view_has_no_cuts():
    # Its outline is all rim: a missing strip cannot be told from a smaller box.
    points = box_points(SIZE, 0.01, np.random.default_rng(2), view="top")
    assert not find(points[points[:, 0] < 0.19], seen_from=(0.0, 0.0, 3.0))


def test_sides_that_the_sensor_could_not_see_are_no_cuts():
    points = strip()
    assert not find(points, viewpoint=np.array([-2.0, 0.0, 0.5])).towards(AXES).any()
    assert find(points, viewpoint=np.array([2.0, 0.0, 0.5])).towards(AXES)[0]


def test_completing_a_missing_strip_reduces_the_contact_error():
    cloud = PointCloud.read(strip(0.001))
    skill = learn(box_demonstration([0.68, 0.61, 0.28]))
    error = {}
    for scale in ("auto", "support"):
        few = TransferParameters(scale=scale, candidates=1500, starts=100, chains=40, steps=120)
        error[scale] = np.linalg.norm(
            transfer(skill, cloud, parameters=few)[0].X_SG.p[0] - [0, 0, 0.14]
        )
    assert error["support"] > 0.06
    assert error["auto"] < 0.045


def test_on_a_whole_box_auto_scale_equals_support_scale():
    cloud, skill = box_cloud([0.45, 0.35, 0.25]), learn(box_demonstration([0.68, 0.61, 0.28]))
    few = {"candidates": 500, "starts": 20, "chains": 10, "steps": 20}
    a, b = (
        transfer(skill, cloud, parameters=TransferParameters(scale=scale, **few))
        for scale in ("auto", "support")
    )
    np.testing.assert_array_equal(a[0].X_SG.p, b[0].X_SG.p)
