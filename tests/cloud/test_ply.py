"""One row for each thing that the PLY format allows; files are written by hand or by plyfile."""

import struct

import numpy as np
import plyfile
import pytest
import trimesh

from drake_aerial.cloud.readers import read_geometry
from drake_aerial.errors import InputError

P = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1.0]])
XYZ = "property float x\nproperty float y\nproperty float z\n"
ROWS = b"".join(b"%g %g %g\n" % tuple(p) for p in P)
LITTLE, BIG = "binary_little_endian", "binary_big_endian"


def head(form="ascii", vertex=XYZ, more="", before="", newline="\n", count=5, name="vertex"):
    text = f"ply\n{before}format {form} 1.0\nelement {name} {count}\n{vertex}{more}end_header\n"
    return text.replace("\n", newline).encode("latin-1")


def packed(form, code, values):
    return struct.pack((">" if form == BIG else "<") + code, *values)


def listed(form, lengths):
    """Vertices with a list of the given length before z: every place in a row varies."""
    rows = [
        packed(form, "ffB", [*p[:2], n])
        + packed(form, f"{n}H", range(n))
        + packed(form, "f", p[2:])
        for p, n in zip(P, lengths)
    ]
    kinds = "property float x\nproperty float y\nproperty list uchar ushort seen\n"
    return head(form, vertex=kinds + "property float z\n") + b"".join(rows)


CLOUDS = {
    "ascii": head() + ROWS,
    "ascii, CRLF": head(newline="\r\n") + ROWS.replace(b"\n", b"\r\n"),
    "ascii, CR": head(newline="\r") + ROWS.replace(b"\n", b"\r"),
    "ascii, all on one line": head() + ROWS.replace(b"\n", b" "),
    "ascii, blank lines": head() + ROWS.replace(b"\n", b"\n\n"),
    "binary, little endian": head(LITTLE) + P.astype("<f4").tobytes(),
    "binary, big endian": head(BIG) + P.astype(">f4").tobytes(),
    "binary, header in CRLF": head(LITTLE, newline="\r\n") + P.astype("<f4").tobytes(),
    "double": head(LITTLE, vertex=XYZ.replace("float", "double")) + P.tobytes(),
    "float32 as the type's name": head(vertex=XYZ.replace("float", "float32")) + ROWS,
    "names in capitals": head(vertex=XYZ.replace(" x", " X").replace(" y", " Y")) + ROWS,
    "names px py pz": head(vertex=XYZ.replace("float ", "float p")) + ROWS,
    "an element named point": head(name="point") + ROWS,
    "coordinates after normals": head(
        vertex="property float nx\nproperty float ny\nproperty float nz\n" + XYZ
    )
    + b"".join(b"0 0 1 " + row + b"\n" for row in ROWS.splitlines()),
    "comments": head(before="comment made by hand\ncomment\nobj_info a b\n\n") + ROWS,
    "a comment in Latin-1": head(before="comment Größe\n") + ROWS,
    "more blanks and tabs": head().replace(b"element vertex", b"element\t vertex  ") + ROWS,
    "another element before": head(before="").replace(
        b"element vertex", b"element camera 1\nproperty int id\nelement vertex"
    )
    + b"7\n"
    + ROWS,
    "another element after": head(more="element camera 2\nproperty int id\n") + ROWS + b"7\n8\n",
    "lists in vertices, equal lengths": listed(LITTLE, [2] * 5),
    "lists in vertices, other lengths": listed(LITTLE, [2, 0, 3, 1, 2]),
    "lists in vertices, big endian": listed(BIG, [2, 0, 3, 1, 2]),
    "bytes after the last element": head(LITTLE) + P.astype("<f4").tobytes() + b"\0\0",
}


def read(tmp_path, data, name="scan.ply"):
    path = tmp_path / name
    path.write_bytes(data)
    return read_geometry(path)


@pytest.mark.parametrize("row", CLOUDS)
def test_points(tmp_path, row):
    geometry = read(tmp_path, CLOUDS[row])
    np.testing.assert_array_equal(geometry.points, P)
    assert geometry.faces is None


def test_missing_values_of_several_programs(tmp_path):
    rows = ROWS + b"nan NaN -nan\n-nan(ind) 1.#QNAN inf\n"
    points = read(tmp_path, head(count=7) + rows).points
    np.testing.assert_array_equal(points[:5], P)
    assert not np.isfinite(points[5:]).any()


