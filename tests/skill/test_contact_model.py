"""The contact model: kernels from features to the gripper, their number and weights."""

import numpy as np
import pytest

from drake_aerial.density.surface_density import Bandwidth
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Pose, random_rotation
from drake_aerial.skill.contact_model import ContactModel
from drake_aerial.skill.object_model import ObjectModel


def surface(count, seed=0):
    rng = np.random.default_rng(seed)
    p = np.column_stack([rng.uniform(-0.05, 0.05, (count, 2)), np.zeros(count)])
    r = np.column_stack([np.arange(count, dtype=float), np.zeros(count)])
    return ObjectModel(
        SurfaceFeatures(
            p, random_rotation(rng, count), r, np.ones(count), np.zeros(count, bool), 0.03
        ),
        Bandwidth(0.01, 0.2, 0.3),
    )


GRIPPER = Pose(np.array([0.01, -0.02, 0.0]), random_rotation(np.random.default_rng(9)))


@pytest.mark.parametrize("count", [5, 40, 60])
def test_every_kernel_leads_from_its_feature_to_the_gripper(count):
    model = surface(40)
    contact = ContactModel.learn(
        model, GRIPPER, radius=0.05, count=count, rng=np.random.default_rng(1)
    )
    chosen = contact.descriptor[:, 0].astype(int)  # the features' numbers
    assert len(chosen) == min(count, 40)
    assert np.all(np.diff(chosen) > 0)
    back = model.features.take(chosen).pose @ contact.X_vG
    np.testing.assert_allclose(back.p, np.tile(GRIPPER.p, (len(chosen), 1)), atol=1e-12)
    np.testing.assert_allclose(np.abs(back.q @ GRIPPER.q), 1.0, atol=1e-12)
    # exp(-lambda d^2), of which one per cent is left at the radius.
    distance = np.linalg.norm(model.features.p[chosen] - GRIPPER.p, axis=1)
    expected = np.exp(-np.log(100.0) * distance**2 / 0.05**2)
    np.testing.assert_allclose(contact.weights, expected / expected.sum(), rtol=1e-9)
    assert contact.bandwidth == model.bandwidth


def test_fewer_kernels_are_drawn_by_chance():
    model = surface(10)
    drawn = [
        ContactModel.learn(
            model, GRIPPER, radius=0.05, count=4, rng=np.random.default_rng(k)
        ).descriptor[:, 0]
        for k in range(400)
    ]
    np.testing.assert_allclose(
        np.bincount(np.concatenate(drawn).astype(int), minlength=10) / 400, 0.4, atol=0.09
    )


def test_the_density_weighs_its_kernels():
    contact = ContactModel.learn(
        surface(12), GRIPPER, radius=0.05, count=12, rng=np.random.default_rng(1)
    )
    np.testing.assert_array_equal(contact.density.weights, contact.weights)
    # Descriptors one apart, more than three bandwidths: at each its own kernel's weight, nearly.
    marginal = (
        np.exp(contact.density.log_descriptor_density(contact.descriptor)) * 2 * np.pi * 0.3**2
    )
    np.testing.assert_allclose(marginal, contact.weights, atol=0.01)
