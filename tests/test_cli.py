"""The command line as users meet it: exit codes, one line for bad input, no partial files."""

import argparse
import ast
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh

from drake_aerial import Demonstration, choices, cli, learn
from drake_aerial.cli import main

PACKAGE = Path(cli.__file__).parent.parent
CLOUD = "box.ply"


@pytest.fixture(scope="module")
def workshop(tmp_path_factory):
    """A folder with a good cloud, skill and contacts, made by the commands themselves."""
    folder = tmp_path_factory.mktemp("workshop")
    trimesh.creation.box((0.45, 0.35, 0.25)).export(folder / CLOUD)
    assert main(["learn", "flat", "--out", str(folder / "skill.npz")]) == 0
    arguments = [
        "transfer",
        str(folder / "skill.npz"),
        str(folder / CLOUD),
        "--out",
        str(folder / "contacts.json"),
    ]
    assert main(arguments) == 0
    return folder


@pytest.fixture
def run(capsys):
    def call(*arguments):
        try:
            code = main([str(argument) for argument in arguments])
        except SystemExit as stop:  # argparse
            code = stop.code
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return call


def test_help_names_every_command(run):
    code, out, _ = run("--help")
    assert code == 0
    for command in ("demo", "learn", "transfer", "fly", "view"):
        assert command in out


