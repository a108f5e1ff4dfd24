import numpy as np
import pytest
import trimesh

from drake_aerial.cloud.partial_views import partial_view
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.features import orientation
from drake_aerial.features.surface_features import compute_features
from drake_aerial.io.model_files import models_dir
from tests.features.mesh_normals import closest_normals, thickness

UP = np.array([0.0, 0.0, 1.0])


def outward(mesh, noise=0.0, samples=20000):
    """Return if each normal is within 90 degrees of the mesh's, and the wall thickness [m]."""
    cloud = PointCloud.read(mesh, samples=samples).with_noise(noise, np.random.default_rng(0))
    f = compute_features(cloud)
    truth = closest_normals(mesh, f.p)
    return np.sum(f.normal * truth, axis=1) > 0, thickness(mesh, f.p, truth)


@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize("name", ["bunny", "teapot", "hollow_triangle"])
def test_full_clouds_of_shipped_meshes_point_outward(name, noise):
    mesh = trimesh.load(models_dir() / "meshes" / f"{name}.obj", process=False)
    right, thick = outward(mesh, noise)
    assert right[thick > 0.03].mean() > 0.995
    # Where a part is thinner than rho, as the teapot's handle is, a ball holds all of it, and its
    # normal is not defined.
    assert right.mean() > 0.95


def test_scrambled_signs_are_restored():
    mesh = trimesh.creation.torus(0.3, 0.1, major_sections=128, minor_sections=64)
    points = PointCloud.read(mesh, samples=8000).downsampled(0.0075).points
    truth = closest_normals(mesh, points)
    flips = np.random.default_rng(0).choice([-1.0, 1.0], (len(points), 1))
    got = orientation.consistently(points, truth * flips, UP, 0.03)
    np.testing.assert_array_equal(got, truth)


def test_towards_viewpoint():
    points = np.array([[0.0, 0, 0], [1.0, 0, 0]])
    normals = np.array([[0.0, 0, 1], [0, 0, -1]])
    got = orientation.towards_viewpoint(points, normals, np.array([0.5, 0, 2.0]))
    np.testing.assert_array_equal(got, [[0, 0, 1], [0, 0, 1]])


def test_box_seen_from_one_corner_without_viewpoint():
    # Three of the faces only: neither closed nor flat.
    box = trimesh.creation.box([0.5, 0.4, 0.3])
    cloud = PointCloud.read(box, samples=20000)
    seen = (cloud.points > np.array([0.25, 0.2, 0.15]) - 1e-6).any(axis=1)
    part = PointCloud.read(cloud.points[seen])
    f = compute_features(part)
    gap = np.array([0.25, 0.2, 0.15]) - f.p
    assert np.all(f.normal[np.arange(len(f)), np.argmin(gap, axis=1)] > 0)


def flat(count=41, spacing=0.005):
    """Return a flat grid in the y-z plane; its middle point is its centroid."""
    grid = spacing * (
        np.stack(np.meshgrid(np.arange(count), np.arange(count)), axis=-1).reshape(-1, 2)
        - count // 2
    )
    return np.column_stack([np.zeros(len(grid)), grid])


