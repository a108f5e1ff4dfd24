import numpy as np
import pytest
import trimesh

from drake_aerial.cloud.partial_views import partial_view
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.features import orientation
from drake_aerial.features.surface_features import compute_features
from drake_aerial.io.model_files import models_dir


@pytest.mark.parametrize("viewpoint", [None, [0, 0, 3.0]])
@pytest.mark.parametrize("thickness", [0.008, 0.01, 0.016, 0.025])
def test_both_faces_of_a_plate_have_normals_out_of_it(thickness, viewpoint):
    cloud = PointCloud.read(trimesh.creation.box([0.6, 0.4, thickness]), viewpoint=viewpoint)
    f = compute_features(cloud)
    top, bottom = f.p[:, 2] > 0.4 * thickness, f.p[:, 2] < -0.4 * thickness
    assert np.mean(f.normal[top, 2] > 0.5) > 0.97
    assert np.mean(f.normal[bottom, 2] > 0.5) < 0.03


def test_noisy_plates_too():
    cloud = PointCloud.read(trimesh.creation.box([0.6, 0.4, 0.012]))
    f = compute_features(cloud.with_noise(0.001, np.random.default_rng(0)))
    assert np.mean(f.normal[f.p[:, 2] > 0.005, 2] > 0.5) > 0.95
    assert np.mean(f.normal[f.p[:, 2] < -0.005, 2] > 0.5) < 0.05


@pytest.mark.parametrize("name", ["bunny", "teapot", "hollow_triangle", "ridged_parcel"])
def test_other_shapes_are_no_plates(name):
    mesh = trimesh.load(models_dir() / "meshes" / f"{name}.obj", process=False)
    for cloud in (PointCloud.read(mesh), partial_view(mesh, [0.5, -0.8, 1.0])):
        f = compute_features(cloud)
        for n in (f.normal, -f.normal):
            np.testing.assert_array_equal(orientation.facing_out_of_plates(f.p, n, 0.03), n)
