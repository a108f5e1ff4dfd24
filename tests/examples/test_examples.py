"""The examples are short, run as programs, have a picture each, and their results are right."""

import re
import runpy
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
LONGER = {"two_quadrotors_and_a_bar": 40, "look_plan_and_fly": 50}
"""Longer examples, and the number of lines that they stay below."""
PAGE = (ROOT / "docs" / "examples.md").read_text()


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Run an example in an empty folder and return its variables."""

    def run_example(name: str) -> dict:
        monkeypatch.chdir(tmp_path)
        names = runpy.run_path(str(ROOT / "examples" / f"{name}.py"), run_name="__main__")
        assert list(tmp_path.iterdir()) == [], "files written to the working directory"
        return names

    return run_example


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_short_and_on_the_page_with_its_picture(path):
    lines = path.read_text().splitlines()
    if path.stem in LONGER:
        assert len([line for line in lines if line.strip()]) < LONGER[path.stem]
        assert f"examples/{path.name}" in PAGE
        return
    assert len(lines) <= 30
    assert f"```{{literalinclude}} ../examples/{path.name}\n" in PAGE
    picture = ROOT / "docs" / "images" / "examples" / f"{path.stem}.png"
    assert f"(images/examples/{picture.name})" in PAGE
    assert picture.stat().st_size < 150_000
    with Image.open(picture) as image:
        assert image.size[0] >= 500


def test_examples_import_what_is_documented():
    """From the package's root, or from a module that the reference documents."""
    reference = "".join(page.read_text() for page in (ROOT / "docs" / "api").glob("*.md"))
    texts = [path.read_text() for path in EXAMPLES]
    deep = {
        f"drake_aerial.{module}.{name}"
        for text in texts
        for module, names in re.findall(r"from drake_aerial\.(\S+) import (.+)", text)
        for name in names.split(", ")
    }
    assert [name for name in sorted(deep) if f":: {name}\n" not in reference] == []


def test_the_contact_is_in_the_middle_and_the_flight_completes(run):
    names = run("demonstration_to_flight")
    assert np.linalg.norm(names["contacts"].best.X_SG.p[0] - [0.0, 0.0, 0.14]) < 0.03
    assert names["flight"].outcome == "completed"


def test_both_controllers_carry_the_box_along_the_line(run):
    for flight in run("own_controller")["flights"].values():
        assert flight.outcome == "completed"
        moved = flight.series["payload_position"][-1] - flight.series["payload_position"][0]
        assert moved == pytest.approx([1.0, 0.0, 1.0], abs=0.1)


def test_a_larger_weight_brings_the_contact_nearer_to_the_point(run):
    names = run("own_cost")
    solutions = names["refined"].values()
    assert all(solution.feasible for solution in solutions)
    away = [np.linalg.norm(solution.X_SG.p[0, :2] - names["point"]) for solution in solutions]
    middle = np.linalg.norm(names["point"])
    assert away[0] == pytest.approx(middle, abs=0.02)
    assert away[0] > 1.2 * away[1] > 10.0 * away[2]


def test_the_camera_finds_the_middle_of_the_top(run):
    names = run("camera_in_a_diagram")
    contact = names["X_WC"] @ names["contacts"].best.X_SG.p[0]
    # The box stands on the ground and is 28 cm high.
    assert contact == pytest.approx([0.0, 0.0, 0.28], abs=0.03)


def test_the_parcel_on_the_floor_is_seen_and_flown(run):
    names = run("look_plan_and_fly")
    assert names["p_WG"] == pytest.approx([0.0, 0.0, 0.28], abs=0.04)
    assert names["result"].outcome == "completed"


def test_three_quadrotors_share_the_load_as_statics_predicts(run):
    names = run("three_quadrotors")
    assert names["flight"].outcome == "completed"
    # The grippers weigh 0.02 N each.
    assert names["flown"] == pytest.approx(names["expected"], abs=0.06)


def test_the_observer_removes_the_drift(run):
    flights = run("disturbance_observer")["flights"]
    drift = {
        name: (flight.series["payload_position"] - flight.series["reference_position"])[-50:]
        for name, flight in flights.items()
    }
    assert drift["without"][:, 0].min() > 0.2  # downwind
    assert np.abs(drift["with"]).max() < 0.01


def test_the_study_has_a_record_of_every_flight_and_a_report(run):
    names = run("own_study")
    assert names["summary"].outcomes == {"completed": 2 * 1 * 2}
    assert (names["folder"] / "report.html").stat().st_size > 10_000


def test_the_lifted_box_accelerates_as_the_thrust_predicts(run):
    names = run("parts_without_the_station")
    context = names["simulator"].get_context()
    box, quadrotor, tension = (log.FindLog(context).data() for log in names["logs"])
    carried = 0.25 + 0.002 + 2e-4  # box, gripper, link of the cable [kg]
    acceleration = 6.0 / (0.25 + carried) - 9.81
    for state in (box, quadrotor):
        assert state[12, -1] == pytest.approx(acceleration * 1.0, rel=0.005)
    assert tension[0, -1] == pytest.approx(carried * (acceleration + 9.81), rel=0.005)


def test_the_bar_ends_where_the_springs_hold_the_weight(run):
    state = run("two_quadrotors_and_a_bar")["state"]
    # Each quadrotor carries itself, its cable's link and half of bar and grippers. The thrust is
    # 3.9 N; the spring of 6 N/m supplies the rest.
    weight = 9.81 * (0.25 + 2e-4 + (0.3 + 2 * 0.002) / 2)
    height = 2.0 - (weight - 3.9) / 6.0 - 0.5 - 0.03
    assert state[4:7] == pytest.approx([0.0, 0.0, height], abs=2e-3)
    assert np.abs(state[1:4]).max() < 0.01
    assert np.abs(state[7:]).max() < 0.01