def test_a_flat_wall_looks_to_one_side():
    # Every edge of its graph is free of doubt, and neither up nor away tells which side is out.
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (41**2, 1))
    got = orientation.consistently(flat(), signs * np.array([1.0, 0.0, 0.0]), UP, 0.03)
    assert np.abs(got[:, 0].sum()) == 41**2
    np.testing.assert_array_equal(got[:, 1:], 0.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_flat_floor_looks_up_whatever_its_normals_were(sign):
    floor = flat()[:, [1, 2, 0]]
    normals = np.tile([0.0, 0.0, sign], (len(floor), 1))
    np.testing.assert_array_equal(
        orientation.consistently(floor, normals, UP, 0.03), np.tile(UP, (len(floor), 1))
    )


def test_points_given_twice_change_nothing():
    mesh = trimesh.creation.torus(0.3, 0.1, major_sections=128, minor_sections=64)
    points = PointCloud.read(mesh, samples=8000).downsampled(0.01).points
    truth = closest_normals(mesh, points)
    twice, flips = (
        np.repeat(points, 2, axis=0),
        np.random.default_rng(1).choice([-1.0, 1.0], (2 * len(points), 1)),
    )
    got = orientation.consistently(twice, np.repeat(truth, 2, axis=0) * flips, UP, 0.03)
    np.testing.assert_array_equal(got, np.repeat(truth, 2, axis=0))


def test_parts_further_apart_than_the_radius_are_turned_each_by_itself():
    # Two floors, one above the other: their neighbourhoods do not meet, and both look up.
    floor = flat()[:, [1, 2, 0]]
    points = np.vstack([floor, floor + [0.0, 0.0, 0.031]])
    normals = np.repeat([UP, -UP], len(floor), axis=0)
    np.testing.assert_array_equal(
        orientation.consistently(points, normals, UP, 0.03), np.tile(UP, (len(points), 1))
    )


def test_outward_is_weakly_away_from_the_middle():
    # Four upright walls with gaps at their corners: four parts without another cue for outside.
    wall = flat(31) + [0.15, 0.0, 0.0]
    turns = [
        np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))
    ]
    points = np.vstack([wall @ turn.T for turn in turns])
    truth = np.repeat([turn[:, 0] for turn in turns], len(wall), axis=0).astype(float)
    flips = np.random.default_rng(2).choice([-1.0, 1.0], (len(points), 1))
    np.testing.assert_array_equal(orientation.consistently(points, truth * flips, UP, 0.03), truth)


def test_directions_are_spread_evenly_over_the_sphere():
    directions = orientation._sphere_directions(128)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(directions.mean(axis=0), 0.0, atol=0.01)
    np.testing.assert_allclose(directions.T @ directions / 128, np.eye(3) / 3, atol=0.01)
    cosine = directions @ directions.T - 2.0 * np.eye(128)
    # Even spacing: about sqrt(4 pi / 128) rad from each to its nearest.
    assert np.arccos(cosine.max(axis=1)).min() > 0.7 * np.sqrt(4 * np.pi / 128)


def test_a_viewpoint_in_the_tangent_plane_turns_nothing():
    normals = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    got = orientation.towards_viewpoint(np.zeros((2, 3)), normals, np.array([1.0, 0.0, 0.0]))
    np.testing.assert_array_equal(got, normals)


@pytest.mark.parametrize("viewpoint", [[0, 0, 3.0], [2.0, -1.5, 1.0], [0, 0.1, -2.0]])
@pytest.mark.parametrize("size", [(0.6, 0.4, 0.2), (0.5, 0.5, 0.06)])
def test_a_viewpoint_does_not_flip_what_it_cannot_see(viewpoint, size):
    box = trimesh.creation.box(size)
    cloud = PointCloud.read(box, viewpoint=viewpoint)
    f = compute_features(cloud)
    assert np.mean(np.sum(f.normal * closest_normals(box, f.p), axis=1) > 0) > 0.98
    assert [str(a.kind) for a in f.assumptions] == ["outside"]
    assert "hidden from the viewpoint" in f.assumptions[0].text


@pytest.mark.parametrize("viewpoint", [[1.2, -1.0, 0.9], [0.0, 0.1, 1.0], [3.0, 0.0, 0.2]])
@pytest.mark.parametrize("name", ["bunny", "teapot", "hollow_triangle"])
def test_in_a_single_view_next_to_nothing_is_hidden(name, viewpoint):
    mesh = trimesh.load(models_dir() / "meshes" / f"{name}.obj", process=False)
    noise = np.random.default_rng(0)
    f = compute_features(partial_view(mesh, viewpoint, noise=0.002, rng=noise))
    assert f.assumptions == ()
    assert np.all(np.sum(f.normal * (viewpoint - f.p), axis=1) > -1e-9)
