"""Hulls of partial views are closed downwards; those of complete scans are left alone."""

import re

import numpy as np
import pytest
import trimesh

from drake_aerial.cloud.partial_views import partial_view
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.plant.payload import Payload

SIZE = np.array([0.6, 0.4, 0.2])
BOX = trimesh.creation.box(SIZE)
OFFSET = np.array([0.1, -0.3, 0.7])


@pytest.fixture(scope="module")
def view():
    box = BOX.copy()
    box.apply_translation(OFFSET)
    return partial_view(box, OFFSET + [0.3, -1.2, 1.0], resolution=(160, 120))


def test_a_view_of_three_faces_gives_the_whole_box(view):
    payload = Payload.from_cloud(view, 0.4)
    np.testing.assert_allclose(np.ptp(payload.vertices, axis=0), SIZE, atol=0.01)
    np.testing.assert_allclose(payload.com, OFFSET, atol=0.004)
    seen = Payload.from_cloud(view.points, 0.4)
    assert np.linalg.norm(seen.com - OFFSET) > 0.03


def test_what_was_not_seen_is_said_with_the_error_that_it_may_cause(view):
    (assumption,) = Payload.from_cloud(view, 0.4).assumptions
    text = str(assumption)
    assert text.startswith("unseen: the payload is the scan's convex hull, closed downwards")
    seen = trimesh.convex.convex_hull(view.points)
    assert f"{1 - seen.volume / BOX.volume:.0%} of its volume" in text
    sideways, upright = map(float, re.findall(r"([0-9.]+) cm", text))
    # The scan's own hull is one of the shapes that the payload could have.
    off = np.linalg.norm((seen.center_mass - OFFSET)[:2])
    assert 100 * off <= sideways < 15.0
    assert upright < 15.0


def test_the_hull_does_not_depend_on_the_axes(view):
    turn = trimesh.transformations.random_rotation_matrix(np.array([0.1, 0.5, 0.9]))[:3, :3]
    turned = PointCloud.read(view.points @ turn.T, viewpoint=turn @ view.viewpoint, up=turn[:, 2])
    there, here = Payload.from_cloud(turned, 0.4), Payload.from_cloud(view, 0.4)
    np.testing.assert_allclose(there.com, turn @ here.com, atol=1e-9)
    np.testing.assert_allclose(there.inertia, turn @ here.inertia @ turn.T, atol=1e-9)


@pytest.mark.parametrize(
    "mesh",
    [
        BOX,
        trimesh.creation.icosphere(radius=0.2),
        trimesh.creation.cone(0.2, 0.4).apply_transform(np.diag([1.0, -1.0, -1.0, 1.0])),
    ],
)
@pytest.mark.parametrize("viewpoint", [None, [0.0, 0.0, 3.0]])
def test_a_complete_scan_is_not_closed_downwards(mesh, viewpoint):
    points = trimesh.sample.sample_surface(mesh, 8000, seed=2)[0]
    payload = Payload.from_cloud(PointCloud.read(points, viewpoint=viewpoint))
    assert payload.assumptions == ()
    hull = trimesh.convex.convex_hull(points)
    np.testing.assert_allclose(payload.com, hull.center_mass, atol=1e-6)


def test_a_scan_without_its_bottom_is_not_closed_downwards():
    points = trimesh.sample.sample_surface(BOX, 8000, seed=2)[0]
    cloud = PointCloud.read(points[points[:, 2] > -0.095])
    assert Payload.from_cloud(cloud).assumptions == ()
