"""A gripper lets go in flight: the others hold the payload, and momentum is continuous."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from pydrake.math import RotationMatrix
from pydrake.systems.analysis import Simulator

from drake_aerial.control.geometric import GeometricController
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.gripper import GripperParameters
from drake_aerial.references.trajectory import HoverTrajectory, LineTrajectory
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.station import make_transport_station
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.simulation.suspended_payload import SuspendedPayload
from drake_aerial.simulation.trial_result import TrialResult

TRIANGLE = np.array([[-0.154, -0.267, 0.14], [0.308, 0.0, 0.14], [-0.154, 0.267, 0.14]])
UP = np.tile([0.0, 0.0, 1.0], (3, 1))
# Straight up from rest in the air with up to 4 m/s^2: a cable's share of 0.83 N rises to 1.2 N.
RISE = LineTrajectory(
    displacement=(0.0, 0.0, 0.8),
    line_time=1.2,
    ground_time=0.0,
    lift_time=0.0,
    lift_height=0.0,
    hover_time=4.0,
)


def team(kind, *holds, **more):
    grippers = tuple(GripperParameters(holding_force=hold) for hold in holds)
    return StationParameters(cable=CableParameters(kind), gripper=grippers, **more)


def rise(box, kind, controller, holds=(20.0, 1.1, 20.0), **options):
    suspension = SuspendedPayload.from_contacts(box, TRIANGLE, UP)
    options = {
        "trajectory": RISE,
        "parameters": team(kind, *holds, airborne_height=1.5),
        "belief": "true",
        **options,
    }
    return Flight(
        suspension, FlightOptions(controller=controller, path_limits=None, **options)
    ).run(1)


@pytest.mark.parametrize("kind", ["inextensible", "elastic"])
def test_the_rest_of_the_team_holds_the_payload(box, kind, tmp_path):
    result = rise(box, kind, "mpc")
    m, s = result.metrics, result.series
    assert (m["outcome"], m["outcome_reason"]) == (
        "dropped",
        "gripper 2 of 3 was pulled off the payload",
    )
    when = m["outcome_time_s"]
    assert 0.05 < when < 1.0
    assert (m["after_drop"]["outcome"], m["after_drop"]["reason"]) == ("held", "")
    assert m["after_drop"]["time_s"] == pytest.approx(when + 3.0, abs=0.03)
    assert s["time"][-1] == pytest.approx(when + 3.0, abs=0.03)
    at = np.argmin(s["attached"].all(axis=1))
    assert s["time"][at] == pytest.approx(when, abs=0.03)
    assert (s["attached"][at:] == [True, False, True]).all()
    # The two hold it near its place. It hangs below the line through their contacts, which is
    # 0.154 m beside and 0.14 m above its centre.
    away = np.linalg.norm(s["payload_position"][at:] - s["payload_position"][at], axis=1)
    assert away.max() < 0.5
    assert away[-1] < 0.1
    assert s["tilt"][-50:].mean() == pytest.approx(np.arctan2(0.154, 0.14), abs=0.1)
    assert s["tension"][-50:, [0, 2]].mean(axis=0) == pytest.approx(0.5 * 0.256 * 9.81, rel=0.1)
    # The freed quadrotor hovers at its place, a cable's length up, and carries its gripper alone.
    free = s["quadrotor_position"][at:, 1] - s["quadrotor_position"][at, 1]
    assert free[-1] == pytest.approx([0.0, 0.0, 0.5], abs=0.05)
    assert s["thrust"][-50:, 1].mean() == pytest.approx(0.25 * 9.81, rel=0.02)
    # Nothing was scored after the drop; the files keep it all.
    error = np.linalg.norm(s["payload_position"] - s["reference_position"], axis=1)
    scored = s["attached"].all(axis=1) & (s["phase"] >= 3)
    assert m["position_max_m"] == pytest.approx(error[scored].max())
    result.save(tmp_path)
    loaded = TrialResult.load(tmp_path)
    assert loaded.metrics == m
    assert (loaded.series["attached"] == s["attached"]).all()
    assert (
        "gripper 2 of 3 was pulled off the payload; the others held the payload" in loaded.summary()
    )


@pytest.mark.parametrize("controller", ["geometric", "geometric_ff"])
@pytest.mark.parametrize("kind", ["inextensible", "elastic"])
def test_the_geometric_laws_survive_a_drop(box, kind, controller):
    result = rise(box, kind, controller, after_drop=1.0)
    assert result.outcome == "dropped"
    assert result.metrics["after_drop"]["outcome"] in ("held", "crashed", "diverged")
    assert result.series["time"][-1] < result.metrics["outcome_time_s"] + 1.6
    assert all(np.isfinite(value).all() for value in result.series.values())


def test_a_flight_whose_last_gripper_lets_go_is_over(box):
    result = rise(box, "inextensible", "geometric", (1.1, 1.1, 1.1))
    assert result.outcome == "dropped"
    after = result.metrics["after_drop"]
    assert after is None or after["outcome"] == "lost"
    assert after is None or after["reason"].endswith("pulled off the payload")
    over = result.metrics["outcome_time_s"] if after is None else after["time_s"]
    assert result.series["time"][-1] == pytest.approx(over + 0.5, abs=0.03)
    assert not result.series["attached"][-1].any()


@pytest.mark.parametrize("controller", ["mpc", "geometric"])
def test_a_drop_before_the_payload_is_up_leaves_it_on_the_ground(box, quick, controller):
    # The ramp to 0.83 N passes 0.5 N while the payload stands; nobody pulls any more.
    suspension = SuspendedPayload.from_contacts(box, TRIANGLE, UP)
    parameters = team("elastic", 20.0, 0.5, 20.0)
    result = Flight(
        suspension,
        FlightOptions(
            controller=controller, trajectory=quick, parameters=parameters, path_limits=None
        ),
    ).run()
    s = result.series
    assert result.outcome == "dropped"
    assert result.metrics["after_drop"]["outcome"] == "held"
    assert np.ptp(s["payload_position"][:, 2]) < 0.02
    assert np.linalg.norm(np.diff(s["quadrotor_position"][-50:], axis=0), axis=2).max() < 0.1 * 0.01
    assert s["tension"][-50:].max() < 0.2


def test_a_law_without_a_smaller_team_goes_on(box):
    class Own(GeometricController):
        def for_smaller_team(self, model):
            return None

    result = rise(box, "inextensible", Own, after_drop=1.0)
    assert result.outcome == "dropped"
    assert result.metrics["after_drop"]["outcome"] in ("held", "crashed", "diverged")


def test_after_a_drop_the_same_seed_gives_the_same_flight(box):
    suspension = SuspendedPayload.from_contacts(box, TRIANGLE, UP)
    parameters = team("inextensible", 20.0, 1.1, 20.0)
    flight = Flight(
        suspension,
        FlightOptions(
            belief="true",
            trajectory=RISE,
            parameters=parameters,
            after_drop=1.0,
            path_limits=None,
        ),
    )
    first, again = flight.run(3), flight.run(3)
    for name, value in first.series.items():
        assert (value == again.series[name]).all(), name


@pytest.mark.parametrize("kind", ["inextensible", "elastic"])
def test_momentum_has_no_jump_when_a_gripper_lets_go(box, kind):
    # Momentum of all flying bodies; between two steps only thrust and weight change it.
    dt = 0.002
    parameters = team(kind, 20.0, 20.0, 20.0, noise=0.0, time_step=dt)
    station = make_transport_station(box, TRIANGLE, UP, parameters=parameters)
    plant = station.plant
    context = station.CreateDefaultContext()
    # A reference in the air makes the station start there; the thrusts are this test's own.
    flying = Flight(
        SuspendedPayload.from_contacts(box, TRIANGLE, UP),
        FlightOptions(parameters=parameters, trajectory=HoverTrajectory(), path_limits=None),
    )
    airborne = flying.station.CreateDefaultContext()
    flying.station.place(airborne, reference=flying.trajectory)
    plant.SetPositionsAndVelocities(
        plant.GetMyMutableContextFromRoot(context),
        flying.station.plant.GetPositionsAndVelocities(
            flying.station.plant.GetMyContextFromRoot(airborne)
        ),
    )
    pushes = np.array([[0.3, 0.0, 3.6], [0.0, 0.2, 3.4], [-0.2, 0.0, 3.5]])
    station.GetInputPort("attitude.thrust_vectors").FixValue(context, pushes.ravel())
    simulator = Simulator(station, context)
    mass = plant.CalcTotalMass(plant.GetMyContextFromRoot(context))
    kf = parameters.quadrotor.thrust_coefficient

    def look():
        pc = plant.GetMyContextFromRoot(context)
        momentum = mass * plant.CalcCenterOfMassTranslationalVelocityInWorld(pc)
        payload = station.GetOutputPort("payload.state").Eval(context)
        turning = station.GetOutputPort("propellers.squared_speed").Eval(context).reshape(-1, 4)
        states = station.GetOutputPort("quadrotors.state").Eval(context).reshape(-1, 13)
        axes = np.stack([RotationMatrix(_quaternion(x[:4])).matrix()[:, 2] for x in states])
        force = (kf * turning.sum(axis=1)) @ axes - [0.0, 0.0, mass * 9.81]
        tension = station.GetOutputPort("cables.tension").Eval(context)
        return momentum, force, payload, states, tension

    # Half way between two steps, so that each advance is one step.
    simulator.AdvanceTo(0.4 + 0.5 * dt)
    seen, freed = [], None
    for k in range(60):
        if k == 30:
            freed = look()
            station.cable_system.let_go(context, 1)
        seen.append(look())
        simulator.AdvanceTo(0.4 + (k + 1.5) * dt)
    assert freed is not None
    assert freed[4][1] > 0.5
    assert (station.cable_system.attached(context) == [True, False, True]).all()
    assert seen[31][4][1] < 0.1
    for before, after in pairwise(seen):
        jump = after[0] - before[0]
        assert jump == pytest.approx(dt * before[1], abs=1e-5)
    # Nor does one body jump: in the step of the release no velocity changes by more than the
    # forces on the body explain, tension included.
    pull = freed[4].sum()
    assert np.linalg.norm(seen[31][2][10:13] - seen[30][2][10:13]) < dt * (
        9.81 + 1.5 * pull / box.mass
    )
    change = np.linalg.norm(seen[31][3][:, 10:13] - seen[30][3][:, 10:13], axis=1)
    assert (change < dt * (9.81 + (4.5 + 1.5 * freed[4].max()) / 0.25)).all()
    # And the drop is felt: the freed quadrotor is pushed up by what it carried.
    gained = (seen[40][3][1, 12] - seen[31][3][1, 12]) / (9 * dt)
    assert gained == pytest.approx(freed[4][1] / 0.25, rel=0.25)


def _quaternion(q):
    from pydrake.common.eigen_geometry import Quaternion

    return Quaternion(q / np.linalg.norm(q))


def test_a_single_gripper_still_ends_the_flight(hang):
    parameters = replace(team("inextensible", 2.6), airborne_height=1.5)
    result = Flight(
        hang(),
        FlightOptions(
            controller="geometric",
            trajectory=RISE,
            parameters=parameters,
            belief="true",
            path_limits=None,
        ),
    ).run()
    assert (result.outcome, result.metrics["outcome_reason"]) == (
        "dropped",
        "the gripper was pulled off the payload",
    )
    assert result.metrics["after_drop"] is None
    assert result.series["time"][-1] == pytest.approx(
        result.metrics["outcome_time_s"] + 0.5, abs=0.03
    )
