"""One row for each thing that the PCD format allows; files are written by hand or by Open3D."""

import numpy as np
import open3d as o3d
import pytest

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.cloud.readers import read_geometry
from drake_aerial.errors import InputError

P = np.random.default_rng(0).random((50, 3)).astype(np.float32).astype(np.float64)


def head(fields="x y z", size="4 4 4", kind="F F F", count="1 1 1", data="binary", **changes):
    lines = {
        "VERSION": "0.7",
        "FIELDS": fields,
        "SIZE": size,
        "TYPE": kind,
        "COUNT": count,
        "WIDTH": str(len(P)),
        "HEIGHT": "1",
        "VIEWPOINT": "0 0 0 1 0 0 0",
        "POINTS": str(len(P)),
        "DATA": data,
    } | changes
    text = "".join(f"{key} {value}\n" for key, value in lines.items() if value is not None)
    return ("# .PCD v0.7 - Point Cloud Data file format\n" + text).encode()


def table(kinds, order="xyz"):
    rows = np.zeros(len(P), kinds)
    for name in rows.dtype.names:
        if name.lower() in "xyz":
            rows[name] = P[:, "xyz".index(name.lower())]
    return rows.tobytes()


TEXT = "".join("{:.17g} {:.17g} {:.17g}\n".format(*p) for p in P).encode()
F4 = P.astype("<f4").tobytes()
ROWS = {
    "ascii": head(data="ascii") + TEXT,
    "ascii, DATA ASCII": head(data="ASCII") + TEXT,
    "ascii, CRLF": (head(data="ascii") + TEXT).replace(b"\n", b"\r\n"),
    "binary": head() + F4,
    "8 bytes": head(size="8 8 8") + P.tobytes(),
    "8 bytes in z only": head(size="4 4 8") + table([("x", "<f4"), ("y", "<f4"), ("z", "<f8")]),
    "capitals": head("X Y Z", data="ascii") + TEXT,
    "without POINTS": head(POINTS=None) + F4,
    "without POINTS, organised": head(POINTS=None, WIDTH="10", HEIGHT="5") + F4,
    "version .5, COLUMNS without COUNT": head(
        VERSION=".5", FIELDS=None, COUNT=None, VIEWPOINT=None, POINTS=None, HEIGHT=None
    ).replace(b"VERSION .5\n", b"VERSION .5\nCOLUMNS x y z\n")
    + F4,
    "colour before, normals between": head(
        "rgb x y normal_x z", "4 4 4 4 4", "U F F F F", "1 1 1 1 1"
    )
    + table([("c", "<u4"), ("x", "<f4"), ("y", "<f4"), ("n", "<f4"), ("z", "<f4")]),
    "padding with COUNT, named twice": head(
        "x y z _ i _", "4 4 4 1 2 1", "F F F U U U", "1 1 1 4 1 10"
    )
    + table(
        [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("p", "u1", 4), ("i", "<u2"), ("q", "u1", 10)]
    ),
    "a histogram in ascii": head("x y z fpfh", "4 4 4 4", "F F F F", "1 1 1 3", data="ascii")
    + b"".join(row + b" 7 8 9\n" for row in TEXT.splitlines()),
    "comments and blank lines": head().replace(b"VERSION", b"# more\n\nVERSION") + F4,
}


def read(tmp_path, data):
    path = tmp_path / "scan.pcd"
    path.write_bytes(data)
    return read_geometry(path)


@pytest.mark.parametrize("row", ROWS)
def test_points(tmp_path, row):
    np.testing.assert_array_equal(read(tmp_path, ROWS[row]).points, P)


