import hashlib
import importlib.util
from pathlib import Path

import numpy as np
import pytest
import trimesh

from drake_aerial.io.model_files import models_dir

TOOL = Path(__file__).parents[2] / "tools" / "import_meshes.py"
MESHES = models_dir() / "meshes"


@pytest.fixture(scope="module")
def tool():
    spec = importlib.util.spec_from_file_location("import_meshes", TOOL)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def shipped(name):
    return trimesh.load(MESHES / f"{name}.obj", process=False)


@pytest.mark.parametrize("name", ["bunny", "teapot", "hollow_triangle", "ridged_parcel"])
def test_shipped_meshes_enclose_a_volume_and_stand_on_the_floor(name):
    mesh = shipped(name)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert mesh.volume > 0
    assert abs(mesh.bounds[0, 2]) < 1e-4
    assert (MESHES / f"{name}.obj").stat().st_size < 1_000_000


@pytest.mark.parametrize("name", ["bunny", "teapot", "hollow_triangle", "ridged_parcel"])
def test_provenance_names_the_file_as_it_is(name):
    text = (MESHES / "PROVENANCE.md").read_text()
    digest = hashlib.sha256((MESHES / f"{name}.obj").read_bytes()).hexdigest()
    assert f"`{name}.obj`: sha256 `{digest}`" in text


def test_sizes_are_those_of_the_study():
    assert abs(shipped("bunny").extents[2] - 0.5) < 1e-4
    assert abs(shipped("teapot").extents[0] - 0.45) < 1e-4
    assert shipped("bunny").euler_number == 2  # a sphere: no tunnels left by remeshing
    assert shipped("teapot").euler_number == 0  # one tunnel: the handle's


def test_up_is_up():
    # The bunny's ears and the teapot's knob are on top, and slim.
    for name in ("bunny", "teapot"):
        mesh = shipped(name)
        height = mesh.triangles_center[:, 2] / mesh.extents[2]
        assert mesh.area_faces[height > 0.93].sum() < 0.3 * mesh.area_faces[height < 0.07].sum()


def test_hollow_triangle_is_exact(tool):
    for mesh in (tool.hollow_triangle(), shipped("hollow_triangle")):
        # Area for circumradius R: 3 sqrt(3)/4 R^2; the hole's R is 2 beams smaller.
        expected = 3 * np.sqrt(3) / 4 * (0.42**2 - 0.22**2) * 0.06
        np.testing.assert_allclose(mesh.volume, expected, rtol=1e-4)
        np.testing.assert_allclose(mesh.center_mass, [0, 0, 0.03], atol=1e-5)
        np.testing.assert_allclose(
            np.linalg.norm(mesh.vertices[:, :2], axis=1).max(), 0.42, atol=1e-5
        )
        # The beam's width: across the side opposite to the corner on x.
        x = np.unique(mesh.vertices[:, 0].round(4))
        np.testing.assert_allclose(x[1] - x[0], 0.1, atol=2e-4)
        assert mesh.euler_number == 0


def test_capped_closes_an_open_box(tool):
    box = trimesh.creation.box([1.0, 2.0, 3.0])
    open_box = box.copy()
    open_box.update_faces(box.face_normals[:, 2] < 0.9)
    assert not open_box.is_watertight
    closed = tool.capped(open_box)
    assert closed.is_watertight
    np.testing.assert_allclose(closed.area, 22.0)


def test_rounded_puts_a_coarse_sphere_on_its_sphere(tool):
    coarse = trimesh.creation.icosphere(subdivisions=1)
    round_ = tool.rounded(coarse)
    assert round_.is_watertight
    flat_error = 1 - np.linalg.norm(coarse.triangles_center, axis=1).min()
    error = np.abs(1 - np.linalg.norm(round_.vertices, axis=1)).max()
    assert error < 0.2 * flat_error


def test_remeshed_unites_overlapping_parts(tool):
    # Two unit cubes that overlap by half.
    a = trimesh.creation.box([1.0, 1.0, 1.0])
    b = a.copy()
    b.apply_translation([0.5, 0, 0])
    mesh = tool.remeshed([a, b], 0.05, 4000)
    assert mesh.is_watertight
    np.testing.assert_allclose(mesh.volume, 1.5, rtol=0.01)
    np.testing.assert_allclose(mesh.extents, [1.5, 1.0, 1.0], atol=0.01)


def test_egg_parts_read_polygons_by_pool(tool):
    egg = """<CoordinateSystem> { Y-Up }
    <VertexPool> a {
      <Vertex> 0 { 0 0 0 <Normal> { 0 0 1 } }
      <Vertex> 1 { 1 0 0 }
      <Vertex> 2 { 1 1 1.5e-06 }
      <Vertex> 3 { 0 1 0 }
    }
    <Polygon> { <RGBA> { 1 1 1 1 } <VertexRef> { 0 1 2 3 <Ref> { a } } }
    <VertexPool> b {
      <Vertex> 0 { 0 0 5 }
      <Vertex> 1 { 2 0 5 }
      <Vertex> 2 { 0 2 5 }
    }
    <Polygon> { <VertexRef> { 0 1 2 <Ref> { b } } }"""
    parts = tool.egg_parts(egg)
    assert list(parts) == ["a", "b"]
    np.testing.assert_allclose(parts["a"].area, 1.0)
    np.testing.assert_allclose(parts["b"].area, 2.0)


def test_ridged_parcel_is_exact(tool):
    for mesh in (tool.ridged_parcel(), shipped("ridged_parcel")):
        assert np.allclose(np.ptp(mesh.vertices, axis=0), [0.68, 0.61, 0.30])
        # Five right-angled triangles, as long as the parcel is wide, on top of it.
        assert mesh.volume == pytest.approx(
            0.68 * 0.61 * 0.28 + 5 * 0.5 * 0.06 * 0.02 * 0.61, rel=1e-9
        )
        # The flaps' slopes face up and backwards; a quarter of the top on either side stays level.
        up = mesh.face_normals[:, 2] > 0.999
        assert mesh.area_faces[up].sum() == pytest.approx(2 * 0.19 * 0.61, rel=1e-9)
