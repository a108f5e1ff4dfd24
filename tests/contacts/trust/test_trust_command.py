"""The command `transfer` fails below the threshold, and says why; the page shows the trust."""

import json
import re

import numpy as np
import pytest

from drake_aerial.cli import main
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.skill.learn import learn
from tests.contacts.box_scans import box_demonstration, box_points


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("trust")
    learn(box_demonstration((0.6, 0.42, 0.25))).save(path / "skill.npz")
    points = box_points((0.7, 0.5, 0.3), 0.012, np.random.default_rng(2))
    np.save(path / "scan.npy", PointCloud.read(points).points)
    (path / "strict.yaml").write_text("min_trust: 1.0\n")
    return path


def transfer(folder, *options):
    out = folder / "contacts.json"
    arguments = ("transfer", folder / "skill.npz", folder / "scan.npy", "--out", out, *options)
    return main([str(argument) for argument in arguments])


def test_a_right_skill_on_a_similar_box_is_trusted(folder, capsys):
    assert transfer(folder) == 0
    captured = capsys.readouterr()
    (shown, *_) = re.findall(r"trust (\d\.\d\d)  at", captured.out)
    trust = json.loads((folder / "contacts.json").read_text())["solutions"][0]["trust"]
    assert f"{trust['probability']:.2f}" == shown
    assert trust["probability"] > 0.8
    assert "below `min_trust`" not in captured.err


def test_below_the_threshold_the_command_fails_and_says_why(folder, capsys):
    page = folder / "page.html"
    assert transfer(folder, "--parameters", folder / "strict.yaml", "--html", page) == 1
    line = capsys.readouterr().err.strip().splitlines()[-1]
    assert re.match(r"trust 0\.\d\d in the best contact is below `min_trust` = 1: ", line)
    assert "below `min_trust` = 1" in page.read_text()


def test_other_methods_have_no_trust(folder, capsys):
    assert transfer(folder, "--method", "centroid") == 0
    assert "  trust " not in capsys.readouterr().out
