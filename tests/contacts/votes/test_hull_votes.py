"""Votes in hull coordinates: where they agree, and what is said where no feature can vote."""

import re

import numpy as np
import pytest

from drake_aerial.choices import METHODS
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.votes.hull_votes import HullVotes
from drake_aerial.contacts.votes.scan_cuts import ScanCuts
from drake_aerial.errors import JobError
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
