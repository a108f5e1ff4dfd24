import hashlib

import numpy as np
import open3d as o3d
import pytest
import trimesh

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.geometry import Pose, random_rotation, rotate, transform
from drake_aerial.io import archives

POINTS = np.random.default_rng(0).random((200, 3)).astype(np.float32).astype(np.float64)


def legacy_cloud(points=POINTS):
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))


def write(path, points=POINTS):
    if path.suffix == ".npy":
        np.save(path, points)
    elif path.suffix == ".npz":
        np.savez(path, points=points)
    elif path.suffix == ".obj":
        path.write_text("".join(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in points))
    else:
        assert o3d.io.write_point_cloud(str(path), legacy_cloud(points))
    return path


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".npy", ".npz", ".obj"])
def test_files_of_points(tmp_path, suffix):
    path = write(tmp_path / f"scan{suffix}")
    for given in (path, str(path)):
        cloud = PointCloud.read(given)
        np.testing.assert_allclose(cloud.points, POINTS, atol=1e-7)
        assert cloud.path == str(path)
        assert cloud.dropped_points == 0


def test_suffix_in_capitals(tmp_path):
    np.testing.assert_allclose(
        PointCloud.read(write(tmp_path / "a.npy").rename(tmp_path / "A.NPY")).points, POINTS
    )


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".stl"])
def test_files_of_meshes_are_sampled_on_their_surface(tmp_path, suffix):
    path = tmp_path / f"box{suffix}"
    trimesh.creation.box([1.0, 2.0, 3.0]).export(path)
    cloud = PointCloud.read(path, samples=6000)
    assert len(cloud) == 6000
    gap = np.abs(np.array([0.5, 1.0, 1.5]) - np.abs(cloud.points))
    assert gap.min(axis=1).max() < 1e-6
    # By area: the two faces across z are 4 of 22 square metres.
    assert abs(np.mean(gap[:, 2] < 1e-6) - 4 / 22) < 0.01
    np.testing.assert_array_equal(cloud.points, PointCloud.read(path, samples=6000).points)


def objects():
    box = trimesh.creation.box([1.0, 2.0, 3.0])
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(box.vertices), o3d.utility.Vector3iVector(box.faces)
    )
    return {
        "array": POINTS,
        "integers": np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]),
        "float32": POINTS.astype(np.float32),
        "list": POINTS.tolist(),
        "open3d": legacy_cloud(),
        "open3d tensor": o3d.t.geometry.PointCloud(o3d.core.Tensor(POINTS)),
        "trimesh cloud": trimesh.PointCloud(POINTS),
        "open3d mesh": mesh,
        "open3d tensor mesh": o3d.t.geometry.TriangleMesh.from_legacy(mesh),
        "trimesh": box,
        "trimesh scene": trimesh.Scene([box]),
    }


@pytest.mark.parametrize("name", list(objects()))
def test_objects(name):
    given = objects()[name]
    cloud = PointCloud.read(given, samples=500)
    assert cloud.points.dtype == np.float64
    assert cloud.path is None
    if isinstance(given, trimesh.Trimesh | trimesh.Scene) or "TriangleMesh" in type(given).__name__:
        assert len(cloud) == 500
        assert np.abs(np.array([0.5, 1.0, 1.5]) - np.abs(cloud.points)).min(axis=1).max() < 1e-6
    else:
        np.testing.assert_array_equal(cloud.points, given if name == "integers" else POINTS)


def test_reading_copies_and_freezes():
    given = POINTS.copy()
    cloud = PointCloud.read(given)
    given[0] = 99.0
    assert cloud.points.max() < 2.0
    with pytest.raises(ValueError, match="read-only"):
        cloud.points[0] = 0.0


def test_non_finite_points_are_dropped_and_counted():
    points = POINTS.copy()
    points[3, 1], points[7], points[9, 0] = np.nan, np.nan, np.inf
    cloud = PointCloud.read(points)
    assert cloud.dropped_points == 3
    np.testing.assert_array_equal(cloud.points, np.delete(POINTS, [3, 7, 9], axis=0))


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".npy"])
def test_non_finite_points_in_files(tmp_path, suffix):
    points = POINTS.copy()
    points[:5] = np.nan
    cloud = PointCloud.read(write(tmp_path / f"depth{suffix}", points))
    assert cloud.dropped_points == 5
    assert len(cloud) == 195


def test_hash_is_that_of_the_points():
    assert (
        PointCloud.read(POINTS).sha256 == hashlib.sha256(POINTS.astype("<f8").tobytes()).hexdigest()
    )
    assert PointCloud.read(POINTS).sha256 != PointCloud.read(POINTS[::-1]).sha256


