"""Demonstration files: the shipped ones, their keys, and errors of one line."""

import re

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from drake_aerial.errors import InputError
from drake_aerial.geometry import axis_of
from drake_aerial.io import model_files
from drake_aerial.skill.demonstration import Demonstration

BOX = "cloud: {box: [0.68, 0.61, 0.28], view: top}\n"
GRIPPER = "grippers: [{position: [0, 0, 0.14]}]\n"


def write(tmp_path, text):
    path = tmp_path / "demonstration.yaml"
    path.write_text(text)
    return path


def test_flat_is_the_centre_of_the_top_face():
    flat = Demonstration.read("flat")
    assert len(flat) == 1
    np.testing.assert_allclose(flat.cloud.points[:, 2], 0.14, atol=1e-9)
    np.testing.assert_allclose(flat.cloud.extent[:2], [0.68, 0.61], atol=0.01)
    np.testing.assert_allclose(flat.grippers.p, [[0, 0, 0.14]])
    np.testing.assert_allclose(axis_of(flat.grippers.q, 2), [[0, 0, 1]], atol=1e-12)
    np.testing.assert_allclose(flat.quadrotors.p, [[0, 0, 0.64]])
    assert flat.label == "flat"
    assert flat.description


def test_edge_is_close_to_one_edge():
    edge = Demonstration.read("edge")
    gap = np.array([0.34, 0.305]) - np.abs(edge.grippers.p[0, :2])
    assert gap.min() < 0.06
    assert gap.max() > 0.2


def test_curved_is_above_the_centroid_of_a_teapot_seen_from_one_side():
    curved = Demonstration.read("curved")
    teapot = trimesh.load(model_files.models_dir() / "meshes" / "teapot.obj", force="mesh")
    np.testing.assert_allclose(curved.grippers.p[0, :2], teapot.center_mass[:2], atol=0.002)
    assert np.linalg.norm(curved.cloud.points - curved.grippers.p[0], axis=1).min() < 0.005
    np.testing.assert_allclose(curved.cloud.viewpoint, [0.6, -0.5, 0.9])
    distance, _ = cKDTree(teapot.vertices).query(curved.cloud.points)
    assert distance.max() < 0.015
    # About half of the vertices are near a point that was seen.
    seen, _ = cKDTree(curved.cloud.points).query(teapot.vertices)
    assert 0.3 < np.mean(seen < 0.01) < 0.7


def test_defaults_and_directions(tmp_path):
    text = BOX + (
        "label: mine\n"
        "grippers:\n"
        "- {position: [0.1, 0, 0.14], axis: [0, 0, 2], cable_length: 0.7, "
        "cable_direction: [1, 0, 1]}\n"
        "- {position: [-0.1, 0, 0.14], quaternion_wxyz: [1, 0, 0, 1], "
        "quadrotor: [-0.1, 0.3, 0.54]}\n"
    )
    demonstration = Demonstration.read(write(tmp_path, text))
    assert (demonstration.name, demonstration.label) == ("demonstration", "mine")
    np.testing.assert_allclose(demonstration.cable_length, [0.7, 0.5])
    np.testing.assert_allclose(
        demonstration.quadrotors.p[0], [0.1 + 0.7 / np.sqrt(2), 0, 0.14 + 0.7 / np.sqrt(2)]
    )
    np.testing.assert_allclose(demonstration.quadrotors.p[1], [-0.1, 0.3, 0.54])
    np.testing.assert_allclose(axis_of(demonstration.grippers.q, 0)[1], [0, 1, 0], atol=1e-12)


def test_scan_file_beside_the_demonstration(tmp_path):
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-0.2, 0.2, (500, 2)), np.zeros(500)])
    np.save(tmp_path / "scan.npy", points)
    text = "cloud: {file: scan.npy, viewpoint: [0, 0, 2]}\ngrippers: [{position: [0, 0, 0]}]\n"
    demonstration = Demonstration.read(write(tmp_path, text))
    np.testing.assert_allclose(demonstration.cloud.points, points)
    np.testing.assert_allclose(demonstration.cloud.viewpoint, [0, 0, 2])


def test_noise_is_seeded(tmp_path):
    text = "cloud: {box: [0.3, 0.3, 0.3], noise: 0.002, seed: %d}\n" + GRIPPER
    a, b, c = (Demonstration.read(write(tmp_path, text % seed)).cloud.points for seed in (1, 1, 2))
    np.testing.assert_array_equal(a, b)
    assert np.abs(a - c).max() > 1e-3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (BOX + GRIPPER + "gripers: 1\n", "unknown key 'gripers' (did you mean 'grippers'"),
        (BOX + "grippers: [{posit: [0, 0, 0]}]\n", "did you mean 'position'"),
        (BOX + "grippers: [{}]\n", "'position' is missing"),
        (BOX, "'grippers' is missing"),
        (GRIPPER, "'cloud' is missing"),
        (BOX + "grippers: []\n", "`grippers` must have at least 1 entry, got []"),
        (
            BOX + "grippers: [{position: [0, 0]}]\n",
            "`grippers[0].position` must have more entries, got [0, 0]",
        ),
        (
            BOX + "grippers: [{position: [0, 0, .nan]}]\n",
            "`grippers[0].position[2]` must be a finite number, got nan",
        ),
        (BOX + "grippers: [{position: [0, 0, 0], axis: [0, 0, 0]}]\n", "positive length"),
        (
            BOX + "grippers: [{position: [0, 0, 0], cable_length: -1}]\n",
            "`grippers[0].cable_length` must be > 0 m, got -1",
        ),
        (
            BOX
            + "grippers: [{position: [0, 0, 0], axis: [0, 0, 1], quaternion_wxyz: [1, 0, 0, 0]}]\n",
            "only one of `axis` and `quaternion_wxyz` may be given",
        ),
        ("cloud: {}\n" + GRIPPER, "exactly one of file, mesh, box"),
        ("cloud: {box: [1, 1, 0]}\n" + GRIPPER, "`cloud.box[2]` must be > 0 m, got 0"),
        (
            "cloud: {box: [1, 1, 1], view: side}\n" + GRIPPER,
            "`cloud.view` must be one of full, top, partial, got 'side'",
        ),
        ("cloud: {box: [1, 1, 1], view: partial}\n" + GRIPPER, "`viewpoint` must be [x, y, z]"),
        ("cloud: {mesh: nothing}\n" + GRIPPER, "got 'nothing'"),
        ("cloud: {file: missing.ply}\n" + GRIPPER, "missing.ply"),
        ("[1, 2]\n", "must hold a mapping"),
        ("a: [\n", "is not YAML"),
    ],
)
def test_refuses_in_one_line(tmp_path, text, message):
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        Demonstration.read(write(tmp_path, text))
    assert "\n" not in str(caught.value)


def test_refuses_an_unknown_name():
    with pytest.raises(InputError, match="flat"):
        Demonstration.read("flatt")
