"""Ctrl-C while a job runs, and a full disk: one line, no partial file, no process left behind."""

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
from drake_aerial.cli import learn, main

MESSAGE = "interrupted; no partial files were written"
STUDY = """
name: one
seed: 1
defaults: {trajectory: {kind: hover, hover_time: 2.0}, points: 8000}
conditions: [{name: A, title: a box, demonstration: flat, payload: box_68x61x28, view: top}]
flights:
  - conditions: [A]
    methods: [task, kopicki]
    beliefs: [below_contact]
    solutions: 3
    trials: 5
"""
COMMANDS = {
    "learn": "learn curved --out out/skill.npz",
    "transfer": "transfer flat.npz scan.npy --out out/contacts.json --html out/contacts.html",
    "fly": "fly contacts.json --mass 0.25 --out out",
    "view": "view scan.npy --out out/scan.html",
    "demo": "demo --out out",
    "study": "study --plan study.yaml --workers 0 --out out",
    "demonstrate": "demonstrate scan.npy --no-browser --out out/demonstration.yaml",
}
LONG = ("fly", "demo", "study", "demonstrate")
# All modules are loaded before the command starts, so that the job itself is interrupted.
LOADED = """
import importlib, pkgutil, sys
import distributed, matplotlib.pyplot, open3d, tqdm, trimesh
import drake_aerial
for module in pkgutil.walk_packages(drake_aerial.__path__, "drake_aerial."):
    importlib.import_module(module.name)
print("ready", flush=True)
sys.exit(drake_aerial.cli.main(sys.argv[1:]))
"""


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    points = trimesh.sample.sample_surface(trimesh.creation.box((0.5, 0.4, 0.2)), 8000, seed=0)[0]
    skill = read_skill("flat")
    folder = tmp_path_factory.mktemp("inputs")
    np.save(folder / "scan.npy", points)
    contacts = transfer(skill, PointCloud.read(folder / "scan.npy"), method="centroid")
    return points, skill.to_bytes(), contacts.to_json()


@pytest.fixture
def folder(inputs, tmp_path):
    points, skill, contacts = inputs
    np.save(tmp_path / "scan.npy", points)
    (tmp_path / "flat.npz").write_bytes(skill)
    (tmp_path / "contacts.json").write_text(contacts)
    (tmp_path / "study.yaml").write_text(STUDY)
    return tmp_path


def start(folder, *command, **keywords):
    """Start a command in a process group of its own, as a shell does."""
    return subprocess.Popen(
        [sys.executable, *command],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        **keywords,
    )


def wait_for(condition, seconds):
    """Return True as soon as the condition holds, False if it does not within the time [s]."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.1)
    return True


def is_gone(group):
    """Return True if no process of a group is left."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return True
    return False


def partial_files(folder):
    return [p for p in (folder / "out").rglob(".*") if p.is_file() and p.name != ".lock"]


def check_interrupted(process, name, folder):
    """Send Ctrl-C to the process group, as a terminal does, and check how the command ends."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert "Traceback" not in err, err
    # A short job may be done before the signal arrives; Python's own end dies of the signal.
    if name in LONG or process.returncode not in (0, -signal.SIGINT):
        assert process.returncode == 130, err
        assert err.splitlines()[-1] == f"drake-aerial {name}: {MESSAGE}"
    assert partial_files(folder) == []
    assert wait_for(lambda: is_gone(process.pid), 10.0)


def test_an_interrupted_command_ends_with_one_line_and_130(monkeypatch, capsys):
    def interrupted(arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(learn, "run", interrupted)
    assert main(["learn", "flat", "--out", "skill.npz"]) == 130
    assert capsys.readouterr() == ("", f"drake-aerial learn: {MESSAGE}\n")


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0.05, 0.2, 1.0])
@pytest.mark.parametrize("name", COMMANDS)
def test_ctrl_c_in_a_job_ends_it_with_one_line_and_130(name, delay, folder):
    process = start(folder, "-c", LOADED, *COMMANDS[name].split())
    assert process.stdout.readline() == "ready\n"
    time.sleep(delay)
    check_interrupted(process, name, folder)


@pytest.mark.slow
def test_ctrl_c_in_a_study_with_workers_ends_all_processes(folder):
    command = COMMANDS["study"].replace("--workers 0", "--workers 1").split()
    process = start(folder, "-m", "drake_aerial", *command)
    records = folder / "out" / "records.jsonl"
    assert wait_for(lambda: records.is_file() and records.stat().st_size > 0, 120.0)
    check_interrupted(process, "study", folder)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["learn", "transfer", "fly", "view"])
def test_a_full_disk_is_one_line(name, folder):
    # A limit on the size of files acts as a full disk: both fail in the middle of writing.
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))  # noqa: E731
    process = start(folder, "-m", "drake_aerial", *COMMANDS[name].split(), preexec_fn=limit)
    _, err = process.communicate(timeout=120)
    lines = [line for line in err.splitlines() if line.startswith("drake-aerial")]
    assert process.returncode == 2, err
    assert len(lines) == 1
    assert "File too large" in lines[0]
    assert "Traceback" not in err
    assert partial_files(folder) == []
    written = [path for path in (folder / "out").rglob("*") if path.is_file()]
    assert not any(path.stat().st_size >= 3000 for path in written)
