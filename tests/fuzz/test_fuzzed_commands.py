"""Command lines of valid and hostile words.

Every command ends with an exit code, prints one line if the code is 2, no traceback, and leaves no
partial file."""

import contextlib
import io
import json
import tempfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import strategies as st

from drake_aerial import PointCloud, read_skill, transfer
from drake_aerial.cli import main
from tests.fuzz.bounds import bounded, fuzzed
from tests.fuzz.hostile import bomb


@pytest.fixture(scope="module")
def world():
    """A folder with one good file of each kind and some bad ones."""
    return make_world()


def make_world():
    folder = Path(tempfile.mkdtemp(prefix="world_"))
    box = trimesh.creation.box((0.5, 0.4, 0.2))
    points = trimesh.sample.sample_surface(box, 3000, seed=0)[0]
    np.save(folder / "scan.npy", points)
    np.save(folder / "millimetres.npy", 1e3 * points)
    np.save(folder / "nan.npy", np.full((50, 3), np.nan))
    box.export(folder / "box.stl")
    skill = read_skill("flat")
    skill.save(folder / "flat.npz")
    transfer(skill, PointCloud.read(folder / "scan.npy"), method="centroid").write(
        folder / "contacts.json"
    )
    (folder / "hover.yaml").write_text("{kind: hover, hover_time: 0.2}\n")
    (folder / "elastic.yaml").write_text("{kind: elastic}\n")
    (folder / "bad.yaml").write_text("lenght: 1\n")
    (folder / "tags.yaml").write_text("!!python/object/apply:os.system [echo]\n")
    (folder / "cut.npz").write_bytes((folder / "flat.npz").read_bytes()[:5000])
    (folder / "bomb.npz").write_bytes(bomb())
    (folder / "empty.ply").write_bytes(b"")
    (folder / "new\nline.json").write_text("{}")
    return folder


FILES = [
    "scan.npy",
    "millimetres.npy",
    "nan.npy",
    "box.stl",
    "flat.npz",
    "contacts.json",
    "hover.yaml",
    "elastic.yaml",
    "bad.yaml",
    "tags.yaml",
    "cut.npz",
    "bomb.npz",
    "empty.ply",
    "nowhere.ply",
] + ["new\nline.json", "", ".", "..", "x" * 300, "a\x00b", "-1", "\udce4.ply"]
NAMES = ["flat", "formation", "bunny", "box_68x61x28", "nobody", "../flat", "flat.yaml"]
NUMBERS = [
    "0",
    "1",
    "2",
    "-1",
    "0.25",
    "1e9",
    "nan",
    "inf",
    "-inf",
    "1e-300",
    "x",
    "",
    "0x10",
    "99999999999999999999",
    "٣",
]
OUTS = [
    "out.json",
    "out.npz",
    "out.yaml",
    "out.html",
    "out",
    "deep/er/out.json",
    ".",
    "",
    "a\nb.json",
    "scan.npy/under.json",
    "/proc/out.json",
]
VERBS = {
    "learn": (["@"], ["--out o", "--parameters f", "--seed n"]),
    "transfer": (
        ["@", "@"],
        [
            "--out o",
            "--method m",
            "--top n",
            "--seed n",
            "--up n n n",
            "--viewpoint n n n",
            "--parameters f",
            "--json",
            "--refine",
        ],
    ),
    "fly": (
        ["@"],
        [
            "--out o",
            "--mass n",
            "--payload @",
            "--solution n",
            "--belief b",
            "--controller c",
            "--trajectory f",
            "--cable f",
            "--wind f",
            "--seed n",
            "--force",
            "--json",
        ],
    ),
    "view": (["@"], ["--out o", "--skill @"]),
    "report": (["@"], []),
    "defaults": (["w"], ["--kind w", "--out o"]),
    "demonstrate": (["@"], ["--out o", "--at n n n", "--cable-length n", "--name w"]),
    "study": (
        [],
        ["--out o", "--plan f", "--conditions w", "--methods m", "--solutions n", "--workers 0"],
    ),
}
WORDS = ["cable", "controller", "station", "mpc", "elastic", "A", "", "\n", "--", "x" * 200, "é"]
METHODS = ["task", "paper", "kopicki", "centroid", "control", "best"]
POOLS = {
    "@": FILES + NAMES,
    "f": FILES + ["hover", "mpc", "inextensible"],
    "o": OUTS,
    "n": NUMBERS,
    "m": METHODS,
    "b": ["below_contact", "true", "geometric", "none"],
    "c": ["mpc", "geometric", "bad.yaml"],
    "w": WORDS,
}


@st.composite
def command_lines(draw):
    """A verb with its arguments, most of them of the right kind."""
    verb = draw(st.sampled_from([*VERBS, *VERBS, "demo", "nothing"]))
    if verb not in VERBS:
        return [verb, draw(st.sampled_from(["--help", "--out", "--wrong"]))]
    places, options = VERBS[verb]

    def value(kind):
        if kind not in POOLS:
            return kind
        pool = "n" if draw(st.integers(0, 30)) == 0 else kind
        return draw(st.sampled_from(POOLS[pool]))

    words = [verb, *map(value, places)]
    for option in draw(st.lists(st.sampled_from(options or ["--json"]), max_size=5, unique=True)):
        flag, *kinds = option.split()
        words += [flag, *map(value, kinds)]
    if options and "--out o" in options and "--out" not in words and draw(st.integers(0, 3)):
        words += ["--out", draw(st.sampled_from(OUTS[:6]))]
    if verb == "fly" and "--trajectory" not in words:
        words += ["--trajectory", "hover.yaml"]
    if verb == "demonstrate" and "--at" not in words:
        words += [
            "--at",
            *[draw(st.sampled_from(NUMBERS)) for _ in range(3)],
        ]  # without it a page waits for clicks
    if verb == "study" and "--plan" not in words:
        words += ["--plan", draw(st.sampled_from(["bad.yaml", "tags.yaml", "nowhere.yaml"]))]
    if verb == "transfer" and "--method" not in words:
        words += ["--method", draw(st.sampled_from(["centroid", "centroid", "kopicki"]))]
    return words


WORLD = []


def check_command_line(words):
    if not WORLD:
        WORLD.append(make_world())
    world, before = WORLD[0], set(WORLD[0].rglob("*"))
    stdout, stderr = io.StringIO(), io.StringIO()
    with (
        contextlib.chdir(world),
        contextlib.redirect_stdout(stdout),
        contextlib.redirect_stderr(stderr),
        bounded(),
    ):
        try:
            code = main(words)
        except SystemExit as end:  # argparse
            code = end.code
    told = stderr.getvalue()
    assert code in (0, 1, 2), (code, words)
    assert "Traceback" not in told
    if code == 2 and not told.startswith("usage"):
        lines = told.splitlines()
        assert lines[-1].startswith("drake-aerial"), told
        assert len(lines) == 1, told
        assert len(told) < 1200
    made = set(world.rglob("*")) - before
    if code == 2:
        assert not [path for path in made if path.is_file()], (words, made)
    assert not [path for path in made if path.name.startswith(".")], made
    if "--json" in words and code == 0 and words[0] in ("transfer", "fly"):
        json.loads(stdout.getvalue())
    for path in sorted(made, reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()


test_command_lines, test_command_lines_many = fuzzed(
    check_command_line, command_lines(), short=80, long=2000
)
