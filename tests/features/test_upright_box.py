"""The smallest upright box: known boxes, and maps between them."""

import numpy as np
import pytest

from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.upright_box import BoxMap, UprightBox
from drake_aerial.geometry import Pose, axis_of, quat_about_axis, rotate

Z = np.array([0.0, 0.0, 1.0])


def cloud(size, yaw, centre):
    corners = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
    return rotate(quat_about_axis(Z, np.asarray(yaw)), corners * np.asarray(size) / 2) + centre


def box_of(points):
    return UprightBox.of_points(points, HorizontalHull.of_points(points))


@pytest.mark.parametrize("yaw", [0.0, 0.4, 1.9, -2.5])
def test_a_turned_box_has_its_own_sides_and_centre(yaw):
    box = box_of(cloud([0.8, 0.5, 0.3], yaw, [1.0, -2.0, 0.7]))
    np.testing.assert_allclose(2 * box.half, [0.8, 0.5, 0.3], rtol=1e-9)
    np.testing.assert_allclose(box.centre, [1.0, -2.0, 0.7], atol=1e-9)
    assert np.sin(box.yaw - yaw) == pytest.approx(0.0, abs=1e-9)
    assert box.size == pytest.approx(0.8)


def test_coordinates_and_points_are_inverse():
    box = box_of(cloud([0.8, 0.5, 0.3], 0.7, [1.0, -2.0, 0.7]))
    p = np.random.default_rng(0).uniform(-1, 1, (5, 3))
    np.testing.assert_allclose(box.points(box.coordinates(p)), p, atol=1e-12)


def test_a_map_keeps_proportions_and_turns_axes():
    a = box_of(cloud([0.8, 0.4, 0.2], 0.3, [0.0, 0.0, 0.0]))
    b = box_of(cloud([1.6, 0.4, 0.3], -1.0, [1.0, 1.0, 1.0]))
    for turns in range(4):
        turn = BoxMap(a, b, turns)
        # Corners land on corners, whatever the quarter turn.
        corners = cloud([0.8, 0.4, 0.2], 0.3, [0.0, 0.0, 0.0])
        np.testing.assert_allclose(np.abs(b.coordinates(turn.points(corners))), 1.0, atol=1e-9)
        X = turn.poses(Pose(corners[:1], np.array([[1.0, 0.0, 0.0, 0.0]])))
        assert axis_of(X.q, 2)[0] @ Z == pytest.approx(1.0)
