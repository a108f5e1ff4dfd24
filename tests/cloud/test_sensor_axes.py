"""Depth images of a box from several places, as points in the camera's own axes."""

import numpy as np
import pytest
import trimesh

from drake_aerial.cloud.partial_views import partial_view
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.cloud.sensor_axes import camera_axes
from drake_aerial.errors import InputError
from drake_aerial.features.surface_features import compute_features

RNG = np.random.default_rng(0)
HEIGHT, WIDTH, FOCAL = 120, 160, 150.0


def pixels(eye=(0.3, -1.2, 1.0), noise=0.002):
    """Return a camera's points (N, 3) of a box, in the camera's axes, and R_WC (3, 3)."""
    eye = np.array(eye)
    z = np.array([0, 0, 0.1]) - eye
    z /= np.linalg.norm(z)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    R_WC = np.stack([x, np.cross(z, x), z], axis=1)
    v, u = np.mgrid[:HEIGHT, :WIDTH].reshape(2, -1)
    ray = np.c_[(u - WIDTH / 2) / FOCAL, (v - HEIGHT / 2) / FOCAL, np.ones(u.size)]
    # Slabs: a ray is inside the box between its last entry and its first exit.
    entry, leave = (
        ([-0.3, -0.2, 0.0] - eye) / (ray @ R_WC.T),
        ([0.3, 0.2, 0.2] - eye) / (ray @ R_WC.T),
    )
    near, far = np.minimum(entry, leave).max(axis=1), np.maximum(entry, leave).min(axis=1)
    hit = near < far
    depth = near[hit] + noise * RNG.standard_normal(hit.sum())
    return ray[hit] * depth[:, None], R_WC


VIEW, R_WC = pixels()
FLIP = np.array([1.0, -1.0, -1.0])


def voxels(points, size):
    """Return the mean of the points in each occupied cube of side `size` [m]."""
    _, cube = np.unique(np.floor(points / size), axis=0, return_inverse=True)
    cube = cube.ravel()
    sums = [np.bincount(cube, points[:, k]) for k in range(3)]
    return np.stack(sums, axis=1) / np.bincount(cube)[:, None]


def shuffled(points):
    return points[RNG.permutation(len(points))]


@pytest.mark.parametrize(
    "points",
    [
        VIEW,
        VIEW.astype("<f4").astype(float),
        np.round(VIEW, 5),
        VIEW[RNG.permutation(len(VIEW))[:1500]],
        VIEW[(np.abs(VIEW[:, 0]) < 0.2)],
        pixels(eye=(0.01, 0.0, 1.5))[0],
        np.round(shuffled(VIEW), 3),
        shuffled(voxels(VIEW, 0.005)),
        shuffled(voxels(VIEW, 0.01)),
        voxels(VIEW, 0.03),
        voxels(VIEW[np.abs(VIEW[:, 0]) < 0.2], 0.01),
        voxels(np.round(pixels(eye=(0.6, -0.9, 0.7))[0], 3), 0.006),
    ],
)
def test_camera_axes_are_recognised(points):
    for flip, axes in ((1.0, "z forward"), (FLIP, "z backward")):
        found = camera_axes(points * flip)
        assert (found.axes, found.certain) == (axes, True)


def height_map():
    x, y = np.mgrid[-0.3:0.3:60j, -0.2:0.2:40j].reshape(2, -1)
    return np.c_[x, y, 1.0 + 0.1 * np.cos(9 * x)]


def surface(mesh, offset):
    return trimesh.sample.sample_surface(mesh, 6000, seed=1)[0] + offset


BOX = trimesh.creation.box([0.6, 0.4, 0.2])
CYLINDER = trimesh.creation.cylinder(0.2, 0.3)


@pytest.mark.parametrize(
    "points",
    [
        VIEW @ R_WC.T + [0.3, -1.2, 1.0],
        height_map() * [1, 1, 0],
        surface(BOX, [0.2, 0.1, 1.0]),
        surface(BOX, [0.2, 0.1, -1.0]),
        surface(CYLINDER, [0.0, 0.3, 1.2]),
    ],
)
def test_scans_about_the_origin_or_from_all_sides_have_z_up_without_a_word(points):
    assert camera_axes(points) is None
    assert PointCloud.read(points).assumptions == ()


@pytest.mark.parametrize(
    "points",
    [
        VIEW @ R_WC.T,  # from above, z up, the sensor at the origin
        voxels(VIEW @ R_WC.T, 0.01),
        height_map(),
        height_map() * [1, 1, 0] + [0, 0, 1],
        np.c_[RNG.uniform(-0.3, 0.3, (3000, 2)), np.ones(3000)],
        partial_view(BOX, [0, 0, 2.0]).points + [0, 0, 1.0],
        partial_view(BOX, [0.5, -1.0, 1.0]).points + [0.1, 0, 1.0],
        partial_view(CYLINDER, [0.5, -1.0, 1.0]).points + [0.1, 0, 1.0],
        VIEW[:100],
    ],
)
def test_where_the_axes_are_undecided_the_assumed_up_is_said(points):
    assert not camera_axes(points).certain
    cloud = PointCloud.read(points)
    cloud.require_up()
    (assumption,) = cloud.assumptions
    assert str(assumption).startswith("up: 0 0 1; but the points could be one camera's view")
    assert cloud.viewpoint is None
    assert PointCloud.read(points, up=[0, 0, 1]).assumptions == ()


def test_a_sensor_below_all_points_has_another_up():
    points = height_map()
    assert not camera_axes(points).certain
    cloud = PointCloud.read(points, viewpoint=[0, 0, 0])
    with pytest.raises(InputError, match="up is unknown"):
        cloud.require_up()


@pytest.mark.parametrize(("flip", "level"), [(1.0, "0 -1 0"), (FLIP, "0 1 0")])
def test_normals_face_the_camera_and_up_is_asked_for(flip, level):
    cloud = PointCloud.read(VIEW * flip)
    np.testing.assert_array_equal(cloud.viewpoint, [0, 0, 0])
    features = compute_features(cloud)
    assert np.all(np.sum(features.normal * -features.p, axis=1) > 0.0)
    assert [str(a.kind) for a in cloud.assumptions] == ["axes", "up"]
    with pytest.raises(InputError, match=rf"camera axes; up is unknown.* --up X Y Z \({level} for"):
        cloud.require_up()


def test_a_given_up_is_enough():
    up = R_WC.T @ [0, 0, 1.0]
    cloud = PointCloud.read(VIEW, up=up)
    cloud.require_up()
    assert cloud.up_is_known
    assert [str(a.kind) for a in cloud.assumptions] == ["axes"]


def test_a_given_viewpoint_elsewhere_is_believed():
    cloud = PointCloud.read(VIEW, viewpoint=[0, 0, -1.0])
    np.testing.assert_array_equal(cloud.viewpoint, [0, 0, -1.0])
    assert cloud.assumptions == ()
    cloud.require_up()
