import numpy as np
import pytest

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.features.canonical_frame import canonical_frame, to_canonical
from drake_aerial.features.surface_features import compute_features
from drake_aerial.geometry import Pose, axis_of, quat_about_axis, random_rotation, rotate, transform
from tests.features import cloud_shapes as shapes

Z = np.array([0.0, 0.0, 1.0])


def clouds(count=5000):
    rng = np.random.default_rng(0)
    return {
        "box": shapes.box([0.68, 0.61, 0.28], count, rng) + [1.0, 2.0, 3.0],
        "square box": shapes.box([0.5, 0.5, 0.28], count, rng),
        "sphere": shapes.sphere(0.2, count, rng),
        "lopsided": shapes.torus(0.3, 0.1, count, rng) * [1.5, 1.0, 1.0]
        + 0.05 * rng.random((count, 3)) ** 3,
    }


@pytest.fixture(params=["box", "square box", "sphere", "lopsided"])
def points(request):
    return clouds()[request.param]


def in_canonical(points, **keywords):
    return to_canonical(PointCloud.read(points, **keywords))[0]


def test_origin_and_up(points):
    X_SN = canonical_frame(PointCloud.read(points))
    np.testing.assert_allclose(X_SN.p, points.mean(axis=0), atol=1e-12)
    np.testing.assert_allclose(axis_of(X_SN.q, 2), Z, atol=1e-12)


def test_yaw_and_translation_do_not_matter(points):
    expected = in_canonical(points).points
    for seed in range(5):
        rng = np.random.default_rng(seed)
        X = Pose(rng.uniform(-5, 5, 3), quat_about_axis(Z, rng.uniform(-np.pi, np.pi)))
        np.testing.assert_allclose(in_canonical(transform(X, points)).points, expected, atol=1e-9)


def test_any_rotation_with_up_and_viewpoint_does_not_matter(points):
    viewpoint = np.array([0.5, -1.0, 2.0])
    expected = in_canonical(points, viewpoint=viewpoint)
    for seed in range(5):
        rng = np.random.default_rng(seed)
        X = Pose(rng.uniform(-5, 5, 3), random_rotation(rng))
        got = in_canonical(
            transform(X, points), viewpoint=transform(X, viewpoint), up=rotate(X.q, Z)
        )
        np.testing.assert_allclose(got.points, expected.points, atol=1e-9)
        np.testing.assert_allclose(got.viewpoint, expected.viewpoint, atol=1e-9)
        np.testing.assert_allclose(got.up, Z, atol=1e-12)


def test_upside_down_is_another_cloud(points):
    # The invariance is to gravity turned along, not to any rotation alone.
    X = Pose(np.zeros(3), quat_about_axis(np.array([1.0, 0, 0]), np.asarray(0.5)))
    assert (
        np.abs(in_canonical(transform(X, points)).points - in_canonical(points).points).max() > 0.01
    )


def test_order_and_repeats_do_not_matter(points):
    expected = in_canonical(points)
    order = np.random.default_rng(4).permutation(len(points))
    shuffled = in_canonical(points[order])
    np.testing.assert_allclose(shuffled.points, expected.points[order], atol=1e-12)
    repeated = in_canonical(np.concatenate([points, points[:700], points[:50]]))
    np.testing.assert_allclose(repeated.points[: len(points)], expected.points, atol=1e-12)
    for other in (shuffled, repeated):
        np.testing.assert_allclose(
            other.downsampled(0.0075).points, expected.downsampled(0.0075).points, atol=1e-12
        )


def test_repeats_do_not_matter_where_points_differ_in_one_coordinate_alone():
    axes = np.eye(3)
    for axis in axes:
        line = np.outer([0.0, 1.0, 5.0], axis)
        points = np.vstack([line, line[:2], line[:1], [[0.3, 0.4, 0.7]]])
        distinct = np.vstack([line, [[0.3, 0.4, 0.7]]])
        X_SN = canonical_frame(PointCloud.read(points))
        np.testing.assert_allclose(X_SN.p, distinct.mean(axis=0), atol=1e-12)


