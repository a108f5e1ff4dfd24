"""One row for each thing that OBJ and STL allow; files are written by hand or by trimesh."""

import numpy as np
import pytest
import trimesh

from drake_aerial.cloud.readers import read_geometry
from drake_aerial.errors import InputError

BOX = trimesh.creation.box([1.0, 2.0, 3.0])
V = "".join("v {:g} {:g} {:g}\n".format(*v) for v in BOX.vertices)
F = "".join("f {} {} {}\n".format(*f) for f in BOX.faces + 1)


def relative_block(centre):
    corners = "".join("v {:g} {:g} {:g}\n".format(*v) for v in BOX.vertices + centre)
    return corners + "".join("f {} {} {}\n".format(*f) for f in BOX.faces - 8)


OBJ = {
    "indices from one": V + F,
    "relative indices": relative_block(0),
    "faces before the vertices they name": F + V,
    "texture and normals": V
    + "vt 0 0\nvn 0 0 1\n"
    + "".join("f {}/1/1 {}//1 {}/1\n".format(*f) for f in BOX.faces + 1),
    "groups, materials, smoothing": "mtllib gone.mtl\no a\n" + V + "g b\nusemtl c\ns off\n" + F,
    "comments": "# made by hand\n"
    + V.replace("\n", " # corner\n", 1)
    + F.replace("\n", " # face\n", 1),
    "colours after the coordinates": V.replace("\n", " 0.5 0.5 0.5\n") + F,
    "weights after the coordinates": V.replace("\n", " 1.0\n") + F,
    "CRLF": (V + F).replace("\n", "\r\n"),
    "continued lines": V + F.replace("f 2 ", "f \\\n2 "),
    "lines and points beside": V + F + "l 1 2\np 1\n",
    "not UTF-8": "# Größe\n" + V + F,
}
STL = {
    "binary": BOX.export(file_type="stl"),
    "binary, header begins with solid": b"solid".ljust(80) + BOX.export(file_type="stl")[80:],
    "binary, bytes at the end": BOX.export(file_type="stl") + b"\0\0\0",
    "ascii": BOX.export(file_type="stl_ascii").encode(),
    "ascii in capitals": BOX.export(file_type="stl_ascii").upper().encode(),
    "ascii, CRLF and tabs": BOX.export(file_type="stl_ascii").replace("\n", "\r\n\t").encode(),
    "ascii, two solids": BOX.export(file_type="stl_ascii").encode() * 2,
    "ascii without a name": b"solid\n"
    + BOX.export(file_type="stl_ascii").encode().split(b"\n", 1)[1],
}


def read(tmp_path, data, name):
    path = tmp_path / name
    path.write_bytes(data if isinstance(data, bytes) else data.encode("latin-1"))
    return read_geometry(path)


@pytest.mark.parametrize("row", OBJ)
def test_obj(tmp_path, row):
    geometry = read(tmp_path, OBJ[row], "box.obj")
    np.testing.assert_allclose(geometry.points, BOX.vertices)
    np.testing.assert_array_equal(geometry.faces, BOX.faces)


def test_relative_indices_count_from_their_own_line(tmp_path):
    geometry = read(
        tmp_path, "o a\n" + relative_block(0) + "o b\n" + relative_block([5, 0, 0]), "b.obj"
    )
    np.testing.assert_array_equal(geometry.faces, np.concatenate([BOX.faces, BOX.faces + 8]))
    mesh = trimesh.Trimesh(geometry.points, geometry.faces)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(12.0)


def test_polygons_of_an_obj_keep_their_area(tmp_path):
    # An octagon, a U, and a quad that is concave.
    angle = np.arange(8) * np.pi / 4
    octagon = np.c_[np.cos(angle), np.sin(angle), 0 * angle]
    u = np.c_[[0, 0, 3, 3, 2, 2, 1, 1], [3, 0, 0, 3, 3, 1, 1, 3], [1] * 8]
    dart = np.array([[0, 0, 2], [1, 1, 2], [2, 0, 2], [1, 3, 2]])
    lines = "".join("v {!r} {!r} {!r}\n".format(*map(float, v)) for v in np.r_[octagon, u, dart])
    lines += "f 1 2 3 4 5 6 7 8\nf 9 10 11 12 13 14 15 16\nf 17 18 19 20\n"
    geometry = read(tmp_path, lines, "polygons.obj")
    areas = trimesh.triangles.area(geometry.points[geometry.faces])
    assert areas[:6].sum() == pytest.approx(2 * np.sqrt(2))
    assert areas[6:12].sum() == pytest.approx(7.0)
    assert areas[12:].sum() == pytest.approx(2.0)


@pytest.mark.parametrize("row", STL)
def test_stl(tmp_path, row):
    geometry = read(tmp_path, STL[row], "box.stl")
    corners = geometry.points[geometry.faces]
    expected = BOX.triangles if "two" not in row else np.tile(BOX.triangles, (2, 1, 1))
    np.testing.assert_allclose(corners, expected)


@pytest.mark.parametrize(
    ("name", "data", "reason"),
    [
        ("a.obj", V + "f 1 2 9\n", "a face refers to vertex 9 of 8"),
        ("a.obj", V + "f 1 2 -9\n", "a face refers to vertex -"),
        ("a.obj", V + "f 0 1 2\n", "line 9 .*: a face refers to vertex 0; the first one is 1"),
        ("a.obj", V + "f a b c\n", "line 9 .*invalid literal"),
        ("a.obj", "v 1 2\n", "line 1 .*: too few numbers"),
        ("a.obj", "o nothing\n", "holds no points"),
        ("a.obj", "hello\n", "no line begins with 'v'"),
        (
            "a.stl",
            BOX.export(file_type="stl")[:-60],
            "cut short: 12 triangles declared, 10 present",
        ),
        ("a.stl", BOX.export(file_type="stl_ascii")[:-200], "cut short: no line 'endsolid'"),
        ("a.stl", b"\0" * 84, "holds no triangles"),
        ("a.stl", b"solid a\nendsolid a\n", "holds no triangles"),
        ("a.stl", b"\0" * 50, "it has 50 bytes; a binary header has 84"),
        ("a.stl", b"hello " * 50, "it begins with neither 'solid' nor a binary header"),
        ("a.stl", BOX.export(file_type="stl_ascii").replace("0.5", "half"), "could not convert"),
    ],
)
def test_bad_files_are_refused_with_the_true_reason(tmp_path, name, data, reason):
    with pytest.raises(InputError, match=reason) as caught:
        read(tmp_path, data, name)
    assert "\n" not in str(caught.value)
    assert ("cut short" in str(caught.value)) == ("cut short" in reason)
