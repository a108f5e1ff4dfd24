"""The task features: how often each feature is drawn, their weights, their frames."""

import numpy as np
import pytest

from drake_aerial.density.surface_density import Bandwidth
from drake_aerial.geometry import axis_of
from drake_aerial.skill.task_model import TaskModel
from tests.features.made_features import features, five_features

UP = [0.0, 0.0, 1.0]


@pytest.mark.parametrize("count", [3, 5, 9])
def test_task_features_weigh_by_saliency(count):
    f = five_features()
    task = TaskModel.learn(f, count=count, bandwidth=Bandwidth(), rng=np.random.default_rng(0))
    chosen = task.features.p[:, 0].astype(int)
    assert len(chosen) == min(count, 5)
    assert np.all(np.diff(chosen) > 0)
    np.testing.assert_allclose(
        task.weights, f.saliency[chosen] / f.saliency[chosen].sum(), atol=2e-3
    )
    assert task.weights.sum() == pytest.approx(1.0)
    assert len(task.salient) == count
    assert set(task.salient.p[:, 0]) <= {0.0, 1.0, 2.0, 4.0}
    assert (task.salient.p[:, 0] == 4.0).sum() >= count // 2  # 2.0 of 3.3
    np.testing.assert_array_equal(task.density.weights, task.weights)
    np.testing.assert_array_equal(task.density.descriptor, task.features.r)


def test_a_flat_cloud_has_weights_too():
    flat = features([UP] * 6, [[1, 0, 0]] * 6, np.zeros(6), np.zeros(6))
    task = TaskModel.learn(flat, count=6, bandwidth=Bandwidth(), rng=np.random.default_rng(0))
    np.testing.assert_allclose(task.weights, 1 / 6)


def test_frames_are_turned_within_their_ambiguity():
    f = features([UP] * 400, [[1, 0, 0]] * 400, np.ones(400), np.zeros(400))
    task = TaskModel.learn(f, count=400, bandwidth=Bandwidth(), rng=np.random.default_rng(0))
    k1 = axis_of(task.features.q, 0)[:, 0]
    np.testing.assert_allclose(np.abs(k1), 1.0)
    assert abs((k1 < 0).mean() - 0.5) < 0.1