@pytest.mark.parametrize("sides", [3, 4, 5, 6, 7, 8])
def test_isotropic_second_moment_falls_back_on_a_higher_one(sides):
    # A regular prism's corners: the covariance is isotropic, so its axes are rounding errors.
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(sides)], axis=1)
    points = np.concatenate([ring, ring + Z])
    expected = in_canonical(points).points
    for yaw in (0.1, 1.0, 2.5):
        got = in_canonical(rotate(quat_about_axis(Z, np.asarray(yaw)), points)).points
        gaps = np.linalg.norm(got[:, None] - expected, axis=2).min(axis=1)
        assert gaps.max() < 1e-6  # the same set of points


@pytest.mark.parametrize("name", ["box", "lopsided"])
def test_features_are_the_same_in_the_same_order(name):
    points = clouds(12000)[name]
    a = compute_features(in_canonical(points))
    rng = np.random.default_rng(2)
    X = Pose(rng.uniform(-5, 5, 3), random_rotation(rng))
    order = rng.permutation(len(points))
    b = compute_features(in_canonical(transform(X, points)[order], up=rotate(X.q, Z)))
    np.testing.assert_allclose(b.p, a.p, atol=1e-9)
    np.testing.assert_allclose(b.r, a.r, atol=1e-6)
    np.testing.assert_array_equal(b.rim, a.rim)


@pytest.mark.parametrize("sides", [3, 5, 7])
def test_a_shape_that_one_odd_moment_alone_can_tell(sides):
    # Two regular polygons of one size, a quarter of their period apart. Of the moments up to the
    # eighth, only one is not zero.
    angle = 2 * np.pi / sides * np.concatenate([np.arange(sides), np.arange(sides) + 0.25])
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(2 * sides)], axis=1)
    points = np.concatenate([ring, ring + Z])
    expected = in_canonical(points).points
    for yaw in np.linspace(0.1, 6.0, 25):
        got = in_canonical(rotate(quat_about_axis(Z, np.asarray(yaw)), points)).points
        assert np.linalg.norm(got[:, None] - expected, axis=2).min(axis=1).max() < 1e-6


def test_x_is_the_long_axis_and_looks_where_more_reaches_far():
    # A bar with a long thin end: the third moment is on the end's side.
    rng = np.random.default_rng(0)
    bar = rng.uniform(-0.5, 0.5, (4000, 3)) * [0.6, 0.2, 0.1]
    end = rng.uniform(-0.5, 0.5, (300, 3)) * [0.3, 0.02, 0.1] + [0.45, 0.0, 0.0]
    points = np.vstack([bar, end])
    for yaw in (0.0, 0.7, 2.8, -1.9):
        turn = quat_about_axis(Z, np.asarray(yaw))
        X_SN = canonical_frame(PointCloud.read(rotate(turn, points)))
        angle = np.arccos(axis_of(X_SN.q, 0) @ rotate(turn, np.array([1.0, 0.0, 0.0])))
        assert angle < 0.05


def test_where_x_has_no_sense_of_its_own_y_decides():
    # Mirrored in x, not in y.
    rng = np.random.default_rng(1)
    half = rng.uniform(0.0, 1.0, (500, 3)) ** [1.0, 2.0, 1.0] * [0.4, 0.2, 0.1]
    points = np.vstack([half, half * [-1.0, 1.0, 1.0]])
    expected = None
    for yaw in (0.0, 1.0, 2.0, 3.0, 4.0, 5.0):
        got = in_canonical(rotate(quat_about_axis(Z, np.asarray(yaw)), points)).points
        expected = got if expected is None else expected
        # The same set of points: its mirror image in x is itself.
        np.testing.assert_allclose(np.sort(got[:, 1]), np.sort(expected[:, 1]), atol=1e-9)
    assert np.sum(expected[:, 1] ** 3) > 0.0


def test_a_circle_has_some_frame():
    angle = 2 * np.pi * np.arange(72) / 72
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(72)], axis=1)
    X_SN = canonical_frame(PointCloud.read(np.vstack([ring, ring + Z])))
    assert np.isfinite(X_SN.q).all()
    np.testing.assert_allclose(X_SN.p, [0.0, 0.0, 0.5], atol=1e-12)
    # Its yaw is that of a point.
    np.testing.assert_allclose(
        np.linalg.norm(ring - axis_of(X_SN.q, 0), axis=1).min(), 0.0, atol=1e-9
    )
