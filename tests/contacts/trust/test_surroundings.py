"""The demonstrated object laid on a new scan: oracles are boxes, whose fits are known."""

import numpy as np
import pytest

from drake_aerial.contacts.trust.surroundings import Surroundings, maps_between
from drake_aerial.contacts.trust.top_surface import TopSurface
from drake_aerial.features.horizontal_hull import HorizontalHull

RNG = np.random.default_rng(5)


def box(size, count=4000):
    """Return points (N, 3) uniform on a box's surface, standing on z = 0."""
    s = np.asarray(size)
    area = np.repeat([s[1] * s[2], s[0] * s[2], s[0] * s[1]], 2)
    face = RNG.choice(6, count, p=area / area.sum())
    points = RNG.uniform(-0.5, 0.5, (count, 3))
    points[np.arange(count), face // 2] = np.where(face % 2, 0.5, -0.5)
    return points * s + [0.0, 0.0, 0.5 * s[2]]


def turned(points, yaw, shift=(0.0, 0.0, 0.0)):
    c, s = np.cos(yaw), np.sin(yaw)
    return points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + shift


def upright(points):
    return TopSurface.of_points(points, HorizontalHull.of_points(points))


def laid(taught, site, asked):
    return Surroundings(upright(taught), np.asarray(site, float), upright(asked))


def test_the_demonstrated_object_itself_fits_at_its_own_contact():
    points, site = box((0.6, 0.4, 0.2)), [0.1, 0.05, 0.2]
    again = turned(box((0.6, 0.4, 0.2)), 0.7, [1.0, -2.0, 0.5])
    place = turned(np.array([site]), 0.7, [1.0, -2.0, 0.5])[0]
    fit = laid(points, site, again).fit(place)
    assert max(fit.whole, fit.near, fit.unexplained) < 0.01
    assert np.cos(2.0 * (fit.yaw - 0.7)) == pytest.approx(1.0, abs=0.01)


def test_a_stretched_box_fits_at_the_stretched_place():
    taught, asked = box((0.6, 0.4, 0.2)), box((0.9, 0.5, 0.3))
    fit = laid(taught, [0.15, 0.1, 0.2], asked).fit(np.array([0.225, 0.125, 0.3]))
    assert fit.whole < 0.01


@pytest.mark.parametrize("shift", [0.06, 0.12])
def test_a_shifted_place_misses_by_a_share_of_the_shift(shift):
    points, site = box((0.6, 0.4, 0.2)), np.array([0.0, 0.0, 0.2])
    fit = laid(points, site, points).fit(site + [shift, 0.0, 0.0])
    # Only the two end faces, 0.16 of 0.88 of the area, are off by the shift, up to the cap.
    least, most = 0.5 * 0.16 / 0.88 * min(shift / 0.6, 0.08), 2.0 * min(shift / 0.6, 0.08)
    assert least < fit.whole < most


def test_a_stretched_fit_counts_as_worse_than_one_in_proportion():
    taught, site = box((0.6, 0.4, 0.2)), [0.0, 0.0, 0.2]
    place = np.array([0.0, 0.0, 0.2])
    proportional = laid(taught, site, box((0.9, 0.6, 0.2))).fit(place).whole
    stretched = laid(taught, site, box((0.9, 0.3, 0.2))).fit(place).whole
    assert stretched - proportional == pytest.approx(0.01 * np.log(2.0), abs=0.004)


def test_maps_carry_corners_to_corners():
    source, target = upright(box((0.6, 0.4, 0.2))), upright(turned(box((1.0, 0.5, 0.1)), 0.4))
    maps, yaws = maps_between(source, target)
    assert maps.shape == (12, 3, 3)
    assert yaws.shape == (12,)
    corner = target.box.centre + maps[0] @ (np.array([0.3, 0.2, 0.2]) - source.box.centre)
    offset = turned((corner - target.box.centre)[None], -0.4)[0]
    assert np.abs(offset) == pytest.approx([0.5, 0.25, 0.05], abs=0.01)
    # The quarter turn swaps the sides.
    swapped = maps[3] @ (np.array([0.3, 0.2, 0.2]) - source.box.centre)
    assert np.abs(turned(swapped[None], -0.4)[0]) == pytest.approx([0.5, 0.25, 0.05], abs=0.01)
