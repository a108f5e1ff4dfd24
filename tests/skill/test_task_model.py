"""Which features of the whole object say where a contact was, and how often they are drawn."""

import numpy as np
import pytest

from drake_aerial.density.resampling import systematic_resample
from drake_aerial.density.surface_density import Bandwidth
from drake_aerial.features.horizontal_direction import (
    gravity_saliency,
    horizontal_direction,
    outward_direction,
)
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import axis_of, quat_from_xz
from drake_aerial.skill.task_model import TaskModel

Z = np.array([0.0, 0.0, 1.0])


def features(normal, x, r1, rim):
    normal, x = np.array(normal, float), np.array(x, float)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    count = len(normal)
    r = np.column_stack([np.array(r1, float), np.zeros(count)])
    p = np.column_stack([np.arange(count), np.zeros((count, 2))])
    return SurfaceFeatures(
        p, quat_from_xz(x, normal), r, np.ones(count), np.array(rim, bool), 0.03, edge_saliency=2.0
    )


def some():
    """A wall, a steep roof, a nearly flat one, a flat one, and a flat one's rim."""
    normals = [[0, -1, 0], [0.6, 0, 0.8], [0.15, 0, np.sqrt(1 - 0.15**2)], [0, 0, 1], [0, 0, 1]]
    x = [[1, 0, 0], [0, 1, 0], [0, 1, 0], [1, 0, 0], [-1, 0, 0]]
    return features(normals, x, [0.5, -0.4, 0.8, 1.0, 0.1], [False, False, False, False, True])


def test_a_rim_looks_across_itself_and_a_surface_along_its_normal():
    f = some()
    np.testing.assert_allclose(outward_direction(f)[:4], f.normal[:4], atol=1e-12)
    np.testing.assert_allclose(outward_direction(f)[4], [-1, 0, 0], atol=1e-12)


def test_horizontal_parts():
    t, length = horizontal_direction(some())
    np.testing.assert_allclose(length, [1.0, 0.6, 0.15, 0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(t, [[0, -1], [1, 0], [1, 0], [1, 0], [-1, 0]], atol=1e-12)


def test_gravity_sees_what_stands_out_sideways():
    # A flat top has no say; from 0.3 on a direction counts in full; a rim counts as an edge does.
    np.testing.assert_allclose(gravity_saliency(some()), [0.5, 0.4, 0.4, 0.0, 2.0], atol=1e-12)


def test_draws_are_in_order_and_in_proportion():
    weight = np.array([0.0, 1.0, 3.0, 0.0, 6.0])
    for seed in range(20):
        drawn = systematic_resample(weight, 100, np.random.default_rng(seed))
        assert np.all(np.diff(drawn) >= 0)
        # Systematic: each as often as its share, but for one.
        np.testing.assert_allclose(np.bincount(drawn, minlength=5), [0, 10, 30, 0, 60], atol=1)
    few = sum(
        np.bincount(systematic_resample(weight, 3, np.random.default_rng(k)), minlength=5)
        for k in range(2000)
    )
    np.testing.assert_allclose(few / 2000, 3 * weight / 10, atol=0.05)
    # Nothing salient at all: all alike.
    np.testing.assert_array_equal(
        systematic_resample(np.zeros(4), 8, np.random.default_rng(0)), np.repeat(np.arange(4), 2)
    )


class Last:
    """A generator whose numbers are all but one."""

    def random(self, count):
        return np.full(count, np.nextafter(1.0, 0.0))


def test_rounding_draws_no_feature_beyond_the_last():
    assert systematic_resample(np.full(7, 0.1), 3, Last()).max() == 6


@pytest.mark.parametrize("count", [3, 5, 9])
def test_task_features_weigh_by_saliency(count):
    f = some()
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
    flat = features([Z] * 6, [[1, 0, 0]] * 6, np.zeros(6), np.zeros(6))
    task = TaskModel.learn(flat, count=6, bandwidth=Bandwidth(), rng=np.random.default_rng(0))
    np.testing.assert_allclose(task.weights, 1 / 6)


def test_frames_are_turned_within_their_ambiguity():
    f = features([Z] * 400, [[1, 0, 0]] * 400, np.ones(400), np.zeros(400))
    task = TaskModel.learn(f, count=400, bandwidth=Bandwidth(), rng=np.random.default_rng(0))
    k1 = axis_of(task.features.q, 0)[:, 0]
    np.testing.assert_allclose(np.abs(k1), 1.0)
    assert abs((k1 < 0).mean() - 0.5) < 0.1
