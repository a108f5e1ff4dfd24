import json
import struct

import numpy as np
import pytest
import trimesh

from drake_aerial.geometry import Pose, identity
from drake_aerial.visualization.picture import BLUE, RED, Picture
from drake_aerial.visualization.rendering import render


def everything() -> Picture:
    picture = Picture()
    picture.add_points(np.random.default_rng(0).uniform(-0.2, 0.2, (50, 3)), radius=0.004)
    picture.add_mesh(*box_mesh(), color=BLUE)
    picture.add_sphere([0.1, 0, 0.3], color=RED, radius=0.02)
    picture.add_tube([[0, 0, 0], [0, 0, 0.5], [0.1, 0, 0.6]])
    picture.add_frame(identity())
    picture.add_quadrotor(Pose(np.array([0, 0, 0.7]), np.array([1.0, 0, 0, 0])))
    return picture


def box_mesh():
    box = trimesh.creation.box((0.1, 0.2, 0.1))
    return box.vertices, box.faces


def test_the_gltf_is_read_back_by_another_reader_with_the_same_bounds_and_colours(tmp_path):
    picture = everything()
    picture.write_glb(tmp_path / "picture.glb")
    scene = trimesh.load(tmp_path / "picture.glb")
    (mesh,) = scene.geometry.values()
    assert len(mesh.vertices) == len(picture.vertices)
    low, high = picture.bounds()
    np.testing.assert_allclose(mesh.bounds, [low, high], atol=1e-6)
    # trimesh keeps the colours of a mesh that also has a material among its vertex attributes.
    colors = mesh.visual.vertex_attributes["color"]
    assert len(colors) == len(picture.vertices)
    assert len(np.unique(colors, axis=0)) >= 6


def test_glb_sizes_are_consistent():
    glb = everything().to_glb()
    magic, version, size = struct.unpack_from("<4sII", glb)
    assert (magic, version, size) == (b"glTF", 2, len(glb))
    (text_size,) = struct.unpack_from("<I", glb, 12)
    document = json.loads(glb[20 : 20 + text_size])
    for view in document["bufferViews"]:
        assert view["byteOffset"] + view["byteLength"] <= document["buffers"][0]["byteLength"]


def test_cylinders_and_balls_point_outward():
    picture = Picture()
    picture.add_tube([[0, 0, 0], [0, 0, 1]], radius=0.1)
    tube = trimesh.Trimesh(picture.vertices, np.concatenate(picture._faces))
    # Twelve sides inscribed in the circle: area of the regular polygon times the length.
    assert tube.volume == pytest.approx(0.5 * 12 * np.sin(2 * np.pi / 12) * 0.1**2, rel=1e-9)


def test_a_red_ball_is_rendered_red_in_the_middle_on_white():
    picture = Picture()
    picture.add_sphere([1.0, 2.0, 3.0], color=RED, radius=0.1)
    image = render(picture, size=(80, 60)).astype(int)
    assert image.shape == (60, 80, 3)
    assert (image[0, 0] == 255).all()
    r, g, b = image[30, 40]
    assert r > 120
    assert r > 2 * max(g, b)


def test_z_is_up_in_the_image():
    picture = Picture()
    picture.add_sphere([0, 0, 0.5], color=RED, radius=0.1)
    picture.add_sphere([0, 0, -0.5], color=BLUE, radius=0.1)
    image = render(picture, size=(80, 120)).astype(int)
    red = np.argwhere((image[..., 0] > 100) & (image[..., 2] < 80))[:, 0].mean()
    blue = np.argwhere((image[..., 2] > 100) & (image[..., 0] < 80))[:, 0].mean()
    assert red < blue
