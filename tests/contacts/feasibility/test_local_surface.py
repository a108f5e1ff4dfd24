"""Setting grippers down: on a plane, a sphere, and the right side of a thin plate."""

import numpy as np
import pytest

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.feasibility.local_surface import LocalSurface
from drake_aerial.features.surface_features import compute_features
from drake_aerial.geometry import Pose, axis_of, quat_exp, quat_from_two_vectors
from tests.contacts.box_scans import box_cloud

UP = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("noise", [0.0, 0.002])
def test_on_a_sphere(noise):
    rng = np.random.default_rng(0)
    v = rng.standard_normal((20_000, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    surface = LocalSurface(
        compute_features(PointCloud.read(0.2 * v + noise * rng.standard_normal(v.shape)))
    )
    z = v[:50]
    tilted = quat_from_two_vectors(np.tile(UP, (50, 1)), z + 0.1 * rng.standard_normal((50, 3)))
    X, normal, distance = surface.set_down(
        Pose(0.21 * z, tilted / np.linalg.norm(tilted, axis=1, keepdims=True))
    )
    np.testing.assert_allclose(np.linalg.norm(X.p, axis=1), 0.2, atol=0.0025)
    assert np.degrees(np.arccos(np.sum(normal * z, axis=1))).max() < 4.0
    np.testing.assert_allclose(axis_of(X.q, 2), normal, atol=1e-9)
    assert distance.max() < 0.01


def test_on_its_own_side_of_a_plate():
    surface = LocalSurface(compute_features(box_cloud([0.4, 0.4, 0.035])))
    q = np.stack([quat_exp([0.0, 0, 0]), quat_exp([np.pi, 0, 0])])
    X, normal, _ = surface.set_down(Pose(np.zeros((2, 3)), q))
    np.testing.assert_allclose(X.p[:, 2], [0.0175, -0.0175], atol=0.002)
    np.testing.assert_allclose(normal[:, 2], [1.0, -1.0], atol=0.05)


def test_above_takes_the_topmost_surface_and_the_nearest_beside_the_object():
    surface = LocalSurface(compute_features(box_cloud([0.4, 0.3, 0.2])))
    X, normal = surface.above(np.array([[0.05, -0.05], [0.4, 0.0]]))
    np.testing.assert_allclose(X.p[0], [0.05, -0.05, 0.1], atol=1e-3)
    np.testing.assert_allclose(normal[0], UP, atol=0.02)
    assert abs(X.p[1, 2]) <= 0.12


def test_above_finds_the_top_of_a_sparse_scan():
    surface = LocalSurface(compute_features(box_cloud([0.9, 0.45, 0.25], spacing=0.016)))
    xy = np.random.default_rng(1).uniform(-0.15, 0.15, (60, 2))
    X, _ = surface.above(xy)
    np.testing.assert_allclose(X.p[:, 2], 0.125, atol=1e-3)