def test_integer_coordinates(tmp_path):
    whole = np.arange(150).reshape(50, 3)
    data = head(size="2 2 2", kind="I I I") + whole.astype("<i2").tobytes()
    np.testing.assert_array_equal(read(tmp_path, data).points, whole)


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("ascii_", [False, True])
@pytest.mark.parametrize("repeated", [False, True])
def test_files_that_open3d_wrote(tmp_path, ascii_, compressed, repeated):
    # Repeated points compress: the file has back references, also ones that overlap.
    points = np.repeat(P, 40, axis=0) if repeated else P
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.normals = cloud.points
    cloud.colors = cloud.points
    path = str(tmp_path / "scan.pcd")
    assert o3d.io.write_point_cloud(path, cloud, write_ascii=ascii_, compressed=compressed)
    np.testing.assert_allclose(read_geometry(path).points, points, atol=1e-7)


def test_compressed_doubles(tmp_path):
    # Open3D writes doubles from its tensor geometry.
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(np.repeat(P, 20, axis=0)))
    path = str(tmp_path / "scan.pcd")
    assert o3d.t.io.write_point_cloud(path, cloud, compressed=True)
    assert b"SIZE 8 8 8" in (tmp_path / "scan.pcd").read_bytes()[:400]
    np.testing.assert_array_equal(read_geometry(path).points, np.repeat(P, 20, axis=0))


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("0 0 0 1 0 0 0", None),
        ("0.5 -1 2 1 0 0 0", [0.5, -1, 2]),
        ("0 0 0 0.5 -0.5 0.5 -0.5", [0, 0, 0]),
        (None, None),
    ],
)
def test_the_viewpoint_is_the_sensors_position(tmp_path, line, expected):
    (tmp_path / "scan.pcd").write_bytes(head(VIEWPOINT=line) + F4)
    cloud = PointCloud.read(tmp_path / "scan.pcd")
    if expected is None:
        assert cloud.viewpoint is None
        assert cloud.assumptions == ()
    else:
        np.testing.assert_array_equal(cloud.viewpoint, expected)
        assert [str(assumption.kind) for assumption in cloud.assumptions] == ["outside"]
    # A given one has precedence.
    given = PointCloud.read(tmp_path / "scan.pcd", viewpoint=[9, 9, 9])
    np.testing.assert_array_equal(given.viewpoint, [9, 9, 9])


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (head(FIELDS=None), "its header has no FIELDS"),
        (head("x y depth") + F4, "no fields x, y, z, only x, y, depth"),
        (head(data="zip") + F4, "DATA 'zip' is not known"),
        (head(size="4 4 3") + F4, "TYPE and SIZE F4 F4 F3 are not known"),
        (head(size="4 4") + F4, "have different lengths"),
        (head(count="1 1 2") + F4, "COUNT of x, y and z must be 1"),
        (head(POINTS="many") + F4, "POINTS must be whole numbers, got 'many'"),
        (head(POINTS=None, WIDTH=None) + F4, "neither POINTS nor WIDTH"),
        (head(POINTS="0") + F4, "holds no points"),
        (head(VIEWPOINT="0 0 high 1 0 0 0") + F4, "VIEWPOINT must be seven numbers"),
        (head() + F4[:-1], "cut short: 50 points declared, 49 present"),
        (head(data="ascii") + TEXT[:-30], "cut short: 50 points declared, 49 present"),
        (head(data="ascii") + TEXT + b"1 2 3\n", "more numbers than 50 points of 3 fields"),
        (head(data="ascii") + TEXT.replace(b"0.", b"o."), "could not convert"),
        (head(POINTS=str(10**15)) + F4, "cut short: 1000000000000000 points declared"),
        (head(data="binary_compressed") + b"\x09\0\0", "cut short: its compressed data"),
        (
            head(data="binary_compressed")
            + np.array([4, 600], "<u4").tobytes()
            + b"\xff\xff\xff\xff",
            "its compressed data are damaged",
        ),
        (b"VERSION 0.7\nFIELDS x y z\n", "its header has no line DATA"),
        (b"a point cloud\n", "header line 'a point cloud' is not known"),
    ],
)
def test_bad_files_are_refused_with_the_true_reason(tmp_path, data, reason):
    with pytest.raises(InputError, match=reason) as caught:
        read(tmp_path, data)
    assert "\n" not in str(caught.value)
    assert ("cut short" in str(caught.value)) == ("cut short" in reason)
