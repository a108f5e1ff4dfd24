"""Learning on a box: the contents of the models, and invariance to the demonstration's pose."""

from dataclasses import replace

import numpy as np
import pytest

from drake_aerial.errors import InputError
from drake_aerial.features.horizontal_direction import gravity_saliency, horizontal_direction
from drake_aerial.geometry import Pose, invert, quat_about_axis, quat_exp, quat_multiply, transform
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn
from drake_aerial.skill.parameters import LearningParameters


@pytest.fixture(scope="module")
def edge():
    return Demonstration.read("edge")


@pytest.fixture(scope="module")
def skill(edge):
    return learn(edge)


def test_object_model_is_the_surface_at_the_gripper(skill):
    features = skill.objects[0].features
    assert len(features) == 500
    assert np.linalg.norm(features.p - skill.X_NG.p[0], axis=1).max() <= 0.05
    # A flat face: every normal is up.
    np.testing.assert_allclose(features.normal, np.tile([0, 0, 1], (500, 1)), atol=1e-6)


def test_contact_model_leads_from_every_feature_to_the_gripper(skill):
    contact, features = skill.contacts[0], skill.objects[0].features
    X_NG = features.pose @ contact.X_vG
    np.testing.assert_allclose(X_NG.p, np.tile(skill.X_NG.p[0], (500, 1)), atol=1e-9)
    assert contact.weights.sum() == pytest.approx(1.0)
    distance = np.linalg.norm(contact.X_vG.p, axis=1)
    # exp(-lambda d^2) with one per cent at 5 cm.
    ratio = contact.weights[distance.argmax()] / contact.weights[distance.argmin()]
    expected = 0.01 ** ((distance.max() ** 2 - distance.min() ** 2) / 0.05**2)
    assert ratio == pytest.approx(expected, rel=1e-9)


def test_task_model_is_salient_and_its_weights_sum_to_one(skill):
    task = skill.task
    assert len(task.features) == len(task.salient) == 50
    assert task.weights.sum() == pytest.approx(1.0)
    # On a top face only its rim says where: the outline, looking outward.
    assert gravity_saliency(task.salient).min() > 0.0
    assert task.salient.rim.all()
    t, _ = horizontal_direction(task.salient)
    assert np.all(np.sum(t * task.salient.p[:, :2], axis=1) > 0.2)


def test_demonstrated_poses_are_kept_in_the_demonstration_frame(skill, edge):
    np.testing.assert_allclose(transform(skill.X_SN, skill.X_NG.p), edge.grippers.p, atol=1e-12)
    np.testing.assert_allclose(transform(skill.X_SN, skill.X_NQ.p), edge.quadrotors.p, atol=1e-12)
    on_top = transform(skill.X_SN, skill.points)
    np.testing.assert_allclose(on_top[:, 2], 0.14, atol=1e-9)


def test_same_seed_same_bytes_other_seed_other_draws(skill, edge):
    assert learn(edge).to_bytes() == skill.to_bytes()
    assert learn(edge, seed=1).to_bytes() != skill.to_bytes()


@pytest.mark.parametrize("rotation", [[0.0, 0.0, 0.8], [0.5, -0.7, 1.2]])
def test_does_not_depend_on_where_the_demonstration_stood(skill, edge, rotation):
    # A rotation turns gravity, too: `up` goes with the cloud.
    X = Pose(np.array([1.0, -2.0, 0.5]), quat_exp(rotation))
    moved = replace(
        edge,
        cloud=edge.cloud.transformed(X),
        grippers=X @ edge.grippers,
        quadrotors=X @ edge.quadrotors,
    )
    other = learn(moved)
    np.testing.assert_allclose(other.X_NG.p, skill.X_NG.p, atol=1e-9)
    np.testing.assert_allclose(other.points, skill.points, atol=1e-9)
    np.testing.assert_allclose(other.task.salient.p, skill.task.salient.p, atol=1e-9)
    np.testing.assert_allclose(other.contacts[0].X_vG.p, skill.contacts[0].X_vG.p, atol=1e-6)


def test_several_grippers_have_a_model_each(edge):
    two = Demonstration.make(
        edge.cloud, [[0.2, 0, 0.14], [-0.2, 0.1, 0.14]], cable_length=[0.4, 0.6]
    )
    skill = learn(two)
    assert len(skill) == len(skill.objects) == len(skill.contacts) == 2
    np.testing.assert_allclose(skill.configuration.X_FG.p.mean(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(skill.configuration.cable_length, [0.4, 0.6])


def test_a_gripper_that_touches_nothing_is_refused_with_its_distance(edge):
    floating = Demonstration.make(edge.cloud, [[0.0, 0.0, 0.24]])
    with pytest.raises(InputError, match=r"gripper 1 .* touches nothing: .* got 0\.100 m"):
        learn(floating)


def test_counts_can_be_set(edge):
    small = LearningParameters(object_features=40, contact_kernels=20, task_features=10)
    skill = learn(edge, parameters=small)
    assert len(skill.objects[0].features) == 40
    assert len(skill.contacts[0].weights) == 20
    assert len(skill.task.salient) == 10


@pytest.mark.parametrize(
    "bad", [{"contact_radius": 0.0}, {"task_features": 0}, {"configuration_sigma": np.nan}]
)
def test_refuses_bad_parameters(bad):
    with pytest.raises(InputError, match=next(iter(bad))):
        LearningParameters(**bad)


def test_frames_are_turned_only_within_their_ambiguity(skill):
    # Rims know their direction; the drawn task features at rims still look outward.
    rims = skill.task.features.take(skill.task.features.rim)
    outward = np.sum(rims.k1[:, :2] * rims.p[:, :2], axis=1)
    assert np.all(outward > 0.0)


def test_quaternions_of_the_gripper_survive(edge):
    turned = quat_multiply(edge.grippers.q, quat_about_axis([0, 0, 1.0], np.asarray(0.3)))
    skill = learn(replace(edge, grippers=Pose(edge.grippers.p, turned)))
    back = invert(skill.X_SN) @ Pose(edge.grippers.p, turned)
    np.testing.assert_allclose(np.abs(np.sum(skill.X_NG.q * back.q, axis=1)), 1.0, atol=1e-12)
