"""The commands and code of the documentation run, and its statements about files are true.

The blocks of a page run in order, in one folder: a `yaml` block is written to the file that its
first line names, `sh` blocks call the command line's `main`, `python` blocks share their names."""

import contextlib
import io
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml

import drake_aerial
from drake_aerial.cli import main

DOCS = Path(__file__).parent.parent / "docs"
PAGES = sorted(
    [*DOCS.glob("*.md"), *DOCS.glob("howto/*.md")],
    key=lambda page: (len(page.relative_to(DOCS).parts), page.name),
)
# Run by the tests marked slow, and by CI from an installed wheel.
LONG = ("demo", "study", "report")


def blocks(page: Path) -> list[tuple[str, str]]:
    """Return language and text of a page's fenced blocks."""
    return re.findall(r"^```(\w+)\n(.*?)^```", page.read_text(), flags=re.DOTALL | re.MULTILINE)


def commands(text: str) -> list[list[str]]:
    """Return the arguments of the lines of a block, which all start with tools/run drake-aerial."""
    lines = [shlex.split(line, comments=True) for line in text.strip().splitlines()]
    assert all(words[:2] == ["tools/run", "drake-aerial"] for words in lines), text
    return [words[2:] for words in lines]


def write(text: str, folder: Path) -> None:
    """Write the file that a block's first line names."""
    (folder / re.match(r"# (\S+)\n", text)[1]).write_text(text)


@pytest.fixture
def workplace(tmp_path, monkeypatch):
    """A folder with a scan of a box's visible top, which the pages call my_scan.ply."""
    points = trimesh.sample.sample_surface(trimesh.creation.box((0.5, 0.4, 0.2)), 20000, seed=1)[0]
    top = np.ascontiguousarray(points[points[:, 2] > 0.099])
    trimesh.PointCloud(top).export(tmp_path / "my_scan.ply")
    monkeypatch.chdir(tmp_path)
    return tmp_path


RUNNING = [
    page for page in PAGES if any(language in ("sh", "python") for language, _ in blocks(page))
]
NAMES = [page.relative_to(DOCS).as_posix() for page in RUNNING]


@pytest.mark.parametrize("page", RUNNING, ids=NAMES)
def test_commands_and_snippets_run(page, workplace):
    names: dict = {}
    for language, text in blocks(page):
        if language == "yaml":
            write(text, workplace)
        elif language == "sh":
            for words in commands(text):
                if words[0] not in LONG:
                    assert main(words) == 0, words
        elif language == "python":
            exec(compile(text, page.name, "exec"), names)


@pytest.mark.slow
@pytest.mark.parametrize("page", RUNNING, ids=NAMES)
def test_long_commands_run(page, workplace):
    for language, text in blocks(page):
        if language == "yaml":
            write(text, workplace)
        elif language == "sh":
            for words in commands(text):
                if words[0] in LONG:
                    assert main(words) == 0, words


def test_every_public_name_is_in_the_reference_once():
    documented = [
        name
        for page in DOCS.glob("api/*.md")
        for name in re.findall(
            r"auto(?:function|class|exception):: drake_aerial\.(\w+)$",
            page.read_text(),
            flags=re.MULTILINE,
        )
    ]
    assert sorted(documented) == sorted(drake_aerial.__all__)


def test_the_documented_defaults_of_trajectories_are_the_classes():
    from drake_aerial.references.trajectory_files import (
        TRAJECTORIES,
        trajectory_from_dict,
        trajectory_to_dict,
    )

    seen = set()
    for language, text in blocks(DOCS / "files.md"):
        if language == "text" and text.startswith("kind:"):
            content = yaml.safe_load(text)
            seen.add(content["kind"])
            default = trajectory_to_dict(TRAJECTORIES[content["kind"]]())
            assert trajectory_to_dict(trajectory_from_dict(content)) == default
            assert set(content) == set(default) - {"start", "yaw"}
    assert seen == set(TRAJECTORIES)


def test_the_documented_files_are_what_is_written(tmp_path):
    from drake_aerial import Payload, read_skill
    from drake_aerial.references.trajectory import HoverTrajectory
    from drake_aerial.simulation.flight import Flight
    from drake_aerial.simulation.flight_options import FlightOptions
    from drake_aerial.simulation.suspended_payload import SuspendedPayload

    page = (DOCS / "files.md").read_text()

    def described(title: str) -> str:
        return page.split(f"## {title}\n")[1].split("\n## ")[0]

    payload = Payload.from_box([0.4, 0.4, 0.2], 0.25)
    suspension = SuspendedPayload.from_contacts(payload, [[0.0, 0.0, 0.1]], [[0.0, 0.0, 1.0]])
    result = Flight(suspension, FlightOptions(trajectory=HoverTrajectory(hover_time=0.5))).run(0)
    for key in set(result.metrics) - {"schema", "version"}:
        assert f"`{key}`" in described("metrics.json"), key
    for key in ("controller_parameters", "station"):
        assert key in result.metrics["configuration"]
        assert f"`{key}`" in described("metrics.json"), key
    for key in result.series:
        assert f"`{key}`" in described("trial.npz"), key

    read_skill("flat").save(tmp_path / "skill.npz")
    with np.load(tmp_path / "skill.npz") as archive:
        for key in archive.files:
            stem = re.sub(r"\d+", "<n>", key.split(".")[0])
            text = described("Skill (.npz)").replace(".*", "").replace(".p`", "`")
            assert f"`{stem}`" in text, key


def test_the_documented_nouns_are_those_of_configuration_files():
    from drake_aerial.configuration import NOUNS
    from drake_aerial.io.records import record_from_mapping
    from drake_aerial.simulation.station_parameters import StationParameters

    page = (DOCS / "files.md").read_text().split("## Configuration files\n")[1].split("\n## ")[0]
    rows = re.findall(r"^\| `(\w+)` \| .* \| (.*) \|$", page, flags=re.MULTILINE)
    assert sorted(noun for noun, _ in rows) == sorted(NOUNS)
    for verb, option in re.findall(r"`(\w+) (--\w+)`", " ".join(read_by for _, read_by in rows)):
        help_text = _help(verb)
        assert f"{option} " in help_text, (verb, option)
    (station,) = (
        yaml.safe_load(text)
        for text in re.findall(r"^```text\n(.*?)^```", page, flags=re.DOTALL | re.MULTILINE)
    )
    station["quadrotor"] = {}
    assert record_from_mapping(StationParameters, station, "files.md").noise == 0.005


def _help(verb: str) -> str:
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.suppress(SystemExit):
        main([verb, "--help"])
    return out.getvalue()


def test_the_documented_payload_and_demonstration_are_read(tmp_path):
    from drake_aerial.plant.payload import Payload
    from drake_aerial.skill.demonstration import Demonstration

    texts = [
        text
        for language, text in blocks(DOCS / "files.md")
        if language == "text" and not text.startswith("kind:")
    ]
    (demonstration,) = (yaml.safe_load(text) for text in texts if "grippers:" in text)
    (payload,) = (yaml.safe_load(text) for text in texts if "inertia:" in text)
    for source in ("file", "mesh", "topic", "object"):
        demonstration["cloud"].pop(source)
    (tmp_path / "demonstration.yaml").write_text(yaml.safe_dump(demonstration))
    (tmp_path / "payload.yaml").write_text(yaml.safe_dump(payload))
    assert Demonstration.read(tmp_path / "demonstration.yaml").cable_length.tolist() == [0.5]
    assert Payload.read(tmp_path / "payload.yaml").mass == 0.30
