"""The shipped demonstrations with several grippers: places, learning, feasibility."""

import numpy as np
import pytest
import trimesh

from drake_aerial.contacts.feasibility.checks import reasons_against
from drake_aerial.contacts.feasibility.local_surface import LocalSurface
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.features.canonical_frame import to_canonical
from drake_aerial.features.surface_features import compute_features
from drake_aerial.geometry import axis_of
from drake_aerial.io import model_files
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn


@pytest.fixture(scope="module", params=[("formation", 3), ("bar", 2)], ids=["formation", "bar"])
def shipped(request):
    name, n = request.param
    demonstration = Demonstration.read(name)
    return demonstration, learn(demonstration), n


def test_formation_stands_on_a_hollow_triangle():
    formation = Demonstration.read("formation")
    mesh = trimesh.load(model_files.models_dir() / "meshes" / "hollow_triangle.obj", force="mesh")
    # A triangular frame 0.06 high, of circumradii 0.42 and 0.22: the beams are 0.1 wide.
    solid = [3.0 * np.sqrt(3.0) / 4.0 * r**2 for r in (0.42, 0.22)]
    assert mesh.volume == pytest.approx(0.06 * (solid[0] - solid[1]), rel=1e-3)
    p = formation.grippers.p
    _, distance, face = trimesh.proximity.closest_point_naive(mesh, p)
    assert distance.max() < 1e-5
    np.testing.assert_allclose(axis_of(formation.grippers.q, 2), mesh.face_normals[face], atol=1e-9)
    # Equal shares: the grippers' mean is under the centre of mass, and all are as far from it.
    np.testing.assert_allclose(p.mean(axis=0)[:2], mesh.center_mass[:2], atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(p[:, :2], axis=1), 0.32, atol=1e-4)
    # The full cloud: underside, both outlines and top.
    assert np.mean(formation.cloud.points[:, 2] < 1e-6) > 0.2
    np.testing.assert_allclose(formation.cloud.extent, mesh.extents, atol=0.01)


def test_bar_has_one_gripper_on_either_side_of_its_middle():
    bar = Demonstration.read("bar")
    np.testing.assert_allclose(bar.grippers.p.mean(axis=0), [0, 0, 0.03], atol=1e-12)
    np.testing.assert_allclose(np.diff(bar.grippers.p, axis=0), [[-0.64, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(bar.cloud.extent, [1.0, 0.1, 0.06], atol=0.005)


def test_learns_every_gripper(shipped, tmp_path):
    demonstration, skill, n = shipped
    assert len(demonstration) == len(skill) == len(skill.contacts) == len(skill.objects) == n
    # The configuration keeps the distances between grippers, whatever frame it is told in.
    gaps = [
        np.linalg.norm(p[:, None] - p, axis=-1)
        for p in (demonstration.grippers.p, skill.configuration.X_FG.p)
    ]
    np.testing.assert_allclose(gaps[0], gaps[1], atol=1e-9)
    np.testing.assert_allclose(
        skill.configuration.cable_direction, np.tile([0, 0, 1.0], (n, 1)), atol=1e-9
    )
    skill.save(tmp_path / "skill.npz")
    again = ContactSkill.load(tmp_path / "skill.npz")
    np.testing.assert_array_equal(again.X_NG.p, skill.X_NG.p)


def test_demonstrated_contacts_are_feasible(shipped):
    demonstration, skill, n = shipped
    surface = LocalSurface(
        compute_features(to_canonical(demonstration.cloud)[0], skill.parameters.features)
    )
    centre = skill.hull.centroid
    assert (
        reasons_against(skill.X_NG, skill.X_NQ, np.zeros(n), centre, surface, TransferParameters())
        == ()
    )
