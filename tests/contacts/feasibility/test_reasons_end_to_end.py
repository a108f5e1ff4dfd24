"""Every named reason against a formation, from a transfer to the file that it writes."""

import json

import numpy as np
import pytest
import trimesh

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.contacts.transfer import transfer
from drake_aerial.io import model_files
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn
from drake_aerial.statics.lift import Lift
from tests.contacts.box_scans import box_cloud
from tests.contacts.formations import FAST, SIZE

TOP = 0.5 * SIZE[2]
PAIR = np.array([[0.22, 0.0, TOP], [-0.22, 0.0, TOP]])
THREE = np.array([[0.22, 0.0, TOP], [-0.14, 0.2, TOP], [-0.14, -0.2, TOP]])


def written_reasons(path, positions, cloud=None, parameters=FAST, **options):
    """Return the reasons of the likeliest solution as the file has them; check its feasibility."""
    demonstration = Demonstration.make(box_cloud(SIZE, seed=100), positions, name="case", **options)
    cloud = box_cloud(SIZE, seed=2, noise=0.0005) if cloud is None else cloud
    found = transfer(learn(demonstration), cloud, top=2, parameters=parameters)
    found.write(path)
    best = json.loads(path.read_text())["solutions"][0]
    assert best["feasible"] is not bool(best["reasons"])
    # A file that is read has reasons of the same kinds against the same grippers.
    for made, read in zip(found[0].reasons, ContactSolutions.read(path)[0].reasons, strict=True):
        assert (read.kind, read.gripper, read.pair) == (made.kind, made.gripper, made.pair)
        assert str(read) == str(made)
    return best["reasons"]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "contacts.json"


@pytest.mark.parametrize("positions", [PAIR, THREE])
def test_a_formation_around_the_middle_has_none(path, positions):
    assert written_reasons(path, positions) == []


def test_sideways(path):
    # The first stands on a side face, its axis level, and the cable goes up along the wall.
    side = np.array([[0.34, 0.0, 0.0], [-0.22, 0.0, TOP]])
    found = written_reasons(path, side, axes=[[1.0, 0, 0], [0, 0, 1.0]])
    assert any(reason.startswith("gripper 1: sideways (its axis points 0 deg") for reason in found)
    assert not any(reason.startswith("gripper 2") for reason in found)


def test_cable_through_the_payload(path):
    found = written_reasons(path, PAIR, cable_directions=[[0, 0, 1.0], [1.0, 0.0, -0.3]])
    assert "gripper 2: cable through the payload" in found
    assert not any(reason.startswith("gripper 1") for reason in found)


def test_quadrotors_too_close(path):
    found = written_reasons(path, THREE, cloud=box_cloud([0.35, 0.3, 0.2], seed=2, noise=0.0005))
    assert sum("too close" in reason for reason in found) == 3
    assert any(reason.startswith("quadrotors 1 and 2 too close (0.") for reason in found)


def test_off_the_surface(path):
    # A triangle whose corner was not scanned: its gripper belongs where no point is.
    mesh = trimesh.load(model_files.models_dir() / "meshes" / "hollow_triangle.obj", force="mesh")
    points = np.asarray(trimesh.sample.sample_surface(mesh, 12000, seed=3)[0])
    cut = PointCloud.read(points[points[:, 0] < points[:, 0].max() - 0.17])
    skill = learn(Demonstration.read("formation"))
    solutions = transfer(skill, cut, top=2, parameters=FAST)
    solutions.write(path)
    best = json.loads(path.read_text())["solutions"][0]
    assert len(best["reasons"]) == 1
    assert "off the surface (nearest point" in best["reasons"][0]
    # The one towards the missing corner, beyond the scan's edge.
    assert np.max(solutions[0].X_SG.p[:, 0]) > cut.points[:, 0].max() + 0.01


@pytest.mark.parametrize("positions", [PAIR + [0.3, 0, 0], THREE * [0.5, 1, 1] + [0.2, 0, 0]])
def test_all_contacts_on_one_side(path, positions):
    positions = positions * [1.0, 1.0, 1.0]
    positions[:, 0] = np.interp(
        positions[:, 0], [positions[:, 0].min(), positions[:, 0].max()], [0.08, 0.3]
    )
    parameters = TransferParameters(**(vars(FAST) | {"separation": 0.1}))
    found = written_reasons(path, positions, parameters=parameters)
    assert found == [
        "no positive-tension equilibrium (all contacts on one side of the centre of mass)"
    ]


def test_cables_do_not_balance(path):
    lean = np.tile([0.5, 0.0, 1.0], (3, 1))
    found = written_reasons(path, THREE, cable_directions=lean)
    assert found == ["no positive-tension equilibrium (cables do not balance)"]


def test_more_tension_than_the_propellers_lift(path):
    # Each of two carries half of 2 kg, 9.8 N; the weaker holds 7 N less its own 2.5 N.
    lift = Lift(2.0, (30.0, 7.0), (0.25, 0.25))
    found = written_reasons(
        path, PAIR, parameters=TransferParameters(**(vars(FAST) | {"lift": lift}))
    )
    assert len(found) == 1
    assert found[0].startswith("gripper 2: more tension than the propellers lift (")
    assert "at most 4.5 N" in found[0]
