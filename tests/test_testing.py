"""The pytest plugin: what its fixtures make, and that its assertions fail when they should."""

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


class Hold(LeafSystem):
    """A user's own: hold the quadrotor a cable's length above the reference, with the weight fed forward."""

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


def test_a_controller_of_ones_own_in_five_lines(aerial_flight):
    trial = aerial_flight([[0.0, 0.0]], controller=Hold, trajectory=HoverTrajectory(hover_time=2.0))
    assert_completed(trial)
    assert_taut(trial)
    assert_tracks(trial, rmse=0.05)
    assert_tension_below(trial, 1.5 * 0.25 * G)
    assert trial.metrics["configuration"]["controller"] == "Hold"


def test_the_assertions_can_fail(aerial_flight):
    weak = {"controller": Hold, "controller_options": {"share": 0.9}}
    trial = aerial_flight(**weak, trajectory=HoverTrajectory(hover_time=1.0))
    with pytest.raises(AssertionError, match="distance from the path 0"):
        assert_tracks(trial, rmse=0.01)
    with pytest.raises(AssertionError, match="largest distance"):
        assert_tracks(trial, largest=0.01)
    with pytest.raises(AssertionError, match=r"cable 1 carried \d\.\d+ N"):
        assert_tension_below(trial, 1.0)
    trial.series["tension"][:] = 0.0
    with pytest.raises(AssertionError, match=r"slack for 100\.0 %"):
        assert_taut(trial)
    trial.metrics.update(outcome="crashed", outcome_reason="it fell")
    with pytest.raises(AssertionError, match="crashed: it fell"):
        assert_completed(trial)
    with pytest.raises(ValueError, match="no phase 'landing'"):
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
    with pytest.raises(InputError, match="no part of payload"):
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
