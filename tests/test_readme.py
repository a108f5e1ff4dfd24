"""What README tells its readers to type works."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
import trimesh

from drake_aerial.cli import main

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


@pytest.mark.parametrize("code", blocks("python"))
def test_the_python_runs(code, capsys):
    exec(compile(code, "README.md", "exec"), {})
    assert capsys.readouterr().out.strip()


def test_the_commands_for_a_scan_of_ones_own_run(tmp_path, monkeypatch):
    """In the order they stand, on a scan of a box's visible top."""
    (text,) = (block for block in blocks("") if "my_scan" in block)
    monkeypatch.chdir(tmp_path)
    box = trimesh.creation.box((0.5, 0.4, 0.2))
    points = trimesh.sample.sample_surface(box, 20000, seed=1)[0]
    top = points[points[:, 2] > 0.099]
    trimesh.PointCloud(np.ascontiguousarray(top)).export(tmp_path / "my_scan.ply")
    for line in text.strip().splitlines():
        words = shlex.split(line)
        assert words[:2] == ["tools/run", "drake-aerial"]
        assert main(words[2:]) == 0, line
    for name in ("contacts.json", "contacts.html", "flight/metrics.json", "flight/trial.html"):
        assert (tmp_path / name).stat().st_size > 500, name


def test_every_file_that_readme_points_at_exists():
    for target in re.findall(r"\]\(([^)#]+)\)", README) + re.findall(
        r"`((?:models|tools|notebooks|docs)/[\w./-]+)`", README
    ):
        if not target.startswith("http"):
            assert (ROOT / target).exists(), target
