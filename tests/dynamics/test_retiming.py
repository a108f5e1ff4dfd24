from dataclasses import dataclass

import numpy as np
import pytest

from drake_aerial.dynamics.path_check import check_path
from drake_aerial.dynamics.path_limits import CarriedPayload, PathLimits
from drake_aerial.dynamics.path_speed import fastest_progress
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.dynamics.retiming import retime, slowing_factor
from drake_aerial.errors import InputError, JobError
from drake_aerial.references.path import Arc, rest
from drake_aerial.references.retimed import Move, parts_of
from drake_aerial.references.trajectory import (
    LineTrajectory,
    Trajectory,
    TransportTrajectory,
    WaypointTrajectory,
)
from drake_aerial.statics.gravity import GRAVITY

BOX = CarriedPayload.of_model(PayloadModelParameters(0.25, 0.006 * np.eye(3), [[0.0, 0.0, 0.1]]))
AIRBORNE = {"ground_time": 0.0, "lift_time": 0.0, "hover_time": 0.5}


def moves(trajectory):
    return [part for part in parts_of(trajectory) if isinstance(part, Move)]


def test_the_fastest_motion_on_a_line_is_bang_bang():
    line = LineTrajectory(displacement=(4.0, 0.0, 0.0), **AIRBORNE)
    limits = PathLimits(thrust_margin=0.0, tilt=1.5)
    times, progress = fastest_progress(moves(line)[0], BOX, limits, 0.0)
    acceleration = np.sqrt((7.07 / 0.5) ** 2 - GRAVITY**2)
    # The ball of thrusts has 80 tangent planes around it.
    assert times[-1] == pytest.approx(2.0 * np.sqrt(4.0 / acceleration), rel=0.03)
    assert progress[0] == 0.0
    assert progress[-1] == 1.0
    assert np.interp(0.5 * times[-1], times, progress) == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("mode", ["slower", "fastest"])
def test_a_retimed_path_is_possible_and_stays_on_its_circle(mode):
    circle = TransportTrajectory.airborne(turns=1.0, circle_time=1.5, hover_time=0.5)
    assert not check_path(circle, BOX).feasible
    retimed = retime(circle, BOX, mode=mode)
    assert check_path(retimed, BOX).feasible
    p = retimed.sample(np.linspace(0.0, retimed.duration, 500)).p
    np.testing.assert_allclose(np.linalg.norm(p - [-1.0, 0.0, 0.0], axis=1), 1.0, atol=1e-9)
    # Slower than asked, and not slower than by a uniform factor.
    factor = slowing_factor(circle, BOX)
    assert 1.5 < moves(retimed)[0].duration <= 1.5 * factor * 1.01


def test_possible_moves_and_rests_keep_their_timing():
    legs = WaypointTrajectory(
        waypoints=((1.0, 0.0, 0.0), (1.0, 1.0, 0.0)), leg_times=(3.0, 0.7), **AIRBORNE
    )
    retimed = retime(legs, BOX)
    first, second = moves(retimed)
    assert first.duration == 3.0
    assert second.duration > 0.7
    t = np.linspace(0.0, 2.9, 50)
    np.testing.assert_allclose(retimed.sample(t).p, legs.sample(t).p, atol=1e-12)
    assert retime(retimed, BOX) is retimed
    hover = retimed.phase("hover")
    assert hover.end - hover.start == pytest.approx(0.5)


def test_a_factor_below_the_one_that_is_told_is_not_enough():
    factor = slowing_factor(LineTrajectory(line_time=1.0, **AIRBORNE), BOX)
    for k, feasible in ((0.97 * factor, False), (1.03 * factor, True)):
        line = LineTrajectory(line_time=k, **AIRBORNE)
        assert check_path(line, BOX).feasible == feasible


def test_segments_that_join_without_rest_get_one_law():
    retimed = retime(Spiral(), BOX)
    assert check_path(retimed, BOX).feasible
    assert [phase.name for phase in retimed.phases] == ["first", "second", "hover"]
    t = np.linspace(0.0, retimed.duration, 2000)
    speed = np.linalg.norm(retimed.sample(t).v, axis=1)
    assert np.abs(np.diff(speed)).max() < 0.05
    np.testing.assert_allclose(retimed.sample(t[-1]).p, Spiral().sample(99.0).p, atol=1e-9)


@dataclass(frozen=True)
class Spiral(Trajectory):
    """Two arcs that join at speed, each with a law of its own."""

    name = "spiral"

    def segment_chain(self):
        first = Half("first", 1.0, (-1.0, 0.0, 0.0), 1.0, 0.0, np.pi, speeds_up=True)
        second = Half("second", 1.0, (-1.0, 0.0, 0.0), 1.0, np.pi, np.pi, speeds_up=False)
        return [first, second, rest("hover", 0.5, second.end)]


@dataclass(frozen=True)
class Half(Arc):
    """Half of a turn with smooth timing that is split at its fastest point."""

    speeds_up: bool = True

    def derivatives(self, t):
        whole = Arc("whole", 2.0, self.centre, self.radius, 0.0, 2.0 * np.pi, "smooth")
        return whole.derivatives(t if self.speeds_up else t + 1.0)


def test_a_payload_that_is_too_heavy_has_no_timing():
    heavy = PayloadModelParameters(0.6, 0.006 * np.eye(3), [[0.0, 0.0, 0.1]])
    with pytest.raises(JobError, match="no timing makes the phase 'line' possible: rest needs"):
        retime(LineTrajectory(**AIRBORNE), CarriedPayload.of_model(heavy))


def test_an_unknown_mode_is_refused():
    with pytest.raises(InputError, match="`mode` must be one of slower, fastest, got 'quick'"):
        retime(LineTrajectory(), BOX, mode="quick")