def test_up_and_viewpoint():
    cloud = PointCloud.read(POINTS, up=(0, -3, 0), viewpoint=[1, 2, 3])
    np.testing.assert_array_equal(cloud.up, [0, -1, 0])
    np.testing.assert_array_equal(cloud.viewpoint, [1, 2, 3])


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"up": (0, 0, 0)}, "`up` must be a direction of positive length"),
        ({"up": (0, 0)}, "`up` must be three finite numbers"),
        ({"up": (0, 0, np.nan)}, "`up` must be three finite numbers"),
        ({"up": "z"}, "`up` must be three numbers, got 'z'"),
        ({"viewpoint": (1, 2)}, "`viewpoint` must be three finite numbers"),
        ({"viewpoint": (1, 2, np.inf)}, "`viewpoint` must be three finite numbers"),
    ],
)
def test_impossible_directions(keywords, message):
    with pytest.raises(InputError, match=message):
        PointCloud.read(POINTS, **keywords)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (np.full((5, 3), np.nan), "all 5 points are NaN"),
        (np.ones((5, 3)), "all 5 points are equal"),
        (np.outer(np.linspace(0, 1, 50), [1, 2, 3]), "lie on a line"),
        (np.outer([0, 1], [1, 2, 3]), "lie on a line"),
        (POINTS * 680, r"6\d\d.* m large, more than 50 m; are its units millimetres"),
        (POINTS * 1e-4, "less than 1 mm"),
        (POINTS.T, r"of shape \(N, 3\), got \(3, 200\); transpose it by .T"),
        (np.zeros((0, 3)), "holds no points"),
        (POINTS[:, :2], r"of shape \(N, 3\), got \(200, 2\)"),
        (POINTS.astype(complex), "real numbers, got dtype complex128"),
        ([["a", "b", "c"]], "real numbers, got dtype"),
        ([[1, 2, 3], [1, 2]], "rows of different lengths"),
        (o3d.geometry.PointCloud(), "Open3D PointCloud holds no points"),
        (o3d.geometry.TriangleMesh(), "Open3D TriangleMesh holds no points"),
        (o3d.t.geometry.PointCloud(), "Open3D PointCloud holds no points"),
        (o3d.geometry.LineSet(), "cannot read a point cloud from the Open3D LineSet"),
        (trimesh.Trimesh(), "holds no points"),
        (3.0, "cannot read a point cloud from a float; give a file"),
        (None, "cannot read a point cloud from a NoneType"),
    ],
)
def test_bad_objects(given, message):
    with pytest.raises(InputError, match=message) as caught:
        PointCloud.read(given)
    assert "\n" not in str(caught.value)


def test_line_with_noise_far_below_its_length_is_still_a_line():
    line = np.outer(np.linspace(0, 1, 500), [1, 2, 3])
    with pytest.raises(InputError, match="lie on a line"):
        PointCloud.read(line + 1e-5 * np.random.default_rng(0).standard_normal(line.shape))
    PointCloud.read(line + 1e-2 * np.random.default_rng(0).standard_normal(line.shape))


def bad_file(tmp_path, name):
    path = tmp_path / name
    match name:
        case "missing.ply" | "missing.pcd":
            pass
        case "folder.ply":
            path.mkdir()
        case "scan.glb" | "scan":
            path.write_text("0 0 0\n")
        case "zero.ply" | "zero.npy" | "zero.stl":
            path.write_bytes(b"")
        case "short.ply" | "short.pcd" | "short.npy":
            write(path)
            path.write_bytes(path.read_bytes()[:1500])
        case "short.npz":
            write(path)
            path.write_bytes(path.read_bytes()[:900])
        case "shortmesh.ply" | "shortascii.ply":
            kind = {"encoding": "ascii"} if "ascii" in name else {}
            trimesh.creation.icosphere(2).export(path, **kind)
            path.write_bytes(path.read_bytes()[:-200])
        case "keys.npz":
            np.savez(path, xyz=POINTS, colour=POINTS)
        case "shape.npz":
            np.savez(path, points=POINTS.T)
        case "pickle.npy":
            np.save(path, np.array([{"a": 1}], dtype=object), allow_pickle=True)
        case "pickle.npz":
            np.savez(path, points=np.array([{"a": 1}], dtype=object))
        case "none.ply":
            path.write_text(
                "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
                "property float z\nend_header\n"
            )
        case "none.pcd":
            path.write_text(
                "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\n"
                "TYPE F F F\nCOUNT 1 1 1\nWIDTH 0\n"
                "HEIGHT 1\n"
                "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 0\nDATA ascii\n"
            )
        case "nan.ply":
            write(path, np.full((10, 3), np.nan))
        case _:
            path.write_text("this is no cloud\n" * 10)
    return path


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("missing.ply", "no such file"),
        ("missing.pcd", "no such file"),
        ("folder.ply", "is not a file"),
        ("scan.glb", r"format '.glb'; accepted formats are .ply .pcd .obj .stl .npz .npy"),
        ("scan", "no file extension; accepted formats are"),
        ("zero.ply", "is empty"),
        ("zero.npy", "is empty"),
        ("zero.stl", "is empty"),
        ("text.ply", "not a valid PLY file: its first line is not 'ply'"),
        ("text.pcd", "not a valid PCD file: header line"),
        ("text.obj", "not a valid OBJ file: no line begins with 'v'"),
        ("text.stl", "not a valid STL file: it begins with neither"),
        ("text.npy", "not a valid NPY file, or cut short|pickled"),
        ("text.npz", "not a valid NPZ file, or cut short|pickled"),
        ("short.ply", "cut short: 200 of element 'vertex' declared, 5\\d present"),
        ("short.pcd", "cut short: 200 points declared, 1\\d\\d present"),
        ("short.npy", "not a valid NPY file, or cut short"),
        ("short.npz", "not a valid NPZ file, or cut short"),
        ("shortmesh.ply", "cut short: 320 of element 'face' declared"),
        ("shortascii.ply", "cut short: 320 of element 'face' declared"),
        ("keys.npz", "no array named 'points'; it holds: xyz, colour"),
        ("shape.npz", r"must be of shape \(N, 3\), got \(3, 200\)"),
        ("pickle.npy", "pickled objects"),
        ("pickle.npz", "pickled objects"),
        ("none.ply", "holds no points"),
        ("none.pcd", "holds no points"),
        ("nan.ply", "all 10 points are NaN"),
    ],
)
def test_bad_files(tmp_path, capfd, name, message):
    path = bad_file(tmp_path, name)
    with pytest.raises(InputError, match=message) as caught:
        PointCloud.read(path)
    assert "\n" not in str(caught.value)
    assert name in str(caught.value)
    printed = capfd.readouterr()
    assert printed.out == ""
    assert printed.err == ""


