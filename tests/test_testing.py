"""The pytest plugin: it is opt-in, and its fixtures and assertions do what they say."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from drake_aerial.errors import InputError
from drake_aerial.plant.payload import Payload
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.testing import (
    assert_completed,
    assert_taut,
    assert_tension_below,
    assert_tracks,
    contacts_from_above,
)

G = 9.81
PYPROJECT = Path(__file__).parent.parent / "pyproject.toml"


class Hold(LeafSystem):
    """A user's law: hold the quadrotor a cable's length above the reference, weight fed forward."""

    def __init__(self, model, share=1.0):
        super().__init__()
        self._thrust = np.array([0.0, 0.0, share * model.weight])
        self._above = np.array([0.0, 0.0, 0.14 + 0.5])
        self._states = self.DeclareVectorInputPort("quadrotor_states", 13)
        self._reference = self.DeclareAbstractInputPort(
            "reference", AbstractValue.Make(HoverTrajectory())
        )
        self.DeclareVectorOutputPort("thrust_vectors", 3, self._calc)

    def _calc(self, context, output):
        state = self._states.Eval(context)
        target = self._reference.Eval(context).sample(context.get_time()).p + self._above
        output.SetFromVector(8.0 * (target - state[4:7]) - 4.0 * state[10:13] + self._thrust)


def test_the_plugin_is_active_only_where_it_is_asked_for(tmp_path):
    assert "entry-points" not in tomllib.loads(PYPROJECT.read_text())["project"]
    test = "def test_scan(aerial_scan):\n    assert aerial_scan\n"
    (tmp_path / "test_scan.py").write_text(test)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:dash", "-p", "no:cacheprovider"]

    def run():
        # An environment in which an older version is installed may still load the plugin.
        environment = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True)

    assert b"fixture 'aerial_scan' not found" in run().stdout
    (tmp_path / "conftest.py").write_text('pytest_plugins = ["drake_aerial.testing"]\n')
    assert run().returncode == 0


def test_a_custom_controller_is_tested_in_five_lines(aerial_flight):
    trial = aerial_flight([[0.0, 0.0]], controller=Hold, trajectory=HoverTrajectory(hover_time=2.0))
    assert_completed(trial)
    assert_taut(trial)
    assert_tracks(trial, rmse=0.05)
    assert_tension_below(trial, 1.5 * 0.25 * G)
    assert trial.metrics["configuration"]["controller"] == "Hold"


def test_the_assertions_can_fail(aerial_flight):
    weak = {"controller": Hold, "controller_options": {"share": 0.9}}
    trial = aerial_flight(**weak, trajectory=HoverTrajectory(hover_time=1.0))
    with pytest.raises(AssertionError, match=r"distance from the path is 0\.\d+ m, limit 0\.01 m"):
        assert_tracks(trial, rmse=0.01)
    with pytest.raises(AssertionError, match="largest distance"):
        assert_tracks(trial, largest=0.01)
    with pytest.raises(AssertionError, match=r"tension of cable 1 reached \d\.\d+ N, limit 1 N"):
        assert_tension_below(trial, 1.0)
    trial.series["tension"][:] = 0.0
    with pytest.raises(AssertionError, match=r"slack for 100\.0 %"):
        assert_taut(trial)
    trial.metrics.update(outcome="crashed", outcome_reason="it fell")
    with pytest.raises(AssertionError, match="crashed: it fell"):
        assert_completed(trial)
    with pytest.raises(InputError, match=r"`phase` must be one of .*, hover, got 'landing'"):
        assert_tracks(trial, rmse=1.0, phase="landing")


def test_a_controller_without_thrusts_is_refused(aerial_flight):
    class Silent(LeafSystem):
        def __init__(self, model):
            super().__init__()

    with pytest.raises(InputError, match="thrust_vectors"):
        aerial_flight(controller=Silent)


def test_contacts_from_above_are_on_the_top():
    box = Payload.read("box_68x61x28")
    points, normals = contacts_from_above(box, [[0.1, -0.2], [0.0, 0.0]])
    assert points == pytest.approx(np.array([[0.1, -0.2, 0.14], [0.0, 0.0, 0.14]]), abs=1e-6)
    assert normals == pytest.approx(np.tile([0.0, 0.0, 1.0], (2, 1)))
    with pytest.raises(InputError, match="has no surface at"):
        contacts_from_above(box, [[0.5, 0.0]])


def test_scans_and_skills(aerial_scan, aerial_skill):
    whole, seen = aerial_scan(), aerial_scan(viewpoint=[1.0, -0.8, 1.2], noise=0.001, seed=3)
    assert np.ptp(whole.points, axis=0) == pytest.approx([0.68, 0.68, 0.28], abs=0.005)
    assert seen.viewpoint == pytest.approx([1.0, -0.8, 1.2])
    assert np.array_equal(
        seen.points, aerial_scan(viewpoint=[1.0, -0.8, 1.2], noise=0.001, seed=3).points
    )
    assert aerial_skill("flat") is aerial_skill("flat")
    assert len(aerial_skill("flat")) == 1


def test_a_station_exports_its_ports(aerial_station):
    station = aerial_station([[-0.2, 0.0], [0.2, 0.0]])
    assert station.n == 2
    assert station.GetInputPort("attitude.thrust_vectors").size() == 6
