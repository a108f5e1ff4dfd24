"""Votes in hull coordinates: where they agree, and what is said where no feature can vote."""

import re

import numpy as np
import pytest

from drake_aerial.choices import METHODS
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.votes.hull_votes import GravityFeatures, HullVotes
from drake_aerial.contacts.votes.scan_cuts import ScanCuts
from drake_aerial.errors import JobError
from drake_aerial.features.horizontal_direction import FULL_HORIZONTAL, horizontal_direction
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.surface_features import compute_features
from drake_aerial.skill.learn import learn
from tests.contacts.box_scans import box_cloud, box_demonstration

SIZE = [0.68, 0.61, 0.28]


def hull_votes(skill, features, **options):
    hull, parameters = HorizontalHull.of_points(features.p), TransferParameters(**options)
    rng = np.random.default_rng(4)
    return HullVotes(skill, features, hull, ScanCuts.none(), "support", parameters, rng)


def test_votes_agree_on_the_middle():
    features = compute_features(box_cloud([0.5, 0.4, 0.3], seed=1))
    votes = hull_votes(learn(box_demonstration(SIZE)), features)
    assert len(votes.positions) == len(votes.weights) == 50 * 1000
    np.testing.assert_allclose(votes.density.mode, [0.0, 0.0], atol=0.02)


def test_votes_that_are_all_zero_are_an_error_whose_advice_the_command_has():
    # A top view's rims, strictly compared, resemble nothing on a smooth ball.
    top = learn(box_demonstration(SIZE, view="top"))
    rng = np.random.default_rng(5)
    v = rng.standard_normal((20_000, 3))
    ball = 0.15 * v / np.linalg.norm(v, axis=1, keepdims=True)
    smooth = compute_features(PointCloud.read(ball))
    with pytest.raises(JobError, match="votes are zero") as caught:
        hull_votes(top, smooth, vote_descriptor=0.1)
    advised = re.findall(r"method `(\w+)`", str(caught.value))
    assert len(advised) == 1
    assert METHODS[advised[0]][0] == "none"


def tray(rng, size=(0.8, 0.6, 0.05)):
    """Points of an open tray with thin walls."""
    floor = rng.uniform(-0.5, 0.5, (9000, 3)) * [*size[:2], 0.002]
    walls = []
    for axis in (0, 1):
        for side in (-0.5, 0.5):
            wall = rng.uniform([-0.5, -0.5, 0.0], [0.5, 0.5, 1.0], (700, 3))
            wall[:, axis] = side
            walls.append(wall * size)
    return np.concatenate([floor, *walls])


@pytest.mark.parametrize("viewpoint", [[0.0, 0.0, 3.0], [0.2, -1.0, 2.5]])
def test_the_foot_of_a_trays_wall_faces_outward(viewpoint):
    cloud = PointCloud.read(tray(np.random.default_rng(0)), viewpoint=viewpoint)
    features = compute_features(cloud)
    leans = horizontal_direction(features)[1] > FULL_HORIZONTAL
    foot = features.take((features.r[:, 0] < -0.5) & ~features.rim & leans)
    assert len(foot) > 500
    hull = HorizontalHull.of_points(features.p)
    outward = np.sum(GravityFeatures.of(foot, hull).t * (foot.p[:, :2] - hull.centroid), axis=1)
    assert np.mean(outward > 0.0) > 0.9


def test_votes_on_an_open_tray_agree_on_its_middle():
    cloud = PointCloud.read(tray(np.random.default_rng(0)), viewpoint=[0.0, 0.0, 3.0])
    votes = hull_votes(learn(box_demonstration(SIZE)), compute_features(cloud))
    np.testing.assert_allclose(votes.density.mode, [0.0, 0.0], atol=0.02)
