"""The replay page is self-contained and animated; cables are drawn in their length."""

import base64
import re

import numpy as np
import pytest

from drake_aerial.geometry import Pose
from drake_aerial.plant import triangles
from drake_aerial.simulation.trial_result import TrialResult
from drake_aerial.visualization.flight_scene import FlightScene, cable_points
from drake_aerial.visualization.replay import write_replay


@pytest.mark.parametrize("distance", [0.05, 0.2, 0.45, 0.499])
@pytest.mark.parametrize("direction", [(0, 0, -1), (1, 0, 0), (0.6, 0.0, -0.8), (0.01, 0, -1)])
def test_a_slack_cable_keeps_its_length(distance, direction):
    start = np.array([1.0, 2.0, 3.0])
    direction = np.array(direction) / np.linalg.norm(direction)
    points = cable_points(start, start + distance * direction, 0.5, 40)
    pieces = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert points[0] == pytest.approx(start)
    assert points[-1] == pytest.approx(start + distance * direction)
    assert pieces.sum() == pytest.approx(0.5, rel=0.005)
    assert np.ptp(pieces) < 1e-9


def test_a_level_slack_cable_bows_down():
    points = cable_points(np.zeros(3), np.array([0.3, 0.0, 0.0]), 0.5, 10)
    assert points[5, 2] < -0.1
    assert points[:, 1] == pytest.approx(np.zeros(11))


def test_a_taut_cable_is_straight_and_a_torn_one_hangs():
    points = cable_points(np.zeros(3), np.array([0.3, 0.0, -0.4]), 0.5, 5)
    assert points == pytest.approx(np.linspace(0, 1, 6)[:, None] * [0.3, 0.0, -0.4])
    torn = cable_points(np.zeros(3), np.array([5.0, 0.0, -5.0]), 0.5, 5)
    assert torn[-1] == pytest.approx([0, 0, -0.5])


def made_up(samples=60, n=2):
    t = 0.01 * np.arange(samples)
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (samples, 1))
    p = np.column_stack([t, np.zeros(samples), 1.0 + t])
    contacts = p[:, None] + np.array([[0.2, 0, 0.1], [-0.2, 0, 0.1]])[:n]
    vertices, faces = triangles.box(np.array([0.6, 0.4, 0.2]))
    series = {
        "time": t,
        "payload_position": p,
        "payload_quaternion": upright,
        "reference_position": p + 0.01,
        "quadrotor_position": contacts + [0, 0, 0.45],
        "quadrotor_quaternion": np.tile(upright[:, None], (1, n, 1)),
        "contact_position": contacts,
        "tension": np.full((samples, n), 1.2),
        "tilt": np.zeros(samples),
    }
    metrics = {
        "configuration": {"payload": {"mass": 0.25}},
        "outcome": "dropped",
        "outcome_reason": "a gripper was pulled off",
        "outcome_time_s": 0.1,
        "position_rmse_m": None,
        "position_max_m": None,
        "circle_position_rmse_m": None,
        "tilt_max_rad": None,
        "thrust_mean_N": None,
        "tension_max_N": 2.0,
        "phases": {"ground": [0.0, 0.59]},
    }
    return TrialResult(
        metrics, series, ("ground",), vertices, faces, contacts[0] - p[0], np.full(n, 0.5)
    )


def test_the_page_is_self_contained_and_animated(tmp_path):
    path = tmp_path / "flight.html"
    result = made_up()
    write_replay(path, result, title="Two & two")
    page = path.read_text()
    assert "Two &amp; two" in page
    assert "a gripper was pulled off" in page
    assert '<script src="http' not in page
    animation = animation_of(page)
    for name in (
        b"payload",
        b"reference",
        b"quadrotor0",
        b"quadrotor1",
        b"taut0",
        b"taut1",
        b"slack1/11",
    ):
        assert b"/drake/" + name in animation


def animation_of(page):
    # The page replays packed messages.
    packed = re.findall(r'fetch\("data:application/octet-binary;base64,([^"]+)"', page)
    (animation,) = (m for m in map(base64.b64decode, packed) if b"set_animation" in m)
    return animation


def test_the_plots_show_error_tension_and_tilt(tmp_path):
    result = made_up()
    result.series["tension"][:, 1] = 0.0
    write_replay(tmp_path / "flight.html", result)
    page = (tmp_path / "flight.html").read_text()
    for title in ("position error [cm]", "tension of cables 1 to 2 [N]", "payload tilt [deg]"):
        assert title in page
    assert '"values": [[[1.73]' in page  # a centimetre along each axis


class SceneNotes:
    """Takes a Meshcat's place and notes what is shown and where."""

    def __init__(self):
        self.visible, self.placed = {}, {}

    def SetProperty(self, name, key, value, time_in_recording=None):
        if key == "visible":
            self.visible[name] = value

    def SetTransform(self, name, X, time_in_recording=None):
        self.placed[name] = X

    def SetObject(self, *arguments):
        pass


def test_a_cable_is_taut_or_slack_or_gone():
    result = made_up(n=2)
    meshcat = SceneNotes()
    scene = FlightScene(meshcat, result.vertices, result.faces, result.p_LC, result.cable_length)

    def move(slack, attached):
        meshcat.placed.clear()
        upright = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
        contacts = np.array([[0.2, 0.0, 0.1], [-0.2, 0.0, 0.1]])
        quadrotors = Pose(contacts + [0.0, 0.0, 0.45], upright)
        scene.move(
            Pose(np.zeros(3), upright[0]), np.zeros(3), quadrotors, contacts, slack, attached
        )
        return {
            name: shown
            for name, shown in meshcat.visible.items()
            if name[:5] in ("taut0", "taut1", "slack")
        }

    assert move([False, True], [True, True]) == {
        "taut0": True,
        "slack0": False,
        "taut1": False,
        "slack1": True,
    }
    assert meshcat.placed["taut0"].translation() == pytest.approx([0.2, 0.0, 0.325])
    assert "taut1" not in meshcat.placed
    # The bow is 5 cm longer than the way and goes sideways.
    assert abs(meshcat.placed["slack1/6"].translation()[:2] - [-0.2, 0.0]).max() > 0.05
    gone = move([False, True], [False, False])
    assert not any(gone.values())
    assert not any("taut" in name or "slack" in name for name in meshcat.placed)


def test_a_file_without_attached_has_a_page(tmp_path):
    result = made_up()
    assert "attached" not in result.series
    write_replay(tmp_path / "old.html", result)
    result.series["attached"] = np.zeros((60, 2), dtype=bool)
    write_replay(tmp_path / "new.html", result)
    # Hidden parts have keys at the ends alone.
    old, new = (
        len(animation_of((tmp_path / f"{name}.html").read_text())) for name in ("old", "new")
    )
    assert new < old


def test_a_flight_that_ended_at_once_has_a_page(tmp_path):
    write_replay(tmp_path / "flight.html", made_up(samples=1))
    assert (tmp_path / "flight.html").stat().st_size > 100_000
