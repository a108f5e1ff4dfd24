"""Contacts by position: moved onto the surface, written, and read back."""

import numpy as np
import pytest
import trimesh

from drake_aerial.annotation.demonstration_draft import DemonstrationDraft
from drake_aerial.cli import main
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.geometry import axis_of
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn


def box_points() -> np.ndarray:
    return trimesh.sample.sample_surface(trimesh.creation.box((0.6, 0.4, 0.3)), 20000, seed=3)[0]


@pytest.fixture(scope="module")
def draft():
    return DemonstrationDraft(PointCloud.read(box_points()))


def test_a_contact_is_put_on_the_surface_with_its_normal(draft):
    touch = draft.touch([0.1, 0.05, 0.16])
    assert touch.position == pytest.approx([0.1, 0.05, 0.15], abs=1e-3)
    assert touch.normal == pytest.approx([0, 0, 1], abs=1e-6)
    assert touch.distance == pytest.approx(0.01, abs=1e-3)
    assert touch.surface == "flat"
    assert draft.touch([0.3, 0.0, 0.0]).normal == pytest.approx([1, 0, 0], abs=1e-6)
    assert "edge" in draft.touch([0.28, 0.0, 0.15]).surface


@pytest.mark.parametrize(
    "place", [[0, 0, 0.2], [0, 0, 0], [5, 0, 0], [0.1, np.nan, 0], [0, 0], None, "here"]
)
def test_a_contact_off_the_surface_is_rejected(draft, place):
    with pytest.raises(InputError, match=r"within 0.020 m of the surface|three finite numbers"):
        draft.touch(place)


def test_the_command_writes_what_learn_reads(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scans").mkdir()
    np.save(tmp_path / "scans" / "box.npy", box_points())
    words = ["demonstrate", "scans/box.npy", "--out", "shown/two.yaml", "--cable-length", "0.8"]
    assert main([*words, "--at", "0.2", "0", "0.152", "--at", "-0.2", "0", "0.148"]) == 0
    assert "flat" in capsys.readouterr().out
    shown = Demonstration.read(tmp_path / "shown" / "two.yaml")
    assert shown.grippers.p == pytest.approx(np.array([[0.2, 0, 0.15], [-0.2, 0, 0.15]]), abs=1e-3)
    assert axis_of(shown.grippers.q, 2) == pytest.approx(np.tile([0.0, 0.0, 1.0], (2, 1)), abs=1e-5)
    assert shown.cable_length == pytest.approx([0.8, 0.8])
    assert shown.quadrotors.p[:, 2] == pytest.approx([0.95, 0.95], abs=1e-3)
    assert len(learn(shown)) == 2


def test_a_cloud_without_a_file_is_written_beside_and_up_is_kept(tmp_path):
    turned = box_points()[:, [2, 0, 1]]  # the box's top now looks along x
    draft = DemonstrationDraft(PointCloud.read(turned, up=[1, 0, 0], viewpoint=[3, 0, 0]))
    path = draft.write(tmp_path / "side.yaml", draft.demonstration([[0.15, 0.1, 0.0]], name="side"))
    shown = Demonstration.read(path)
    assert shown.cloud.up == pytest.approx([1, 0, 0])
    assert shown.cloud.viewpoint == pytest.approx([3, 0, 0])
    assert shown.quadrotors.p[0] == pytest.approx([0.65, 0.1, 0.0], abs=1e-3)
    assert np.array_equal(np.sort(shown.cloud.points, axis=0), np.sort(draft.cloud.points, axis=0))


@pytest.mark.parametrize(
    "words",
    [
        ["demonstrate", "box.npy", "--out", "two.txt", "--at", "0", "0", "0.15"],
        ["demonstrate", "box.npy", "--out", "two.yaml", "--at", "0", "0", "0.5"],
        [
            "demonstrate",
            "box.npy",
            "--out",
            "two.yaml",
            "--at",
            "0",
            "0",
            "0.15",
            "--cable-length",
            "-1",
        ],
        ["demonstrate", "box.npy", "--out", "two.txt", "--no-browser"],
        ["demonstrate", "box.npy", "--out", "two.yaml", "--no-browser", "--port", "70000"],
        ["demonstrate", "nothing.npy", "--out", "two.yaml", "--no-browser"],
    ],
)
def test_bad_input_is_one_line(tmp_path, monkeypatch, capsys, words):
    monkeypatch.chdir(tmp_path)
    np.save(tmp_path / "box.npy", box_points())
    assert main(words) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert sorted(p.name for p in tmp_path.iterdir()) == ["box.npy"]
