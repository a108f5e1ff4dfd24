import numpy as np
import open3d as o3d
import pytest
import trimesh

from drake_aerial.cloud.partial_views import partial_view
from drake_aerial.errors import InputError
from drake_aerial.features.surface_features import compute_features
from tests.features.mesh_normals import closest_normals

SIZE = np.array([0.68, 0.61, 0.28])
BOX = trimesh.creation.box(SIZE)


def faces_of(points):
    """The set of box faces (axis, sign) that points lie on."""
    gap = np.abs(np.abs(points) - SIZE / 2)
    axis = np.argmin(gap, axis=1)
    assert gap.min(axis=1).max() < 1e-5
    return {(int(a), int(s)) for a, s in zip(axis, np.sign(points[np.arange(len(points)), axis]))}


def test_from_above_only_the_top_face_is_seen():
    cloud = partial_view(BOX, [0, 0, 1.5])
    assert faces_of(cloud.points) == {(2, 1)}
    np.testing.assert_array_equal(cloud.viewpoint, [0, 0, 1.5])
    # The default angle shows all of it.
    np.testing.assert_allclose(cloud.extent[:2], SIZE[:2], atol=0.02)
    assert compute_features(cloud).normal[:, 2].min() > 0.99


def test_from_a_corner_three_faces_are_seen_and_normals_look_at_the_camera():
    viewpoint = np.array([1.2, -1.0, 0.9])
    cloud = partial_view(BOX, viewpoint)
    assert faces_of(cloud.points) == {(0, 1), (1, -1), (2, 1)}
    f = compute_features(cloud)
    assert np.mean(np.sum(f.normal * closest_normals(BOX, f.p), axis=1) > 0) > 0.99
    assert np.all(np.sum(f.normal * (viewpoint - f.p), axis=1) > 0)


def test_every_point_is_the_first_on_its_ray():
    # A small sphere before a large one: where it is in the way, nothing of the large one is seen.
    near = trimesh.creation.icosphere(subdivisions=4, radius=0.1)
    near.apply_translation([1.0, 0, 0])
    far = trimesh.creation.icosphere(subdivisions=4, radius=0.3)
    points = partial_view(trimesh.util.concatenate([near, far]), [2.0, 0, 0]).points
    on_far = np.abs(np.linalg.norm(points, axis=1) - 0.3) < 5e-3
    on_near = np.abs(np.linalg.norm(points - [1.0, 0, 0], axis=1) - 0.1) < 5e-3
    assert np.all(on_far | on_near)
    # Tangent of the small sphere's silhouette: sin(a) = 0.1 / 1.
    angle = np.arctan2(np.linalg.norm(points[:, 1:], axis=1), 2.0 - points[:, 0])
    assert angle[on_far].min() > np.arcsin(0.1) - 2e-3
    assert angle[on_near].max() < np.arcsin(0.1) + 2e-3


def test_noise_moves_points_along_their_rays():
    viewpoint = np.array([0.3, 0.2, 1.5])
    clean = partial_view(BOX, viewpoint)
    noisy = partial_view(BOX, viewpoint, noise=0.01, rng=np.random.default_rng(0))
    ray = clean.points - viewpoint
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    error = noisy.points - clean.points
    along = np.sum(error * ray, axis=1)
    np.testing.assert_allclose(error, along[:, None] * ray, atol=1e-12)
    assert abs(along.std() / 0.01 - 1) < 0.03
    assert abs(along.mean()) < 3e-4
    again = partial_view(BOX, viewpoint, noise=0.01, rng=np.random.default_rng(0))
    np.testing.assert_array_equal(noisy.points, again.points)


def test_pixels_and_angle_of_view():
    # A wall much larger than the picture: every pixel sees it, and the angles are those asked for.
    wall = trimesh.creation.box([0.01, 40.0, 40.0])
    cloud = partial_view(wall, [2.005, 0, 0], resolution=(64, 32), fov=np.deg2rad(60.0))
    assert len(cloud) == 64 * 32
    half = 2.0 * np.tan(np.deg2rad(30.0))
    np.testing.assert_allclose(cloud.points[:, 0], 0.005, atol=1e-5)
    np.testing.assert_allclose(np.abs(cloud.points[:, 1]).max(), half * 63 / 64, rtol=1e-5)
    np.testing.assert_allclose(cloud.points[:, 2].max(), 0.5 * half * 31 / 32, rtol=1e-5)
    # The first pixel is the top left one: looking along -x, left is -y.
    assert cloud.points[0, 1] < 0 < cloud.points[0, 2]


def test_other_meshes_and_up(tmp_path):
    path = tmp_path / "box.obj"
    BOX.export(path)
    mesh = o3d.geometry.TriangleMesh.create_box(0.5, 0.5, 0.5)
    for given in (path, mesh):
        assert len(partial_view(given, [1.5, 1.0, 1.5], resolution=(40, 30))) > 100
    cloud = partial_view(BOX, [0, 2.0, 0], up=[0, 5, 0], resolution=(40, 30))
    np.testing.assert_array_equal(cloud.up, [0, 1, 0])
    assert faces_of(cloud.points) == {(1, 1)}


def test_from_inside_the_walls_are_seen():
    assert len(faces_of(partial_view(BOX, [0, 0, 0], target=[1, 0, 0]).points)) >= 3


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"viewpoint": [0, 0]}, "`viewpoint` must be three finite numbers"),
        ({"viewpoint": [0, 0, np.nan]}, "`viewpoint` must be three finite numbers"),
        ({"viewpoint": [0, 0, 0]}, "`viewpoint` and `target` must differ"),
        ({"target": [0, 0, 9.0]}, "nothing of the trimesh Trimesh is in view"),
        ({"noise": -1.0}, "`noise` must be a standard deviation"),
        ({"noise": 0.1}, "`noise` needs `rng`"),
        ({"fov": 4.0}, "`fov` must be in \\(0, pi\\) rad"),
        ({"resolution": (0, 10)}, "`resolution` must be two positive numbers"),
        (
            {"mesh": np.random.default_rng(0).random((50, 3))},
            "the array has points but no triangles",
        ),
    ],
)
def test_impossible_views_are_refused(keywords, message):
    given = {"mesh": BOX, "viewpoint": [0, 0, 2.0]} | keywords
    with pytest.raises(InputError, match=message):
        partial_view(given.pop("mesh"), given.pop("viewpoint"), **given)
