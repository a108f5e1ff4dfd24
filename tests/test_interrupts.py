"""Ctrl-C at any moment, a full disk, a folder that cannot be written: one line, no half-written file, no process left behind."""

import contextlib
import os
import resource
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import trimesh

from drake_aerial import PointCloud, read_skill, transfer

pytestmark = pytest.mark.slow

STUDY = """
name: one
seed: 1
defaults: {trajectory: {kind: hover, hover_time: 2.0}, points: 8000}
conditions: [{name: A, title: a box, demonstration: flat, payload: box_68x61x28, view: top}]
flights: [{conditions: [A], methods: [task, kopicki], beliefs: [below_contact], solutions: 3, trials: 5}]
"""
VERBS = {
    "learn": ["learn", "curved", "--out", "out/skill.npz"],
    "transfer": [
        "transfer",
        "flat.npz",
        "scan.npy",
        "--out",
        "out/contacts.json",
        "--html",
        "out/contacts.html",
    ],
    "fly": ["fly", "contacts.json", "--mass", "0.25", "--out", "out"],
    "view": ["view", "scan.npy", "--out", "out/scan.html"],
    "demo": ["demo", "--out", "out"],
    "study": ["study", "--plan", "study.yaml", "--workers", "0", "--out", "out"],
    "study with workers": ["study", "--plan", "study.yaml", "--workers", "1", "--out", "out"],
    "demonstrate": ["demonstrate", "scan.npy", "--no-browser", "--out", "out/shown.yaml"],
}


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    points = trimesh.sample.sample_surface(trimesh.creation.box((0.5, 0.4, 0.2)), 8000, seed=0)[0]
    skill = read_skill("flat")
    folder = tmp_path_factory.mktemp("inputs")
    np.save(folder / "scan.npy", points)
    contacts = transfer(skill, PointCloud.read(folder / "scan.npy"), method="centroid")
    return points, skill.to_bytes(), contacts.to_json()


@pytest.fixture
def place(inputs, tmp_path):
    points, skill, contacts = inputs
    np.save(tmp_path / "scan.npy", points)
    (tmp_path / "flat.npz").write_bytes(skill)
    (tmp_path / "contacts.json").write_text(contacts)
    (tmp_path / "study.yaml").write_text(STUDY)
    return tmp_path


def start(verb, place, **keywords):
    command = [sys.executable, "-m", "drake_aerial", *VERBS[verb]]
    return subprocess.Popen(
        command,
        cwd=place,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        **keywords,
    )


def gone(group):
    """Whether all processes of a group end within ten seconds."""
    for _ in range(100):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False


def leftovers(place):
    return [path for path in (place / "out").rglob(".*") if path.is_file() and path.name != ".lock"]


@pytest.mark.parametrize("delay", [0.6, 1.7, 4.0])
@pytest.mark.parametrize("verb", VERBS)
def test_ctrl_c_ends_with_130_and_one_line(verb, delay, place):
    process = start(verb, place)
    time.sleep(delay)
    for _ in range(4):
        # A terminal sends it to all that belong to the command; while workers start, nobody hears it.
        os.killpg(process.pid, signal.SIGINT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            _, told = process.communicate(timeout=10)
            break
    assert "Traceback" not in told, told
    assert process.returncode in (0, 130), told
    if process.returncode == 130:
        # On a machine so slow that the verb was not read yet, it is not named.
        named, unnamed = (
            f"{name}: interrupted; nothing was half-written"
            for name in (f"drake-aerial {VERBS[verb][0]}", "drake-aerial")
        )
        assert told.splitlines()[-1] in (named, unnamed)
    assert leftovers(place) == []
    assert gone(process.pid)


@pytest.mark.parametrize("verb", ["learn", "transfer", "fly", "view"])
def test_a_full_disk_is_one_line(verb, place):
    # A limit on the size of files stands for the disk: both fail in the middle of writing.
    process = start(
        verb, place, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))
    )
    _, told = process.communicate(timeout=120)
    lines = [line for line in told.splitlines() if line.startswith("drake-aerial")]
    assert process.returncode == 2, told
    assert len(lines) == 1
    assert "File too large" in lines[0]
    assert "Traceback" not in told
    assert leftovers(place) == []
    assert not any(
        path.is_file() and path.stat().st_size >= 3000 for path in (place / "out").rglob("*")
    )
