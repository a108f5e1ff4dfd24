"""Payload: mass properties against formulas, refusals by name, closest points, frames."""

import numpy as np
import pytest

from drake_aerial import geometry
from drake_aerial.errors import InputError
from drake_aerial.geometry import Pose
from drake_aerial.io import model_files
from drake_aerial.plant import triangles
from drake_aerial.plant.payload import TABLE_INERTIA, Payload

SIZE = np.array([0.68, 0.61, 0.28])


def box_inertia(mass, size):
    a, b, c = np.square(size)
    return mass / 12 * np.diag([b + c, a + c, a + b])


def test_a_box_has_a_boxs_inertia():
    box = Payload.from_box(SIZE, 0.4)
    assert box.com == pytest.approx(np.zeros(3), abs=1e-12)
    assert box.inertia == pytest.approx(box_inertia(0.4, SIZE), rel=1e-9)


def test_a_mesh_elsewhere_and_turned_has_the_same_solid():
    vertices, faces = triangles.box(SIZE)
    X = Pose(np.array([0.3, -2.0, 5.0]), geometry.random_rotation(np.random.default_rng(0)))
    R = geometry.matrix_from_quat(X.q)
    mesh = Payload.from_mesh((geometry.transform(X, vertices), faces), 0.4)
    assert mesh.com == pytest.approx(X.p, abs=1e-9)
    assert mesh.inertia == pytest.approx(R @ box_inertia(0.4, SIZE) @ R.T, rel=1e-6, abs=1e-9)


def test_a_tetrahedrons_centroid_is_the_mean_of_its_corners():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]], dtype=float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    assert Payload.from_mesh((corners, faces), 1.0).com == pytest.approx(corners.mean(axis=0))


def test_the_tables_printed_inertia_is_refused_by_name():
    with pytest.raises(InputError, match=r"J_zz = 0\.107 exceeds.*use 0\.0107"):
        Payload.from_box(SIZE, inertia=(0.006, 0.0059, 0.107))
    assert np.diag(Payload.from_box(SIZE, inertia=TABLE_INERTIA).inertia) == pytest.approx(
        TABLE_INERTIA
    )


@pytest.mark.parametrize(
    ("inertia", "words"),
    [
        ((1, 1), "three moments"),
        ((0, 1, 1), "positive"),
        ((1, 1, np.nan), "three moments"),
        (((1, 5, 0), (5, 1, 0), (0, 0, 1)), "positive"),
    ],
)
def test_impossible_inertias_are_refused(inertia, words):
    with pytest.raises(InputError, match=words):
        Payload.from_box(SIZE, inertia=inertia)


@pytest.mark.parametrize("mass", [0.0, -1.0, np.nan, np.inf])
def test_impossible_masses_are_refused(mass):
    with pytest.raises(InputError, match="mass"):
        Payload.from_box(SIZE, mass, com=[0, 0, 0], inertia=TABLE_INERTIA)


def test_a_mesh_without_volume_needs_an_inertia():
    vertices, faces = triangles.box(SIZE)
    with pytest.raises(InputError, match=r"give com .* and inertia"):
        Payload.from_mesh((vertices, faces[:-1]))
    with pytest.raises(InputError, match=r"give com .* and inertia"):
        Payload.from_mesh((vertices, faces[:, ::-1]))
    given = Payload.from_mesh((vertices, faces[:-1]), com=[0, 0, 0.01], inertia=TABLE_INERTIA)
    assert given.com == pytest.approx([0, 0, 0.01])


def test_closest_points_on_a_box():
    box = Payload.from_box(SIZE)
    rng = np.random.default_rng(1)
    p = rng.uniform(-1.0, 1.0, (60, 3))
    outside = (np.abs(p) > SIZE / 2).any(axis=1)
    q, normals, d = box.closest_point(p)
    clamped = np.clip(p, -SIZE / 2, SIZE / 2)
    assert q[outside] == pytest.approx(clamped[outside], abs=1e-12)
    assert d[outside] == pytest.approx(np.linalg.norm(p - clamped, axis=1)[outside])
    assert d[~outside] == pytest.approx((SIZE / 2 - np.abs(p[~outside])).min(axis=1))
    assert np.linalg.norm(normals, axis=1) == pytest.approx(np.ones(60))
    _, up, _ = box.closest_point([0.1, 0.1, 0.2])
    assert up == pytest.approx([0, 0, 1])


