"""Hull of a projection: analytic rectangle, circle, triangle."""

import numpy as np
import pytest

from drake_aerial.errors import InputError
from drake_aerial.learning.hull import HorizontalHull


def test_rectangle():
    corners = np.array([[0, 0], [4, 0], [4, 2], [0, 2], [1, 1]], float) + [10.0, -5.0]
    hull = HorizontalHull.of_points(corners)
    assert hull.area == pytest.approx(8.0)
    np.testing.assert_allclose(hull.centroid, [12.0, -4.0])
    t = np.array([[1, 0], [0, 1], [np.sqrt(0.5), np.sqrt(0.5)]])
    np.testing.assert_allclose(hull.support(t), [2.0, 1.0, 3.0 / np.sqrt(2)])
    np.testing.assert_allclose(hull.width(t), [4.0, 2.0, 6.0 / np.sqrt(2)])


def test_triangle_centroid_is_the_mean_of_its_corners():
    corners = np.array([[0.1, 0.0], [0.9, 0.3], [0.2, 0.8]])
    hull = HorizontalHull.of_points(np.vstack([corners, corners.mean(axis=0)]))
    np.testing.assert_allclose(hull.centroid, corners.mean(axis=0), atol=1e-12)


def test_circle_support_is_its_radius():
    a = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    hull = HorizontalHull.of_points(np.column_stack([np.cos(a), np.sin(a), a]))
    np.testing.assert_allclose(hull.support(np.array([[0.6, 0.8], [-1.0, 0.0]])), 1.0, atol=1e-4)
    assert hull.area == pytest.approx(np.pi, rel=1e-4)


def test_contains_with_a_margin():
    hull = HorizontalHull.of_points(np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]]))
    points = np.array([[0.5, 0.5], [1.05, 0.5], [1.2, 0.5]])
    assert hull.contains(points, margin=0.1).tolist() == [True, True, False]


def test_refuses_points_on_a_line():
    with pytest.raises(InputError, match="lie on a line"):
        HorizontalHull.of_points(np.column_stack([np.arange(5.0), np.arange(5.0), np.zeros(5)]))