def test_unreadable_file(tmp_path, monkeypatch):
    path = write(tmp_path / "scan.npy")

    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(archives.np, "load", refuse)
    with pytest.raises(InputError, match=r"cannot read .*scan.npy: Permission denied"):
        PointCloud.read(path)


def test_transformed_takes_viewpoint_and_up_along():
    rng = np.random.default_rng(0)
    X = Pose(rng.standard_normal(3), random_rotation(rng))
    cloud = PointCloud.read(POINTS, viewpoint=[1, 2, 3])
    moved = cloud.transformed(X)
    np.testing.assert_allclose(moved.points, transform(X, POINTS), atol=1e-12)
    np.testing.assert_allclose(moved.viewpoint, transform(X, np.array([1.0, 2, 3])), atol=1e-12)
    np.testing.assert_allclose(moved.up, rotate(X.q, np.array([0, 0, 1.0])), atol=1e-12)
    assert moved.sha256 == cloud.sha256
    assert PointCloud.read(POINTS).transformed(X).viewpoint is None


def test_cropped_keeps_what_is_inside():
    cloud = PointCloud.read(POINTS).cropped([0.2, -np.inf, 0.5], [0.8, np.inf, 1.0])
    inside = (POINTS[:, 0] >= 0.2) & (POINTS[:, 0] <= 0.8) & (POINTS[:, 2] >= 0.5)
    np.testing.assert_array_equal(cloud.points, POINTS[inside])
    with pytest.raises(InputError, match="no point of the cloud is inside"):
        PointCloud.read(POINTS).cropped([5, 5, 5], [6, 6, 6])


def test_downsampled_is_one_mean_per_cube():
    # Brute force over the same grid.
    cloud = PointCloud.read(np.concatenate([POINTS, POINTS[:20]]))
    got = cloud.downsampled(0.2).points
    cubes = {}
    for point in POINTS:
        cubes.setdefault(tuple(np.floor(point / 0.2 + 0.3819660112501051)), []).append(point)
    expected = np.array([np.mean(cubes[key], axis=0) for key in sorted(cubes)])
    np.testing.assert_allclose(got, expected, atol=1e-12)


def test_downsampled_refuses_impossible_voxels():
    cloud = PointCloud.read(POINTS)
    with pytest.raises(InputError, match="must be positive"):
        cloud.downsampled(0.0)
    with pytest.raises(InputError, match="at least about 1e-6 of the cloud"):
        cloud.downsampled(1e-9)


def test_centroid_extent_noise():
    cloud = PointCloud.read(POINTS)
    np.testing.assert_allclose(cloud.centroid, POINTS.mean(axis=0))
    np.testing.assert_allclose(cloud.extent, POINTS.max(axis=0) - POINTS.min(axis=0))
    noisy = cloud.with_noise(0.01, np.random.default_rng(0))
    assert abs(np.std(noisy.points - POINTS) - 0.01) < 1e-3
    assert len(cloud) == 200