@pytest.mark.parametrize("form", ["<", ">", "ascii"])
@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize("name", ["vertex_indices", "vertex_index"])
def test_meshes_that_plyfile_wrote(tmp_path, form, mixed, name):
    # A pyramid: its base as a quad or as two triangles. The area does not depend on that.
    faces = [[0, 3, 2, 1]] if mixed else [[0, 3, 2], [0, 2, 1]]
    faces += [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    vertex = np.array([(*p, 7) for p in P], [("x", "f4"), ("y", "f4"), ("z", "f8"), ("i", "u1")])
    table = np.empty(len(faces), [(name, object), ("flag", "u1"), ("texcoord", object)])
    for k, face in enumerate(faces):
        table[k] = (np.array(face, "i4"), k, np.zeros(2 * len(face), "f4"))
    kinds = {"val_types": {name: "i4", "texcoord": "f4"}}
    ply = plyfile.PlyData(
        [
            plyfile.PlyElement.describe(vertex, "vertex"),
            plyfile.PlyElement.describe(table, "face", **kinds),
        ],
        text=form == "ascii",
        byte_order=form if form != "ascii" else "=",
        comments=["TextureFile gone.png"],
    )
    ply.write(tmp_path / "mesh.ply")
    geometry = read_geometry(tmp_path / "mesh.ply")
    np.testing.assert_array_equal(geometry.points, P)
    mesh = trimesh.Trimesh(geometry.points, geometry.faces)
    assert len(mesh.faces) == 6
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(1 / 3)


def test_triangle_strips(tmp_path):
    more = "element tristrips 1\nproperty list int int vertex_indices\n"
    faces = read(tmp_path, head(more=more) + ROWS + b"9 0 1 3 2 -1 0 1 4 -1\n").faces
    np.testing.assert_array_equal(faces, [[0, 1, 3], [2, 3, 1], [0, 1, 4]])


def test_concave_polygons_are_not_filled(tmp_path):
    # A U of area 5, whose fan from the first corner would leave it.
    corners = [(0, 3), (0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3)]
    rows = b"".join(b"%d %d 0\n" % corner for corner in corners)
    more = "element face 1\nproperty list uchar int vertex_indices\n"
    geometry = read(tmp_path, head(more=more, count=8) + rows + b"8 0 1 2 3 4 5 6 7\n")
    mesh = trimesh.Trimesh(geometry.points, geometry.faces, process=False)
    assert len(geometry.faces) == 6
    assert mesh.area == pytest.approx(7.0)
    np.testing.assert_allclose(mesh.face_normals, np.tile([0, 0, 1.0], (6, 1)))


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"plx\n", "not a valid PLY file: its first line is not 'ply'"),
        (b"ply\nformat ascii 1.0\n", "its header has no end_header"),
        (head("binary"), "header line 'format binary 1.0' is not known"),
        (head(vertex="property half x\n"), "header line 'property half x' is not known"),
        (head().replace(b"vertex 5", b"vertex five"), "header line 'element vertex five'"),
        (head().replace(b"format ascii 1.0\n", b""), "its header has no format"),
        (head(name="camera") + ROWS, "no element 'vertex', only camera"),
        (head(vertex=XYZ.replace(" z", " depth")) + ROWS, "no properties x, y, z of the vertices"),
        (head(count=0), "holds no points"),
        (head() + ROWS[:-6], "cut short: 5 of element 'vertex' declared, 4 present"),
        (head() + ROWS + b"1 2 3\n", "it has 3 more numbers than its header declares"),
        (head() + ROWS.replace(b"0.5", b"half"), "not a valid PLY file: .*half"),
        (head(LITTLE) + P.astype("<f4").tobytes()[:-1], "cut short: 5 of .*, 4 present"),
        (head(LITTLE, count=10**15) + b"1234", "cut short: 1000000000000000 of element"),
        (listed(LITTLE, [2, 0, 3, 1, 2])[:-3], "cut short: 5 of element 'vertex' declared, 4"),
        (
            head(more="element face 1\nproperty list uchar int vertex_indices\n")
            + ROWS
            + b"3 0 1 5",
            "a face refers to vertex 5 of 5",
        ),
        (
            head(more="element face 1\nproperty list char int vertex_indices\n") + ROWS + b"-3 0 1",
            "a list of element 'face' has length -3",
        ),
    ],
)
def test_bad_files_are_refused_with_the_true_reason(tmp_path, data, reason):
    with pytest.raises(InputError, match=reason) as caught:
        read(tmp_path, data)
    assert "\n" not in str(caught.value)
    assert ("cut short" in str(caught.value)) == ("cut short" in reason)


def test_a_large_mesh_with_quads_is_read_in_time(tmp_path):
    rng = np.random.default_rng(0)
    points = rng.random((100_000, 3)).astype("<f4")
    sizes = rng.integers(3, 5, 50_000)
    body = b"".join(bytes([n]) + rng.integers(0, 1000, n).astype("<i4").tobytes() for n in sizes)
    more = f"element face {len(sizes)}\nproperty list uchar int vertex_indices\n"
    geometry = read(tmp_path, head(LITTLE, more=more, count=len(points)) + points.tobytes() + body)
    np.testing.assert_array_equal(geometry.points, points)
    assert len(geometry.faces) == (sizes - 2).sum()
