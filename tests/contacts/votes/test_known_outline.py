"""The outline of an object whose boundary in the view is known, and votes on it."""

from dataclasses import replace

import numpy as np
import pytest

from drake_aerial.cloud.boundary import Boundary, BoundaryKind
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.contacts.transfer import transfer
from drake_aerial.contacts.votes.scan_cuts import ScanCuts
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.surface_features import compute_features
from drake_aerial.skill.learn import learn
from tests.contacts.box_scans import box_demonstration, box_points

LENGTH, WIDTH = 0.6, 0.4
AXES = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
FEW = TransferParameters(candidates=1500, starts=100, chains=40, steps=120)


def shown(keep, kind=BoundaryKind.OCCLUDED):
    """Return the top of a box seen from above where `keep(x, y)`, with its boundary."""
    points = box_points([LENGTH, WIDTH, 0.2], 0.006, np.random.default_rng(0), view="top")
    rng = np.random.default_rng(1)
    points = points[keep(*points[:, :2].T)] + 0.0005 * rng.standard_normal(3)
    step = 0.002
    x, y = np.meshgrid(
        np.arange(-0.5 * LENGTH, 0.5 * LENGTH + step, step),
        np.arange(-0.5 * WIDTH, 0.5 * WIDTH + step, step),
        indexing="ij",
    )
    inside = np.pad(keep(x, y), 1)
    whole = np.pad(np.ones(x.shape, bool), 1)
    middle = (slice(1, -1), slice(1, -1))
    found, kinds = [], []
    for shift in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        beyond = np.roll(inside, shift, axis=(0, 1))[middle]
        edge = inside[middle] & ~beyond
        hidden = np.roll(whole, shift, axis=(0, 1))[middle][edge]
        found.append(np.column_stack([x[edge], y[edge], np.full(edge.sum(), 0.1)]))
        kinds.append(np.where(hidden, kind, BoundaryKind.SEEN))
    boundary = Boundary(np.vstack(found), np.concatenate(kinds).astype(np.int8))
    cloud = PointCloud.read(points, viewpoint=[0.0, 0.0, 3.0])
    return replace(cloud, boundary=boundary)


def cuts_of(cloud):
    features = compute_features(cloud)
    hull = HorizontalHull.of_points(features.p)
    return features, hull, ScanCuts.known(features, hull, cloud.boundary)


def corner(x, y):
    return ~((x > 0.12) & (y > 0.05))


def notch(x, y):
    return ~((x > 0.15) & (np.abs(y - 0.02) < 0.08))


def strip(x, y):
    return x < 0.15


def whole(x, y):
    return np.ones(np.shape(x), bool)


def test_a_whole_outline_is_not_open_and_all_its_rims_vote():
    features, hull, cuts = cuts_of(shown(whole))
    assert not cuts
    assert cuts.voting(features).all()
    np.testing.assert_array_equal(cuts.completed(hull).vertices, hull.vertices)


def test_a_hidden_corner_is_completed_by_the_sides_beside_it():
    _, hull, cuts = cuts_of(shown(corner))
    completed = cuts.completed(hull)
    assert not cuts
    assert hull.area < 0.95 * LENGTH * WIDTH
    assert completed.area == pytest.approx(LENGTH * WIDTH, rel=0.05)
    np.testing.assert_allclose(completed.centroid, [0.0, 0.0], atol=0.01)


@pytest.mark.parametrize("keep", [corner, notch, strip])
def test_rims_beside_an_occluder_do_not_vote(keep):
    features, _, cuts = cuts_of(shown(keep))
    x, y = features.p[:, :2].T
    own = np.minimum(0.5 * LENGTH - np.abs(x), 0.5 * WIDTH - np.abs(y)) < 0.012
    assert not cuts.voting(features)[features.rim & ~own].any()
    far = features.rim & (x < 0.0)
    assert far.any()
    assert cuts.voting(features)[far].all()


@pytest.mark.parametrize("kind", [BoundaryKind.OCCLUDED, BoundaryKind.CUT])
def test_a_hidden_side_is_open_in_its_direction_alone(kind):
    cloud = shown(strip, kind)
    _, _, cuts = cuts_of(cloud)
    assert cuts.towards(AXES).tolist() == [True, False, False, False]
    assert cuts.outline.cut == (kind is BoundaryKind.CUT)


def test_a_concave_outline_that_is_seen_is_not_hidden():
    cloud = shown(corner)
    seen = np.full(len(cloud.boundary), BoundaryKind.SEEN, np.int8)
    _, hull, cuts = cuts_of(replace(cloud, boundary=Boundary(cloud.boundary.points, seen)))
    assert not cuts
    np.testing.assert_array_equal(cuts.completed(hull).vertices, hull.vertices)


@pytest.mark.parametrize("keep", [corner, notch])
def test_contacts_are_right_where_both_ends_of_each_dimension_are_seen(keep):
    skill = learn(box_demonstration([0.68, 0.61, 0.28], view="top"))
    found = transfer(skill, shown(keep), parameters=FEW)
    assert not found.hidden
    assert np.linalg.norm(found[0].X_SG.p[0] - [0.0, 0.0, 0.1]) < 0.02


def test_where_an_end_is_hidden_the_stated_interval_holds_the_true_site(tmp_path):
    skill = learn(box_demonstration([0.68, 0.61, 0.28], view="top"))
    found = transfer(skill, shown(strip), parameters=FEW)
    (extent,) = found.hidden
    assert extent.cause == "occluded"
    np.testing.assert_allclose(extent.direction, [1.0, 0.0, 0.0], atol=0.1)
    assert extent.low[0] < -0.02 < 0.02 < extent.high[0]
    # The seen part's own middle is the contact on the smallest object.
    assert extent.low[0] == pytest.approx(-0.075 - 0.02, abs=0.02)
    found.write(tmp_path / "contacts.json")
    again = ContactSolutions.read(tmp_path / "contacts.json")
    np.testing.assert_array_equal(again.hidden[0].high, extent.high)
