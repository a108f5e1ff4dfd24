"""The paper's votes: rigid offsets from features of the new cloud."""

import numpy as np
import pytest

from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.votes.paper_votes import paper_votes
from drake_aerial.errors import JobError
from drake_aerial.geometry import axis_of
from drake_aerial.skill.learn import learn
from tests.contacts.box_scans import box_demonstration


@pytest.fixture(scope="module")
def skill():
    return learn(box_demonstration([0.68, 0.61, 0.28], site=(0.5, 0.0)))


def votes_of_one_feature(skill, index, size_ratio=1.0, **options):
    parameters = TransferParameters(paper_votes=400, **options)
    feature = skill.task.features.take([index])
    rng = np.random.default_rng(0)
    return feature, paper_votes(skill, 0, feature, size_ratio, parameters, rng).kernels_at


def test_a_task_feature_votes_for_the_demonstrated_gripper_too(skill):
    edge = int(np.argmax(skill.task.weights))
    _, votes = votes_of_one_feature(skill, edge)
    # Most votes match it with other task features: the demonstrated gripper is one among many.
    near = np.linalg.norm(votes.p - skill.X_NG.p[0], axis=1) < 0.02
    assert 0 < near.sum() < len(votes.p)
    np.testing.assert_allclose(axis_of(votes.q, 2)[near][:, 2], 1.0, atol=0.05)


def test_votes_are_rigid_unless_they_are_scaled_with_the_object(skill):
    edge = int(np.argmax(skill.task.weights))
    feature, rigid = votes_of_one_feature(skill, edge, size_ratio=2.0)
    _, same = votes_of_one_feature(skill, edge, size_ratio=1.0)
    _, scaled = votes_of_one_feature(skill, edge, size_ratio=2.0, paper_scale=True)
    np.testing.assert_array_equal(rigid.p, same.p)
    np.testing.assert_allclose(scaled.p - feature.p, 2.0 * (rigid.p - feature.p), atol=1e-12)


def test_features_of_another_curvature_cannot_vote(skill):
    feature = skill.task.features.take([0])
    feature.r[:] = [9.0, 9.0]
    with pytest.raises(JobError, match=r"votes are zero.*`kopicki`"):
        paper_votes(skill, 0, feature, 1.0, TransferParameters(), np.random.default_rng(0))
