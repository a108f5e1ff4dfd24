"""The object model: which features near a gripper are drawn, how often, with which frames."""

import numpy as np
import pytest

from drake_aerial.density.surface_density import Bandwidth
from drake_aerial.errors import InputError
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import axis_of
from drake_aerial.skill.object_model import ObjectModel, draw_evenly


def line(count=11):
    """Features 1 cm apart along x, looking up, of which k1 has two signs."""
    p = np.column_stack([0.01 * np.arange(count), np.zeros(count), np.zeros(count)])
    q = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    r = np.column_stack([np.arange(count), np.zeros(count)])
    return SurfaceFeatures(p, q, r, np.ones(count), np.zeros(count, bool), 0.03)


def learnt(count, radius=0.0301, p=(0.05, 0.0, 0.0), seed=0):
    rng = np.random.default_rng(seed)
    return ObjectModel.learn(
        line(), np.array(p), radius=radius, count=count, bandwidth=Bandwidth(), rng=rng
    )


@pytest.mark.parametrize("count", [3, 7, 50])
def test_features_within_the_radius_are_drawn_equally_often(count):
    model = learnt(count)
    drawn, times = np.unique(
        np.round(model.features.p[:, 0] / 0.01).astype(int), return_counts=True
    )
    assert len(model.features) == count
    assert set(drawn) <= set(range(2, 9))
    assert np.ptp(times) <= 1
    assert len(drawn) == min(count, 7)
    assert np.all(np.diff(model.features.p[:, 0]) >= 0)  # in the features' own order
    # Descriptors go with their places.
    np.testing.assert_allclose(model.features.r[:, 0], model.features.p[:, 0] / 0.01)


def test_frames_are_turned_within_their_ambiguity():
    k1 = axis_of(learnt(700).features.q, 0)[:, 0]
    np.testing.assert_allclose(np.abs(k1), 1.0)
    assert abs((k1 < 0).mean() - 0.5) < 0.08


def test_the_rest_is_drawn_by_chance():
    often = sum(
        np.bincount(draw_evenly(np.arange(7), 3, np.random.default_rng(k)), minlength=7)
        for k in range(700)
    )
    np.testing.assert_allclose(often / 700, 3 / 7, atol=0.06)


def test_the_radius_includes_its_own_length_and_nothing_beyond():
    np.testing.assert_allclose(
        np.unique(learnt(9, radius=0.01, p=(0.0, 0.0, 0.0)).features.p[:, 0]), [0.0, 0.01]
    )
    assert len(learnt(9, radius=0.25, p=(0.0, 0.0, 0.25)).features) == 9
    with pytest.raises(InputError, match=r"within 0\.249 m, got 0\.250 m"):
        learnt(9, radius=0.249, p=(0.0, 0.0, 0.25))


def test_the_density_is_that_of_the_drawn_features():
    model = learnt(7)
    f = model.features
    assert len(model.density) == 7
    np.testing.assert_allclose(model.density.weights, 1 / 7)
    there = model.density.log_density(f.pose, f.r)
    away = model.density.log_density(f.pose, f.r + [0.0, 1.0])
    np.testing.assert_allclose(there - away, 0.5 / Bandwidth().descriptor ** 2, rtol=1e-9)
