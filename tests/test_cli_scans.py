"""What the command line prints and records about a scan."""

import json

import numpy as np
import pytest
import trimesh
from PIL import Image

from drake_aerial.cli import main

BOX = trimesh.sample.sample_surface(trimesh.creation.box([0.6, 0.4, 0.2]), 9000, seed=0)[0]


def transfer(tmp_path, *arguments):
    out = tmp_path / "contacts.json"
    code = main(["transfer", "flat", *map(str, arguments), "--top", "1", "--out", str(out)])
    return code, json.loads(out.read_text()) if out.exists() else None


def test_nothing_is_assumed_of_a_clean_scan(tmp_path, capsys):
    np.save(tmp_path / "box.npy", BOX)
    code, contacts = transfer(tmp_path, tmp_path / "box.npy")
    assert code == 0
    assert "assumptions" not in contacts["cloud"]
    assert "assumed" not in capsys.readouterr().err


def test_assumptions_are_printed_and_recorded(tmp_path, capsys):
    points = np.concatenate([BOX, np.full((500, 3), [1.3, -0.9, 0.9]), [[np.nan] * 3]])
    np.save(tmp_path / "box.npy", points)
    code, contacts = transfer(tmp_path, tmp_path / "box.npy", "--viewpoint", 0, 0, 3)
    assert code == 0
    recorded = contacts["cloud"]["assumptions"]
    assert [assumption["kind"] for assumption in recorded] == ["dropped", "dropped", "outside"]
    printed = capsys.readouterr().err.splitlines()
    for assumption in recorded:
        assert f"assumed {assumption['kind']}: {assumption['text']}" in printed


def test_a_scan_in_camera_axes_needs_up(tmp_path, capsys):
    depth = np.zeros((240, 320), np.uint16)
    depth[60:180, 80:240] = 1000
    Image.fromarray(depth).save(tmp_path / "depth.png")
    (tmp_path / "camera.yaml").write_text(
        "{width: 320, height: 240, fx: 300, fy: 300, cx: 159.5, cy: 119.5}"
    )
    scan = (tmp_path / "depth.png", "--camera", tmp_path / "camera.yaml")
    code, contacts = transfer(tmp_path, *scan)
    assert (code, contacts) == (2, None)
    assert "up is unknown in camera axes; give --up X Y Z" in capsys.readouterr().err
    code, contacts = transfer(tmp_path, *scan, "--up", 0, 0, -1)
    assert code == 0
    np.testing.assert_allclose(
        contacts["solutions"][0]["grippers"][0]["position"], [0, 0, 1.0], atol=0.03
    )
    assert contacts["cloud"]["camera"]["fx"] == 300
    # The page of the contacts finds the image again.
    out = tmp_path / "contacts.html"
    assert main(["view", str(tmp_path / "contacts.json"), "--out", str(out)]) == 0


@pytest.mark.parametrize("factor", [100.0, 1 / 0.0254])
def test_a_scan_in_another_unit_is_refused_with_its_size(tmp_path, capsys, factor):
    np.save(tmp_path / "box.npy", BOX / 2 * factor)
    code, contacts = transfer(tmp_path, tmp_path / "box.npy")
    assert (code, contacts) == (2, None)
    assert f"{0.3 * factor:.3g} m large; are its units" in capsys.readouterr().err
