"""Hull of a projection: analytic rectangle, circle, triangle."""

import numpy as np
import pytest

from drake_aerial.errors import InputError
from drake_aerial.features.horizontal_hull import HorizontalHull


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


def test_every_side_counts():
    hull = HorizontalHull.of_points(np.array([[1.0, 2.0, 0.0], [4.0, 2.0, 1.0], [1.0, 6.0, 5.0]]))
    assert hull.area == pytest.approx(6.0)
    # Sides x = 1, y = 2 and the hypotenuse 4 x + 3 y = 22.
    inside = np.array([[1.001, 3.0], [2.0, 2.001], [2.4, 4.1]])
    outside = np.array([[0.999, 3.0], [2.0, 1.999], [2.6, 4.0]])
    assert hull.contains(inside).all()
    assert not hull.contains(outside).any()
    # A margin is a distance, on every side.
    away = np.array([[-1.0, 0.0], [0.0, -1.0], [0.8, 0.6]])
    foot = np.array([[1.0, 3.0], [2.0, 2.0], [2.5, 4.0]])
    assert hull.contains(foot + 0.19 * away, margin=0.2).all()
    assert not hull.contains(foot + 0.21 * away, margin=0.2).any()
    assert not hull.contains(foot - 0.19 * away, margin=-0.2).any()
    assert hull.contains(foot[None, :, None] - 0.21 * away[:, None], margin=-0.2).shape == (1, 3, 1)


def test_supports_are_about_the_centroid_and_widths_are_sums_of_two():
    rng = np.random.default_rng(0)
    hull = HorizontalHull.of_points(rng.normal(size=(40, 2)) * [2.0, 0.5] + [5.0, -3.0])
    angle = rng.uniform(-np.pi, np.pi, (4, 5))
    t = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    np.testing.assert_allclose(hull.width(t), hull.support(t) + hull.support(-t), rtol=1e-12)
    assert hull.support(t).shape == (4, 5)
    assert np.ptp(hull.support(t) - 0.5 * hull.width(t)) > 0.05  # no symmetry hides the centroid
    # The centroid balances: by Monte Carlo over the hull.
    points = rng.uniform(hull.vertices.min(axis=0), hull.vertices.max(axis=0), (200_000, 2))
    points = points[hull.contains(points)]
    np.testing.assert_allclose(hull.centroid, points.mean(axis=0), atol=0.02)


def test_far_from_the_origin_no_digits_are_lost():
    corners = np.array([[0.1, 0.0], [0.9, 0.3], [0.2, 0.8], [-0.3, 0.4]])
    near, far = HorizontalHull(corners), HorizontalHull(corners + 1e6)
    np.testing.assert_allclose(far.centroid - 1e6, near.centroid, atol=1e-8)


@pytest.mark.parametrize(
    "points", [np.zeros((0, 3)), np.zeros((1, 3)), np.eye(3)[:2], np.full((5, 2), 0.3)]
)
def test_refuses_points_without_an_area(points):
    with pytest.raises(InputError, match="lie on a line"):
        HorizontalHull.of_points(points)
