import numpy as np
import pytest
import trimesh
from mesh_normals import closest_normals, thickness

from drake_aerial.model_files import models_dir
from drake_aerial.perception import orientation
from drake_aerial.perception.point_cloud import PointCloud
from drake_aerial.perception.surface_features import compute_features

UP = np.array([0.0, 0.0, 1.0])


def outward(mesh, noise=0.0, samples=20000):
    """Whether each feature's normal is within 90 degrees of the mesh's own, and the wall's thickness there [m]."""
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
    # Where a part is thinner than rho, as the teapot's handle, a ball holds all of it and has no normal to find.
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