def test_a_full_scan_of_a_box_is_that_box():
    rng = np.random.default_rng(2)
    points = rng.uniform(-0.5, 0.5, (4000, 3))
    axis, side = rng.integers(0, 3, 4000), rng.choice([-0.5, 0.5], 4000)
    points[np.arange(4000), axis] = side
    scan = Payload.from_cloud(points * SIZE, 0.4)
    assert scan.com == pytest.approx(np.zeros(3), abs=2e-3)
    assert np.diag(scan.inertia) == pytest.approx(np.diag(box_inertia(0.4, SIZE)), rel=0.02)


def test_a_view_of_one_face_is_thickened_downwards():
    face = np.random.default_rng(3).uniform(-0.3, 0.3, (500, 3)) * [1, 1, 0] + [0, 0, 0.28]
    scan = Payload.from_cloud(face)
    assert np.ptp(scan.vertices[:, 2]) == pytest.approx(0.02)
    assert scan.vertices[:, 2].max() == pytest.approx(0.28)


@pytest.mark.parametrize(
    "points",
    [np.zeros((50, 3)), np.linspace(0, 1, 50)[:, None] * [1.0, 2.0, 3.0], np.zeros((2, 3))],
)
def test_scans_without_a_surface_are_refused(points):
    with pytest.raises(InputError, match=r"line|3 points"):
        Payload.from_cloud(points)


def test_the_tracked_frame_moves_numbers_not_the_body():
    rng = np.random.default_rng(4)
    box = Payload.from_box(SIZE, X_SP=Pose(rng.normal(size=3), geometry.random_rotation(rng)))
    in_L = box.in_tracked_frame(rng.normal(size=3), geometry.random_rotation(rng))
    com_S = geometry.transform(box.X_SP, box.com)
    assert geometry.transform(in_L.X_SP, in_L.com) == pytest.approx(com_S)
    assert geometry.transform(in_L.X_SP, in_L.vertices) == pytest.approx(
        geometry.transform(box.X_SP, box.vertices)
    )
    R_SP, R_SL = geometry.matrix_from_quat(box.X_SP.q), geometry.matrix_from_quat(in_L.X_SP.q)
    assert R_SL @ in_L.inertia @ R_SL.T == pytest.approx(R_SP @ box.inertia @ R_SP.T)


def test_reading_is_strict(tmp_path):
    path = tmp_path / "crate.yaml"
    path.write_text("box: [0.4, 0.3, 0.2]\nscale: 2\nmass: 0.3\npose: {position: [1, 2, 3]}\n")
    crate = Payload.read(path)
    assert (crate.name, crate.mass) == ("crate", 0.3)
    assert np.ptp(crate.vertices, axis=0) == pytest.approx([0.8, 0.6, 0.4])
    assert crate.X_SP.p == pytest.approx([1, 2, 3])
    for text, words in (
        ("box: [1, 1, 1]\nmas: 0.3\n", "unknown key 'mas' .did you mean 'mass'"),
        ("box: [1, 1, 1]\n", "'mass' is missing"),
        ("mass: 0.3\n", "`mesh` and `box`"),
        ("box: [1, 1]\nmass: 0.3\n", "box"),
        ("box: [1, 1, 1]\nmass: heavy\n", "`mass` must be a number, got 'heavy'"),
        ("mesh: none.obj\nmass: 0.3\n", "no such file: .*none"),
        ("box: [1, 1, 1]\nmass: 0.3\npose: {quaternion_wxyz: [1, 1, 0, 0]}\n", "norm"),
        ("- 1\n", "mapping"),
        ("box: [1\n", "not YAML"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=words):
            Payload.read(path)
    with pytest.raises(InputError, match="box_68x61x28"):
        Payload.read("nothing")


@pytest.mark.parametrize("name", model_files.names("payloads"))
def test_every_shipped_payload_reads(name):
    payload = Payload.read(name)
    assert payload.mass > 0
    assert len(payload.faces) > 0
