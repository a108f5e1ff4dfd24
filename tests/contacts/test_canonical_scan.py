"""The canonical scan: its frame, and the surface that belongs to its features."""

from dataclasses import replace

import numpy as np

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.canonical_scan import CanonicalScan
from drake_aerial.features.surface_features import FeatureParameters
from drake_aerial.geometry import Pose, invert, quat_exp, transform
from tests.contacts.box_scans import box_points

SIZE = [0.68, 0.5, 0.3]


def test_features_and_viewpoint_are_those_of_the_cloud_in_another_frame():
    # The box stands turned and away from the origin; in N it is axis-aligned about the origin.
    X_SB = Pose(np.array([2.0, -1.0, 0.4]), quat_exp([0.0, 0.0, 0.7]))
    points = transform(X_SB, box_points(SIZE, 0.01, np.random.default_rng(0)))
    sensor = transform(X_SB, [0.0, 0.0, 3.0])
    cloud = PointCloud.read(points, viewpoint=sensor)
    scan = CanonicalScan.of_cloud(cloud, FeatureParameters())
    np.testing.assert_allclose(np.ptp(scan.features.p, axis=0), SIZE, atol=0.02)
    np.testing.assert_allclose(np.ptp(scan.hull.vertices, axis=0), SIZE[:2], atol=0.02)
    np.testing.assert_allclose(scan.viewpoint, [0.0, 0.0, 3.0], atol=0.02)
    on_box = transform(invert(X_SB), scan.features_S.p)
    np.testing.assert_allclose(np.abs(on_box / SIZE).max(axis=1), 0.5, atol=0.03)


def test_the_surface_follows_the_features():
    scan = CanonicalScan.of_cloud(
        PointCloud.read(box_points(SIZE, 0.01, np.random.default_rng(1))), FeatureParameters()
    )
    assert scan.surface is scan.surface
    upper = scan.features.take(np.flatnonzero(scan.features.p[:, 2] > 0.0))
    np.testing.assert_array_equal(replace(scan, features=upper).surface.points, upper.p)
