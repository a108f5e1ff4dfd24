"""Scenes whose pixels are cast analytically: gravity, supports, objects, boundaries are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drake_aerial import PointCloud
from drake_aerial.cloud.boundary import BoundaryKind
from drake_aerial.errors import InputError
from drake_aerial.geometry import Pose, quat_about_axis, quat_from_matrix, random_rotation
from drake_aerial.scene.find_scene import find_scene
from drake_aerial.scene.fused_views import fuse_views
from drake_aerial.scene.scene import FIRST_OBJECT, SUPPORT, GravitySource
from drake_aerial.scene.scene_image import SceneImage
from tests.scene.rendered_scenes import (
    RenderedScene,
    box,
    camera_pose,
    cylinder,
    floor,
    tray,
    wall,
)

TWO_BOXES = [
    floor(),
    box(2, [0.0, 0.1], [0.3, 0.2, 0.15], 0.4),
    box(3, [0.1, -0.25], [0.2, 0.2, 0.3]),
]


def rendered(solids, distance=1.3, pitch=40.0, azimuth=0.3, roll=0.0, target=(0.0, 0.0, 0.1)):
    return RenderedScene(solids, *camera_pose(target, distance, pitch, azimuth, roll))


def found_in(view, seed=0, **options):
    return find_scene(view.cloud(np.random.default_rng(seed)), **options)


def angle_deg(first, second):
    return np.rad2deg(np.arccos(np.clip(first @ second, -1.0, 1.0)))


@pytest.mark.parametrize("pitch", [25.0, 45.0, 80.0])
def test_things_on_a_floor_are_found_with_their_pixels(pitch):
    view = rendered([*TWO_BOXES, cylinder(4, [-0.25, -0.1], 0.12, 0.2)], pitch=pitch)
    scene = found_in(view)
    assert len(scene.objects) == 3
    assert [view.overlap(scene.label_image(), label) > 0.85 for label in (2, 3, 4)] == [True] * 3


@pytest.mark.parametrize("seed", range(3))
def test_gravity_from_the_support_is_within_half_a_degree(seed):
    view = rendered(TWO_BOXES, pitch=30.0 + 20.0 * seed, roll=5.0 * seed)
    scene = found_in(view, seed)
    assert scene.gravity.source is GravitySource.SUPPORT
    error = angle_deg(scene.gravity.up, view.up_C)
    assert error < 0.5
    assert error < 3.0 * scene.gravity.uncertainty_deg < 3.0


def test_no_pixel_of_the_floor_belongs_to_an_object():
    view = rendered(TWO_BOXES)
    labels = found_in(view).label_image()
    on_floor = view.labels == SUPPORT
    assert np.mean(labels[on_floor] >= FIRST_OBJECT) < 0.001


def test_a_large_wall_is_not_the_support():
    view = rendered([*TWO_BOXES, wall([0.8, 0.0])], pitch=20.0, azimuth=0.0, distance=1.2)
    assert np.mean(view.labels == 0) > 0.25
    scene = found_in(view)
    assert angle_deg(scene.gravity.up, view.up_C) < 1.0
    assert view.overlap(scene.label_image(), 3) > 0.85


def test_the_top_of_a_large_parcel_with_a_small_one_on_it_is_not_a_support():
    solids = [
        floor(),
        box(2, [0.0, 0.0], [0.7, 0.6, 0.3], 0.5),
        box(3, [0.0, 0.0], [0.2, 0.15, 0.1], bottom=0.3),
    ]
    view = rendered(solids, distance=1.8)
    scene = found_in(view)
    assert len(scene.supports) == 1
    assert [view.overlap(scene.label_image(), label) > 0.85 for label in (2, 3)] == [True] * 2


def test_a_table_and_the_floor_below_are_two_supports():
    table = floor((0.8, 0.8), height=0.6)
    solids = [
        floor(),
        table,
        box(2, [0.0, 0.0], [0.25, 0.2, 0.15], 0.4, bottom=0.6),
        box(3, [0.1, 0.8], [0.3, 0.3, 0.3]),
    ]
    view = rendered(solids, distance=2.0, pitch=50.0, target=(0.0, 0.3, 0.4))
    scene = found_in(view)
    assert len(scene.supports) == 2
    assert [view.overlap(scene.label_image(), label) > 0.8 for label in (2, 3)] == [True] * 2


def test_stacked_boxes_are_parted_at_their_concave_edge():
    solids = [
        floor(),
        box(2, [0.0, 0.0], [0.4, 0.3, 0.15]),
        box(3, [0.0, 0.0], [0.2, 0.15, 0.12], 0.7, bottom=0.15),
    ]
    view = rendered(solids)
    labels = found_in(view).label_image()
    assert [view.overlap(labels, label) > 0.85 for label in (2, 3)] == [True] * 2


def test_an_open_tray_is_one_object_with_its_floor():
    view = rendered([floor(), *tray(2, [0.0, 0.0], [0.4, 0.3, 0.12], yaw=0.3)])
    scene = found_in(view)
    assert view.overlap(scene.label_image(), 2) > 0.85
    assert len(scene.objects) == 1


def test_parts_on_both_sides_of_an_occluder_are_one_object():
    solids = [
        floor(),
        box(2, [0.25, 0.0], [0.12, 0.5, 0.12]),
        box(3, [-0.1, 0.0], [0.08, 0.12, 0.4]),
    ]
    view = rendered(solids, azimuth=0.0, pitch=30.0)
    scene = found_in(view)
    assert view.overlap(scene.label_image(), 2) > 0.85
    number = scene.label_image()[view.labels == 2].max()
    assert scene.object_of(int(number)).boundary.share(BoundaryKind.OCCLUDED) > 0.1


def test_the_boundary_is_seen_on_a_free_object_and_hidden_behind_an_occluder():
    solids = [
        floor(),
        box(2, [0.25, 0.0], [0.15, 0.4, 0.12]),
        box(3, [-0.1, 0.2], [0.08, 0.12, 0.3]),
    ]
    view = rendered(solids, azimuth=0.0, pitch=30.0)
    scene = found_in(view)
    front = scene.object_of(int(scene.label_image()[view.labels == 3].max()))
    back = scene.object_of(int(scene.label_image()[view.labels == 2].max()))
    assert front.boundary.share(BoundaryKind.SEEN) > 0.95
    hidden = back.boundary.points_of(BoundaryKind.OCCLUDED)
    assert len(hidden) > 10
    # The occluder's image is beside the hidden boundary.
    pixels = np.rint(scene.image.pixels_of(hidden)).astype(int)
    near = [
        (view.labels[max(r - 4, 0) : r + 5, max(c - 4, 0) : c + 5] == 3).any() for r, c in pixels
    ]
    assert np.mean(near) > 0.95


def test_the_border_of_the_image_cuts():
    view = rendered(
        [floor(), box(2, [0.0, 0.55], [0.3, 0.4, 0.2])], target=(0.0, 0.0, 0.1), azimuth=0.0
    )
    cut = found_in(view).objects[0]
    assert cut.touches_border
    assert cut.boundary.share(BoundaryKind.CUT) > 0.1


def test_objects_turn_with_the_cloud():
    view = rendered(TWO_BOXES)
    cloud = view.cloud(np.random.default_rng(0))
    X_NS = Pose(np.array([1.0, -2.0, 0.5]), random_rotation(np.random.default_rng(1)))
    here = find_scene(cloud)
    there = find_scene(SceneImage.of_cloud(cloud.transformed(X_NS), X_NS))
    assert np.mean(here.labels == there.labels) > 0.999
    assert angle_deg(here.gravity.up, PointCloud.transformed(here.cloud_of(2), X_NS).up) >= 0.0
    turned = replace(here.cloud, up=here.gravity.up).transformed(X_NS).up
    assert angle_deg(turned, there.gravity.up) < 0.01


def test_a_given_direction_that_contradicts_the_support_is_reported():
    view = rendered(TWO_BOXES)
    tilt = np.deg2rad(6.0)
    up = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    scene = found_in(view, up=up @ view.up_C)
    assert scene.gravity.source is GravitySource.GIVEN
    assert scene.gravity.disagreement_deg == pytest.approx(6.0, abs=0.5)
    assert "differ by" in scene.gravity.warning
    assert found_in(view, up=view.up_C).gravity.warning is None


def test_an_imu_is_used_where_no_direction_is_given():
    view = rendered(TWO_BOXES)
    scene = found_in(view, imu=9.81 * view.up_C)
    assert scene.gravity.source is GravitySource.IMU
    assert angle_deg(scene.gravity.up, view.up_C) < 1e-5


def test_a_cloud_without_a_grid_seen_from_its_viewpoint_gives_the_same_objects():
    view = rendered(TWO_BOXES, pitch=45.0)
    cloud = view.cloud(np.random.default_rng(0))
    X_WC = Pose(view.p_WC, quat_from_matrix(view.R_WC))
    points = cloud.transformed(X_WC).points
    points = points[np.random.default_rng(1).permutation(len(points))]
    scene = find_scene(PointCloud.read(points, viewpoint=view.p_WC))
    assert len(scene.objects) == 2
    true = {2: [0.3, 0.2, 0.15], 3: [0.2, 0.2, 0.3]}
    heights = sorted(found.box.size[2] for found in scene.objects)
    assert heights == pytest.approx(sorted(size[2] for size in true.values()), abs=0.02)


def test_one_clean_object_without_a_support_is_the_cloud_itself():
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (20000, 3))
    axis = np.random.default_rng(1).integers(0, 3, 20000)
    points[np.arange(20000), axis] = np.sign(points[np.arange(20000), axis]) * 0.5
    cloud = PointCloud.read(points * [0.68, 0.61, 0.28])
    scene = find_scene(cloud)
    assert scene.is_one_object
    assert scene.cloud_of(2) is cloud


def test_two_views_fused_show_both_boxes_from_above():
    views = [rendered(TWO_BOXES, pitch=50.0, azimuth=azimuth) for azimuth in (0.3, 3.4)]
    poses = [Pose(view.p_WC, quat_from_matrix(view.R_WC)) for view in views]
    clouds = [view.cloud(np.random.default_rng(k)) for k, view in enumerate(views)]
    fused = replace(fuse_views(clouds, poses), up=np.array([0.0, 0.0, 1.0]), up_is_known=True)
    assert fused.viewpoint is None
    scene = find_scene(fused)
    assert len(scene.objects) == 2
    sizes = sorted((found.box.size.tolist() for found in scene.objects), key=lambda size: size[2])
    assert sizes[0] == pytest.approx([0.3, 0.2, 0.15], abs=0.03)
    assert sizes[1] == pytest.approx([0.2, 0.2, 0.3], abs=0.03)


def test_views_without_poses_are_registered():
    cloud = rendered(TWO_BOXES, pitch=50.0).cloud(np.random.default_rng(0))
    X = Pose(np.array([0.02, -0.01, 0.015]), quat_about_axis([0.0, 0.0, 1.0], np.asarray(0.05)))
    fused = fuse_views([cloud, cloud.transformed(X)])
    count = len(cloud)
    assert np.abs(fused.points[:count] - fused.points[count:]).max() < 0.005
    far = cloud.transformed(Pose(np.array([5.0, 0.0, 0.0]), X.q))
    with pytest.raises(InputError, match="give the views' poses"):
        fuse_views([cloud, far])


def test_choosing_an_object_by_number_pixel_and_place():
    view = rendered(TWO_BOXES)
    scene = found_in(view)
    row, column = np.argwhere(view.labels == 3).mean(axis=0)
    chosen = scene.object_at_pixel(column, row)
    assert scene.object_at(scene.cloud.points[chosen.indices].mean(axis=0)).number == chosen.number
    with pytest.raises(InputError, match="shows the support"):
        scene.object_at_pixel(*np.argwhere(view.labels == SUPPORT)[-20][::-1])
    with pytest.raises(InputError, match="the scene has the objects 2, 3"):
        scene.object_of(7)
    with pytest.raises(InputError, match="no object is at"):
        scene.object_at([0.0, 0.0, 0.2])


@pytest.mark.parametrize(
    ("solids", "message"),
    [
        ([floor()], "only a plane"),
        ([floor(), box(2, [0.0, 0.0], [0.006, 0.006, 0.3])], "nothing stands|only a plane"),
    ],
)
def test_scenes_without_an_object_say_what_to_do(solids, message):
    with pytest.raises(InputError, match=message) as raised:
        found_in(rendered(solids))
    assert "\n" not in str(raised.value)


def test_an_object_that_fills_the_image_says_what_to_do():
    view = rendered(
        [floor(), box(2, [0.0, 0.0], [2.0, 2.0, 2.0])], distance=1.5, target=(0.0, 0.0, 1.8)
    )
    with pytest.raises(InputError, match=r"fills the image|only a plane"):
        found_in(view)