def options_of_the_commands() -> dict[str, set[str]]:
    """Return the options of each command."""
    parser = cli._parser()
    (commands,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    return {
        name: {option for action in command._actions for option in action.option_strings}
        for name, command in commands.choices.items()
    }


def messages() -> list[tuple[str, str]]:
    """Return place and text of everything that the package raises, one line each."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
                texts = [
                    part.value
                    for argument in node.exc.args
                    for part in ast.walk(argument)
                    if isinstance(part, ast.Constant) and isinstance(part.value, str)
                ]
                found.append((f"{path.relative_to(PACKAGE)}:{node.lineno}", " ".join(texts)))
    return found


def test_every_option_that_a_text_of_the_package_names_exists():
    known = {"--help", "--version"}.union(*options_of_the_commands().values())
    unknown = []
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                # Style sheets have names of one letter only.
                words = re.findall(r"(?:^|[\s(`'\[])(--[a-z][a-z-]+)(?![\w:-])", node.value)
                unknown += [f"{path.name}:{node.lineno} {w}" for w in words if w not in known]
    assert unknown == []


def test_a_command_in_a_text_of_the_package_exists_with_its_options():
    known, seen = options_of_the_commands(), 0
    texts = [(path.name, path.read_text()) for path in sorted(PACKAGE.rglob("*.html"))]
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                texts.append((f"{path.name}:{node.lineno}", node.value))
    for place, text in texts:
        for command, rest in re.findall(r"drake-aerial ([a-z]+)\b([^\n`]*)", text):
            assert command in known, f"{place} {command}"
            options = set(re.findall(r"--[a-z-]+", rest))
            assert options <= known[command], f"{place} {command}{rest}"
            seen += 1
    assert seen > 5


def test_every_name_in_backquotes_that_a_message_advises_exists():
    # Methods, and the keys of the headers of files.
    names = {*choices.METHODS, "schema", "version"}
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
                names.add(node.name)
            elif isinstance(node, ast.arg):
                names.add(node.arg)
            elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                names.add(node.target.id)
    advised = [
        (place, name) for place, text in messages() for name in re.findall(r"`([a-z_]\w*)`", text)
    ]
    assert len(advised) > 5
    assert [(place, name) for place, name in advised if name not in names] == []


def test_the_methods_of_the_command_are_those_of_the_library(workshop, run, tmp_path):
    """`control` too, which the message about missing votes advises."""
    arguments = ("transfer", workshop / "skill.npz", workshop / CLOUD, "--out", tmp_path / "c.json")
    assert run(*arguments, "--method", "control", "--top", 1)[0] in (0, 1)
    assert json.loads((tmp_path / "c.json").read_text())["method"] == "control"


def test_controllers_and_cables_of_the_help_are_those_of_the_library():
    from drake_aerial.control.controller_parameters import CONTROLLERS
    from drake_aerial.plant.cable import CableParameters

    assert tuple(CONTROLLERS) == choices.CONTROLLERS
    assert [CableParameters(kind).kind for kind in choices.CABLES] == list(choices.CABLES)


def test_the_contacts_file_follows_the_contract(workshop):
    contacts = json.loads((workshop / "contacts.json").read_text())
    assert contacts["schema"] == "drake_aerial/contacts"
    assert contacts["version"] == 1
    assert contacts["units"] == "m"
    assert contacts["frame"] == "cloud"
    assert set(contacts["timing"]) == {"features_s", "query_s", "optimise_s"}
    assert {"path", "sha256", "points", "dropped_points", "centroid"} <= set(contacts["cloud"])
    assert [solution["rank"] for solution in contacts["solutions"]] == [1, 2, 3, 4, 5]
    best = contacts["solutions"][0]
    assert set(best) >= {"rank", "log_likelihood", "feasible", "reasons", "grippers", "quadrotors"}
    assert set(best["grippers"][0]) == {"position", "quaternion_wxyz", "normal"}
    # The demonstration was central, and the box is 0.25 m high about its origin.
    assert np.linalg.norm(best["grippers"][0]["position"] - np.array([0, 0, 0.125])) < 0.02


def test_json_on_stdout_is_the_file(workshop, run, tmp_path):
    code, out, _ = run(
        "transfer",
        workshop / "skill.npz",
        workshop / CLOUD,
        "--out",
        tmp_path / "c.json",
        "--top",
        2,
        "--json",
    )
    assert code == 0
    assert json.loads(out) == json.loads((tmp_path / "c.json").read_text())


def test_the_same_seed_gives_the_same_bytes_but_for_the_timing(workshop, run, tmp_path):
    documents = []
    for name in ("a.json", "b.json"):
        assert (
            run("transfer", workshop / "skill.npz", workshop / CLOUD, "--out", tmp_path / name)[0]
            == 0
        )
        document = json.loads((tmp_path / name).read_text())
        document.pop("timing")
        documents.append(json.dumps(document))
    assert documents[0] == documents[1]
    assert run("learn", "flat", "--out", tmp_path / "again.npz")[0] == 0
    assert (tmp_path / "again.npz").read_bytes() == (workshop / "skill.npz").read_bytes()


def write_cloud(path, points):
    np.savez(path, points=np.asarray(points, float))
    return path


GOOD = np.random.default_rng(0).uniform(-0.3, 0.3, (4000, 3)) * [1, 1, 0]

# Name of the case -> points of the cloud, words that the one line must have.
BAD_CLOUDS = {
    "empty": (np.zeros((0, 3)), ["no points"]),
    "all NaN": (np.full((100, 3), np.nan), ["finite"]),
    "too few": (GOOD[:3], ["points"]),
    "all equal": (np.ones((500, 3)), ["equal"]),
    "a line": (np.linspace(0, 1, 500)[:, None] * [1.0, 0, 0], ["line"]),
    "millimetres": (1000 * GOOD, ["millimetres"]),
    "tiny": (1e-4 * GOOD, ["m"]),
    "wrong shape": (np.zeros((50, 2)), ["3"]),
}


@pytest.mark.parametrize("case", BAD_CLOUDS)
def test_bad_clouds_get_one_line_and_exit_2(case, workshop, run, tmp_path):
    points, words = BAD_CLOUDS[case]
    cloud = write_cloud(tmp_path / "cloud.npz", points)
    before = sorted(tmp_path.iterdir())
    code, out, err = run(
        "transfer", workshop / "skill.npz", cloud, "--out", tmp_path / "contacts.json"
    )
    assert code == 2, err
    assert out == ""
    assert len(err.strip().splitlines()) == 1, err
    for word in words:
        assert word in err
    assert sorted(tmp_path.iterdir()) == before


def test_some_nan_points_are_dropped_and_counted(workshop, run, tmp_path):
    points = GOOD.copy()
    points[::100] = np.nan
    cloud = write_cloud(tmp_path / "cloud.npz", points)
    assert (
        run("transfer", workshop / "skill.npz", cloud, "--out", tmp_path / "contacts.json")[0] == 0
    )
    cloud = json.loads((tmp_path / "contacts.json").read_text())["cloud"]
    assert cloud["dropped_points"] == 40
    assert cloud["points"] == 3960


def bad_file(path, content):
    path.write_bytes(content)
    return path


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("broken.ply", b"ply\nformat ascii 1.0\nelement vertex 5\n"),
        ("broken.pcd", b"not a pcd"),
        ("broken.stl", b"\x00" * 10),
        ("broken.npz", b"PK\x03\x04 truncated"),
        ("broken.npy", b"\x93NUMPY"),
        ("cloud.las", b"LASF"),
        ("cloud", b"no ending"),
    ],
)
def test_unreadable_clouds_get_one_line_and_exit_2(name, content, workshop, run, tmp_path):
    path = bad_file(tmp_path / name, content)
    code, _, err = run(
        "transfer", workshop / "skill.npz", path, "--out", tmp_path / "contacts.json"
    )
    assert code == 2
    assert len(err.strip().splitlines()) == 1
    assert name in err
    assert not (tmp_path / "contacts.json").exists()


def test_missing_files_are_named(workshop, run, tmp_path):
    for arguments in (
        ("learn", "nosuch", "--out", tmp_path / "s.npz"),
        ("transfer", workshop / "skill.npz", "nosuch.ply", "--out", tmp_path / "c.json"),
        ("transfer", "nosuch.npz", workshop / CLOUD, "--out", tmp_path / "c.json"),
        ("fly", tmp_path / "nosuch.json", "--out", tmp_path / "f"),
        ("fly", workshop / "contacts.json", "--payload", "nosuch", "--out", tmp_path / "f"),
        ("view", tmp_path / "nosuch.npz", "--out", tmp_path / "page.html"),
    ):
        code, _, err = run(*arguments)
        assert code == 2, arguments
        assert "nosuch" in err
        assert len(err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def rewritten(path, out, **changes):
    with np.load(path) as archive:
        arrays = dict(archive)
    arrays.update({key: np.array(value) for key, value in changes.items()})
    np.savez(out, **arrays)
    return out


def test_skills_of_another_schema_or_version_are_refused_by_name(workshop, run, tmp_path):
    for changes, word in (
        ({"schema": "drake_aerial/song"}, "drake_aerial/song"),
        ({"version": 99}, "99"),
    ):
        skill = rewritten(workshop / "skill.npz", tmp_path / "other.npz", **changes)
        code, _, err = run("transfer", skill, workshop / CLOUD, "--out", tmp_path / "c.json")
        assert code == 2
        assert word in err
        assert len(err.strip().splitlines()) == 1


def test_a_demonstration_that_touches_nothing_is_refused(run, tmp_path):
    text = "cloud: {box: [0.4, 0.3, 0.2], view: top}\n"
    text += "grippers:\n  - {position: [0, 0, 0.3], axis: [0, 0, 1]}\n"
    (tmp_path / "high.yaml").write_text(text)
    code, _, err = run("learn", tmp_path / "high.yaml", "--out", tmp_path / "s.npz")
    assert code == 2
    assert "touches nothing" in err
    assert "0.2" in err  # how far it is
    assert not (tmp_path / "s.npz").exists()


def payload_file(path, text):
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("box: [0.45, 0.35, 0.25]\nmass: 5.0\n", ["N"]),
        ("box: [0.45, 0.35, 0.25]\nmass: 0.25\ninertia: [0.006, 0.0059, 0.107]\n", ["inertia"]),
        ("box: [0.45, 0.35, 0.25]\nmass: -1\n", ["mass"]),
        ("box: [0.45, 0.35, 0.25]\nmas: 0.25\n", ["mas", "mass"]),
        ("mesh: flat.obj\nmass: 0.25\n", ["volume", "inertia"]),
        ("[1, 2\n", ["YAML"]),
    ],
)
def test_bad_payloads_get_one_line_and_exit_2(text, words, workshop, run, tmp_path):
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    payload = payload_file(tmp_path / "payload.yaml", text)
    code, _, err = run(
        "fly", workshop / "contacts.json", "--payload", payload, "--out", tmp_path / "flight"
    )
    assert code == 2, err
    assert len(err.strip().splitlines()) == 1
    for word in words:
        assert word in err, err
    assert not (tmp_path / "flight").exists()


def test_usage_errors_exit_2(run, workshop):
    for arguments in (
        ("fly",),
        ("nosuchverb",),
        ("transfer", "flat", workshop / CLOUD, "--out", "x", "--method", "magic"),
        ("transfer", "flat", workshop / CLOUD, "--out", "x", "--top", "0"),
        ("transfer", "flat", workshop / CLOUD, "--out", "x", "--seed", "-1"),
    ):
        assert run(*arguments)[0] == 2, arguments


def test_view_shows_clouds_skills_and_contacts(workshop, run, tmp_path):
    for name, word in ((CLOUD, "cloud"), ("skill.npz", "skill"), ("contacts.json", "contacts")):
        page = tmp_path / f"{name}.html"
        code, out, err = run("view", workshop / name, "--out", page)
        assert code == 0, err
        assert word in out
        assert f"<title>{word}" in page.read_text()


def test_fly_writes_the_contracts_files(workshop, run, tmp_path):
    out = tmp_path / "flight"
    hover = tmp_path / "hover.yaml"
    hover.write_text("kind: hover\nhover_time: 2.0\n")
    code, text, err = run(
        "fly",
        workshop / "contacts.json",
        "--mass",
        0.2,
        "--trajectory",
        hover,
        "--out",
        out,
        "--json",
        "--graphviz",
        tmp_path / "station.dot",
    )
    assert code == 0, err
    assert "digraph" in (tmp_path / "station.dot").read_text()
    metrics = json.loads((out / "metrics.json").read_text())
    assert json.loads(text) == metrics
    assert metrics["schema"] == "drake_aerial/trial"
    assert metrics["outcome"] == "completed"
    assert {"real_time_factor", "mpc_step_ms"} <= set(metrics["timing"])
    for key in (
        "position_rmse_m",
        "tilt_max_rad",
        "slack_fraction",
        "saturated_fraction",
        "tension_max_N",
    ):
        assert np.isfinite(metrics[key])
    assert (out / "flight.html").stat().st_size > 100_000
    code, said, err = run("view", out / "trial.npz", "--out", tmp_path / "again.html")
    assert code == 0, err
    assert "trial" in said


def test_fly_finds_the_scan_that_view_finds(workshop, run, tmp_path):
    """A scan that has moved together with contacts.json."""
    (tmp_path / "moved").mkdir()
    contacts = json.loads((workshop / "contacts.json").read_text())
    contacts["cloud"]["path"] = "/gone/" + CLOUD
    (tmp_path / "moved" / "contacts.json").write_text(json.dumps(contacts))
    shutil.copy(workshop / CLOUD, tmp_path / "moved" / CLOUD)
    hover = tmp_path / "hover.yaml"
    hover.write_text("kind: hover\nhover_time: 0.2\n")
    moved = tmp_path / "moved" / "contacts.json"
    assert run("view", moved, "--out", tmp_path / "page.html")[0] == 0
    fly = ("fly", moved, "--mass", 0.2, "--trajectory", hover, "--out", tmp_path / "flight")
    code, _, err = run(*fly)
    assert code == 0, err


def test_a_scan_that_is_gone_is_given_with_the_option_that_the_message_names(
    workshop, run, tmp_path
):
    contacts = json.loads((workshop / "contacts.json").read_text())
    contacts["cloud"]["path"] = None
    (tmp_path / "contacts.json").write_text(json.dumps(contacts))
    hover = tmp_path / "hover.yaml"
    hover.write_text("kind: hover\nhover_time: 0.2\n")
    fly = ("fly", tmp_path / "contacts.json", "--mass", 0.2, "--trajectory", hover)
    code, _, err = run(*fly, "--out", tmp_path / "flight")
    assert code == 2
    assert err.count("\n") == 1
    assert "--cloud" in err
    code, _, err = run(*fly, "--cloud", workshop / CLOUD, "--out", tmp_path / "flight")
    assert code == 0, err


def test_learning_from_python_is_the_same(workshop):
    assert learn(Demonstration.read("flat")).to_bytes() == (workshop / "skill.npz").read_bytes()


def test_refining_keeps_the_contract_and_loses_nothing(workshop, run, tmp_path):
    plain = json.loads((workshop / "contacts.json").read_text())
    arguments = (
        "transfer",
        workshop / "skill.npz",
        workshop / CLOUD,
        "--refine",
        "--out",
        tmp_path / "refined.json",
    )
    assert run(*arguments)[0] == 0
    refined = json.loads((tmp_path / "refined.json").read_text())
    assert refined["timing"]["refine_s"] > 0
    assert (
        refined["solutions"][0]["log_likelihood"] >= plain["solutions"][0]["log_likelihood"] - 1e-9
    )
    assert all(solution["feasible"] for solution in refined["solutions"])


def test_a_transfer_that_knows_the_mass_judges_whether_it_can_be_lifted(workshop, run, tmp_path):
    # 7.07 N at most, 2.45 N of it for the quadrotor itself: 0.47 kg.
    arguments = (
        "transfer",
        workshop / "skill.npz",
        workshop / CLOUD,
        "--out",
        tmp_path / "c.json",
        "--mass",
    )
    assert run(*arguments, 0.46)[0] == 0
    assert run(*arguments, 0.48)[0] == 1
    for solution in json.loads((tmp_path / "c.json").read_text())["solutions"]:
        assert "more tension than the propellers lift (4.7 N, at most 4.6 N)" in solution["reasons"]
    code, _, err = run("fly", tmp_path / "c.json", "--mass", 0.2, "--out", tmp_path / "out")
    assert code == 1
    assert "more tension than the propellers lift" in err
    code, _, err = run(*arguments, 0)
    assert code == 2
    assert "positive" in err
