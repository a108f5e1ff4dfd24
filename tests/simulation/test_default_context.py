"""A new context is at rest: it can be simulated as it is, at random, and in Monte Carlo runs."""

import numpy as np
import pytest
from pydrake.common import RandomGenerator
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.systems.analysis import MonteCarloSimulation, RandomSimulation, Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_aerial.control.geometric import GeometricController
from drake_aerial.control.mpc.payload_mpc import PayloadMpc
from drake_aerial.plant.cable import CableParameters
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.simulation.beliefs import believed_model
from drake_aerial.simulation.station import make_transport_station
from drake_aerial.simulation.station_parameters import StationParameters

TRIANGLE = np.array([[-0.154, -0.267, 0.14], [0.308, 0.0, 0.14], [-0.154, 0.267, 0.14]])
MIDDLE = np.array([[0.0, 0.0, 0.14]])
CONTACTS = pytest.mark.parametrize("contacts", [MIDDLE, TRIANGLE], ids=["one", "three"])
KINDS = pytest.mark.parametrize("kind", ["inextensible", "elastic"])
HEIGHT = 0.14  # of the box's middle on the ground [m]
# On the ground for longer than the tests simulate.
WAITING = HoverTrajectory(ground_time=2.0, lift_time=1.0, lift_height=0.5, hover_time=1.0)


@pytest.fixture
def station(box):
    def make(kind, contacts, controller=None, **parameters):
        parameters = StationParameters(cable=CableParameters(kind), **parameters)
        n = len(contacts)
        if controller is not None:
            model = believed_model(
                "true",
                box,
                contacts,
                quadrotors=parameters.quadrotors(n),
                cable=parameters.cable,
                gripper=parameters.gripper,
            )
            controller = controller(model)
        return make_transport_station(box, contacts, controller=controller, parameters=parameters)

    return make


def fix_inputs(station, context):
    """Hover thrusts without a controller, a reference with one."""
    if station.controller is None:
        hover = np.tile([0.0, 0.0, 0.25 * 9.81], station.n)
        station.GetInputPort("attitude.thrust_vectors").FixValue(context, hover)
    else:
        moved = WAITING.starting_at([0.0, 0.0, HEIGHT])
        port = station.GetInputPort("controller.reference")
        port.FixValue(context, AbstractValue.Make(moved))


def look(station, context):
    payload = station.GetOutputPort("payload.state").Eval(context)
    quadrotors = station.GetOutputPort("quadrotors.state").Eval(context).reshape(-1, 13)
    return payload, quadrotors


def assert_on_the_ground(station, context, contacts):
    payload, quadrotors = look(station, context)
    assert np.isfinite(payload).all()
    assert payload[4:7] == pytest.approx([0.0, 0.0, HEIGHT], abs=2e-3)
    assert payload[:4] == pytest.approx([1.0, 0.0, 0.0, 0.0], abs=2e-3)
    assert np.abs(payload[7:]).max() < 0.02
    # Each quadrotor is in the air above its contact, at most a cable's length and a little away.
    above = quadrotors[:, 4:7] - payload[4:7] - contacts
    assert np.abs(above[:, :2]).max() < 0.02
    assert (above[:, 2] > 0.4).all()
    assert (above[:, 2] < 0.502).all()


@KINDS
@CONTACTS
@pytest.mark.parametrize("controller", [None, PayloadMpc])
@pytest.mark.parametrize("random", [False, True], ids=["default", "random"])
def test_a_new_context_stays_at_rest_for_a_second(station, kind, contacts, controller, random):
    s = station(kind, contacts, controller)
    context = s.CreateDefaultContext()
    if random:
        s.SetRandomContext(context, RandomGenerator(7))
    fix_inputs(s, context)
    Simulator(s, context).AdvanceTo(1.0)
    assert_on_the_ground(s, context, contacts)


@KINDS
def test_a_new_context_is_where_place_puts_a_trial_on_the_ground(station, kind):
    s = station(kind, TRIANGLE, initial_slack=0.02)
    new, placed = s.CreateDefaultContext(), s.CreateDefaultContext()
    s.place(placed)
    states = [
        s.plant.GetPositionsAndVelocities(s.plant.GetMyContextFromRoot(context))
        for context in (new, placed)
    ]
    assert states[0] == pytest.approx(states[1], abs=1e-12)
    assert look(s, new)[1][:, 6] - HEIGHT - 0.14 == pytest.approx([0.48] * 3, abs=1e-3)


def test_slow_motors_held_commands_and_wind_start_at_rest_too(station):
    s = station("inextensible", TRIANGLE, motor_lag=0.03, attitude_period=0.01)
    context = s.CreateDefaultContext()
    fix_inputs(s, context)
    Simulator(s, context).AdvanceTo(1.0)
    assert_on_the_ground(s, context, TRIANGLE)


def test_a_copy_of_a_new_context_flies_on_like_the_context(station):
    s = station("inextensible", TRIANGLE, GeometricController)
    context = s.CreateDefaultContext()
    fix_inputs(s, context)
    copies = [context.Clone(), context]
    for copy in copies:
        Simulator(s, copy).AdvanceTo(0.2)
    assert (look(s, copies[0])[0] == look(s, copies[1])[0]).all()
    assert_on_the_ground(s, context, TRIANGLE)


@KINDS
def test_monte_carlo_runs_of_a_diagram_that_holds_a_station_end_on_the_ground(station, kind):
    # Drake's tools set a random context after the simulator has been made.
    s = station(kind, TRIANGLE[:1])
    builder = DiagramBuilder()
    builder.AddSystem(s)
    builder.ExportInput(s.GetInputPort("attitude.thrust_vectors"), "thrusts")
    diagram = builder.Build()

    def make_simulator(generator):
        simulator = Simulator(diagram)
        diagram.GetInputPort("thrusts").FixValue(
            simulator.get_mutable_context(), [0.0, 0.0, 0.25 * 9.81]
        )
        s.install(simulator)
        return simulator

    def height(system, context):
        return s.GetOutputPort("payload.state").Eval(s.GetMyContextFromRoot(context))[6]

    one = RandomSimulation(make_simulator, height, 0.5, RandomGenerator(1))
    assert one == pytest.approx(HEIGHT, abs=2e-3)
    results = MonteCarloSimulation(make_simulator, height, 0.5, 2, RandomGenerator(2))
    assert [r.output for r in results] == pytest.approx([HEIGHT] * 2, abs=2e-3)


def test_a_default_pose_of_the_users_own_moves_the_whole_team(station):
    s = station("inextensible", TRIANGLE)
    X_WL = RigidTransform([1.0, 2.0, HEIGHT])
    s.plant.SetDefaultFloatingBaseBodyPose(s.payload_body.body, X_WL)
    for cable in s.cables:
        cable.set_default_pose(s.plant, 0.05)
    context = s.CreateDefaultContext()
    fix_inputs(s, context)
    Simulator(s, context).AdvanceTo(0.5)
    payload, quadrotors = look(s, context)
    assert payload[4:7] == pytest.approx([1.0, 2.0, HEIGHT], abs=2e-3)
    assert quadrotors[:, 4:6] == pytest.approx(TRIANGLE[:, :2] + [1.0, 2.0], abs=0.01)
