import base64
import json

import numpy as np
import pytest
import trimesh

from drake_aerial.geometry import Pose, identity
from drake_aerial.visualization.colored_mesh import ColoredMesh
from drake_aerial.visualization.colors import BLUE, RED
from drake_aerial.visualization.rendering import render


def every_shape() -> ColoredMesh:
    mesh = ColoredMesh()
    mesh.add_points(np.random.default_rng(0).uniform(-0.2, 0.2, (50, 3)), radius=0.004)
    box = trimesh.creation.box((0.1, 0.2, 0.1))
    mesh.add_mesh(box.vertices, box.faces, color=BLUE)
    mesh.add_sphere([0.1, 0, 0.3], color=RED, radius=0.02)
    mesh.add_tube([[0, 0, 0], [0, 0, 0.5], [0.1, 0, 0.6]])
    mesh.add_frame(identity())
    mesh.add_quadrotor(Pose(np.array([0, 0, 0.7]), np.array([1.0, 0, 0, 0])))
    return mesh


def read_gltf(data: bytes) -> tuple[dict, dict]:
    """Return the document of a glTF file and the arrays of its one primitive, by attribute."""
    document = json.loads(data)
    buffer = base64.b64decode(document["buffers"][0]["uri"].split(",", 1)[1])
    (mesh,) = document["meshes"]
    (primitive,) = mesh["primitives"]
    arrays = {}
    for name, index in {**primitive["attributes"], "indices": primitive["indices"]}.items():
        accessor = document["accessors"][index]
        dtype = {5126: "<f4", 5121: "u1", 5125: "<u4"}[accessor["componentType"]]
        view = document["bufferViews"][accessor["bufferView"]]
        raw = buffer[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        columns = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        arrays[name] = np.frombuffer(raw, dtype).reshape(-1, columns)
        assert len(arrays[name]) == accessor["count"]
    return document, arrays


def test_the_gltf_file_holds_positions_normals_and_linear_colours():
    mesh = every_shape()
    document, arrays = read_gltf(mesh.to_gltf())
    np.testing.assert_allclose(arrays["POSITION"], mesh.vertices, atol=1e-6)
    np.testing.assert_array_equal(arrays["indices"].reshape(-1, 3), mesh.faces)
    np.testing.assert_allclose(np.linalg.norm(arrays["NORMAL"], axis=1), 1.0, atol=1e-5)
    np.testing.assert_allclose(arrays["COLOR_0"][:, :3] / 255.0, mesh.colors**2.2, atol=0.5 / 255)
    (material,) = document["materials"]
    assert material["pbrMetallicRoughness"]["metallicFactor"] == 0.0


def test_the_z_axis_becomes_the_y_axis_of_gltf():
    document, _ = read_gltf(every_shape().to_gltf())
    (node,) = (node for node in document["nodes"] if "mesh" in node)
    # glTF writes matrices by columns.
    X = np.reshape(node["matrix"], (4, 4)).T
    np.testing.assert_allclose(X @ [0, 0, 1, 1], [0, 1, 0, 1], atol=1e-12)
    assert np.linalg.det(X[:3, :3]) == pytest.approx(1.0)


def test_a_tube_is_a_closed_prism_with_outward_normals():
    mesh = ColoredMesh()
    start, end = np.array([0.1, 0.2, 0.3]), np.array([0.4, -0.2, 1.3])
    mesh.add_tube([start, end], radius=0.1)
    tube = trimesh.Trimesh(mesh.vertices, mesh.faces)
    # Twelve sides inscribed in the circle: area of the regular polygon times the length.
    length = np.linalg.norm(end - start)
    area = 0.5 * 12 * np.sin(2 * np.pi / 12) * 0.1**2
    assert tube.volume == pytest.approx(area * length, rel=1e-9)
    _, arrays = read_gltf(mesh.to_gltf())
    outward = arrays["POSITION"] - 0.5 * (start + end)
    assert (np.sum(outward * arrays["NORMAL"], axis=1) > 0.09).all()


def test_the_normals_of_an_arrows_tip_are_those_of_a_cone():
    mesh = ColoredMesh()
    mesh.add_arrow([0, 0, 0], [0, 0, 1.0], color=RED, radius=0.01)
    _, arrays = read_gltf(mesh.to_gltf())
    p, normal = arrays["POSITION"], arrays["NORMAL"]
    # On the rim of a cone of radius r and height h, n is along (h, r) in radius and height.
    rim = (np.hypot(p[:, 0], p[:, 1]) > 0.024) & (normal[:, 2] > 0.0)
    slope = np.array([0.25, 0.025]) / np.hypot(0.25, 0.025)
    assert rim.sum() == 12
    np.testing.assert_allclose(np.hypot(normal[rim, 0], normal[rim, 1]), slope[0], atol=1e-4)
    np.testing.assert_allclose(normal[rim, 2], slope[1], atol=1e-4)


def test_a_red_ball_is_rendered_red_in_the_middle_on_white():
    mesh = ColoredMesh()
    mesh.add_sphere([1.0, 2.0, 3.0], color=RED, radius=0.1)
    image = render(mesh, size=(80, 60)).astype(int)
    assert image.shape == (60, 80, 3)
    assert (image[0, 0] == 255).all()
    r, g, b = image[30, 40]
    assert r > 120
    assert r > 2 * max(g, b)


def test_z_is_up_in_the_image():
    mesh = ColoredMesh()
    mesh.add_sphere([0, 0, 0.5], color=RED, radius=0.1)
    mesh.add_sphere([0, 0, -0.5], color=BLUE, radius=0.1)
    image = render(mesh, size=(80, 120)).astype(int)
    red = np.argwhere((image[..., 0] > 100) & (image[..., 2] < 80))[:, 0].mean()
    blue = np.argwhere((image[..., 2] > 100) & (image[..., 0] < 80))[:, 0].mean()
    assert red < blue
