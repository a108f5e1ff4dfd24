"""The station: ports, errors, its start at rest, and the controller's model against its plant."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialVelocity
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_aerial.dynamics.payload_model import PayloadState, derivative
from drake_aerial.errors import InputError
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.gripper import GripperParameters
from drake_aerial.plant.payload import Payload
from drake_aerial.simulation.beliefs import believed_model
from drake_aerial.simulation.station import make_transport_station
from drake_aerial.simulation.station_parameters import StationParameters

TRIANGLE = np.array([[-0.154, -0.267, 0.14], [0.308, 0.0, 0.14], [-0.154, 0.267, 0.14]])


def test_ports_are_named_by_instance(hang):
    s = hang()
    station = make_transport_station(s.payload, s.p_LC, s.normal_L)
    names = {station.get_output_port(i).get_name() for i in range(station.num_output_ports())}
    assert {"payload.state", "quadrotors.state", "cables.tension", "propellers.command"} <= names
    assert {
        "perception.payload_state",
        "perception.cable_directions",
        "plant.contact_results",
    } <= names
    assert [station.get_input_port(i).get_name() for i in range(station.num_input_ports())] == [
        "attitude.thrust_vectors"
    ]


def test_too_heavy_a_payload_is_refused_with_both_numbers():
    heavy = Payload.from_box([0.3, 0.3, 0.3], 0.5)
    with pytest.raises(InputError, match=r"7\.38 N.*0\.5 kg.*7\.07 N"):
        make_transport_station(heavy, [[0, 0, 0.15]])
    make_transport_station(heavy, TRIANGLE / 2)


def test_an_unstable_elastic_step_is_refused(box):
    stiff = StationParameters(cable=CableParameters("elastic", damping=35.0))
    with pytest.raises(InputError, match="`damping` below"):
        make_transport_station(box, TRIANGLE, parameters=stiff)
    soft = replace(stiff, cable=CableParameters("elastic"))
    make_transport_station(box, TRIANGLE, parameters=soft)


@pytest.mark.parametrize(
    "bad",
    [
        {"time_step": 0.0},
        {"time_step": 0.1},
        {"initial_slack": 0.6},
        {"noise": -1.0},
        {"attitude_period": 1e-3},
    ],
)
def test_bad_parameters_are_refused(box, bad):
    with pytest.raises(InputError):
        make_transport_station(box, [[0, 0, 0.14]], parameters=StationParameters(**bad))


@pytest.mark.parametrize(
    ("contacts", "words"),
    [
        (np.zeros((0, 3)), r"`p_LC` must have the shape \(n, 3\), n > 0, got \(0, 3\)"),
        (np.zeros((3, 2)), r"`p_LC` must have the shape \(n, 3\), n > 0, got \(3, 2\)"),
        (np.zeros((1, 2, 3)), r"`p_LC` must have the shape \(n, 3\)"),
        ([[0.0, 0.0, np.nan]], "`p_LC` must be finite"),
        ("top", "`p_LC` must be an array"),
    ],
)
def test_contacts_that_are_no_points_are_refused(box, contacts, words):
    with pytest.raises(InputError, match=words):
        make_transport_station(box, contacts)


@pytest.mark.parametrize(
    ("normals", "words"),
    [
        (np.zeros((2, 3)), r"`normal_L` must be \(3,\) or \(3, 3\), one per contact, got \(2, 3\)"),
        ([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]], "`normal_L` must not be zero"),
        ([0.0, 0.0, np.inf], "`normal_L` must be finite"),
        ([0.0, 1.0], "`normal_L` must have the shape"),
    ],
)
def test_normals_that_are_no_directions_are_refused(box, normals, words):
    with pytest.raises(InputError, match=words):
        make_transport_station(box, TRIANGLE, normals)


@pytest.mark.parametrize(
    ("contact", "words"),
    [
        ([0.0, 0.0, 0.94], r"contact 2 of 2 must be at most 2 cm .* got 80\.0 cm"),
        ([0.0, 0.0, 0.0], r"got 14\.0 cm"),
        ([0.0, 0.0, 0.161], r"got 2\.1 cm"),
    ],
)
def test_a_contact_off_the_surface_is_refused(box, contact, words):
    with pytest.raises(InputError, match=words):
        make_transport_station(box, [[0.2, 0.0, 0.14], contact])


def test_a_contact_near_the_surface_is_accepted(box):
    make_transport_station(box, [[0.0, 0.0, 0.159]])
    make_transport_station(box, [0.0, 0.0, 0.121])


def test_contacts_inside_the_hull_of_a_scan_are_accepted_and_outside_are_not():
    # A scan of a U: two walls on a floor. Its hull is a box, and the floor is inside of it.
    u, v = np.meshgrid(np.linspace(-0.3, 0.3, 25), np.linspace(-0.2, 0.2, 17))
    floor = np.column_stack([u.ravel(), v.ravel(), np.zeros(u.size)])
    wall = np.column_stack([np.full(u.size, 0.3), v.ravel(), 0.5 * (u.ravel() + 0.3)])
    scan = np.vstack([floor, wall, wall * [-1.0, 1.0, 1.0]]) - [0.0, 0.0, 0.1]
    payload = Payload.from_cloud(scan)
    make_transport_station(payload, [[0.0, 0.0, -0.1]])
    make_transport_station(payload, [[0.0, 0.0, 0.0]])
    with pytest.raises(InputError, match=r"got 10\.0 cm"):
        make_transport_station(payload, [[0.0, 0.0, 0.3]])


@pytest.mark.parametrize("size", [None, 6])
def test_a_controller_without_a_thrust_for_each_quadrotor_is_refused(box, size):
    class Other(LeafSystem):
        def __init__(self):
            super().__init__()
            if size is not None:
                self.DeclareVectorOutputPort("thrust_vectors", size, lambda context, output: None)

    with pytest.raises(InputError, match="output port thrust_vectors of size 9"):
        make_transport_station(box, TRIANGLE, controller=Other())
    with pytest.raises(InputError, match="`controller` must be a System, got a str"):
        make_transport_station(box, TRIANGLE, controller="mpc")


def test_wrong_types_are_refused():
    with pytest.raises(InputError, match="`payload` must be a Payload, got a str"):
        make_transport_station("bunny", TRIANGLE)
    with pytest.raises(InputError, match="`parameters` must be a StationParameters or None"):
        make_transport_station(Payload.from_box([0.4, 0.4, 0.2]), TRIANGLE, parameters={})


@pytest.mark.parametrize("kind", ["inextensible", "elastic"])
def test_an_overloaded_gripper_lets_go_in_a_diagram_that_holds_a_station(kind):
    # A quadrotor that holds its height carries 0.25 kg by a gripper of 1 N; nobody lifts it.
    box = Payload.from_box([0.4, 0.4, 0.2], 0.25)
    parameters = StationParameters(
        cable=CableParameters(kind), gripper=GripperParameters(holding_force=1.0)
    )
    builder = DiagramBuilder()
    station = builder.AddSystem(make_transport_station(box, [[0, 0, 0.1]], parameters=parameters))
    builder.ExportInput(station.GetInputPort("attitude.thrust_vectors"), "thrusts")
    simulator = Simulator(builder.Build())
    station.install(simulator)
    root = simulator.get_mutable_context()
    simulator.get_system().GetInputPort("thrusts").FixValue(root, [0.0, 0.0, 0.502 * 9.81])
    plant = station.plant
    context = plant.GetMyMutableContextFromRoot(root)
    for body, height in ((station.payload_body.body, 2.0), (station.quadrotors[0].body, 2.6)):
        plant.SetFreeBodyPose(context, body, RigidTransform([0.0, 0.0, height]))
    station.cables[0].place(plant, context)
    own = station.GetMyContextFromRoot(root)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulator.AdvanceTo(0.1)
        before = station.GetOutputPort("payload.state").Eval(own)[12]
        simulator.AdvanceTo(0.3)
    assert station.GetOutputPort("cables.attached").Eval(own) == [0.0]
    after = station.GetOutputPort("payload.state").Eval(own)[12]
    assert (after - before) / 0.2 == pytest.approx(-9.81, abs=1e-6)


@pytest.mark.parametrize("kind", ["inextensible", "elastic"])
@pytest.mark.parametrize("contacts", [TRIANGLE[1:2], TRIANGLE], ids=["one", "three"])
@pytest.mark.parametrize("seed", [0, 1])
def test_the_controllers_model_agrees_with_the_plant(box, kind, contacts, seed):
    # A random taut state in the air, thrusts along the quadrotors' axes; accelerations from very
    # short steps.
    rng = np.random.default_rng(seed)
    dt = 2e-5
    parameters = StationParameters(cable=CableParameters(kind, damping=0.0), time_step=dt)
    station = make_transport_station(box, contacts, parameters=parameters)
    model = believed_model(
        "true",
        box,
        contacts,
        quadrotors=[parameters.quadrotor] * len(contacts),
        cable=parameters.cable,
        gripper=parameters.gripper,
    )
    n, l = len(contacts), parameters.cable.length
    context = station.CreateDefaultContext()
    plant, pc = station.plant, station.plant.GetMyMutableContextFromRoot(context)
    X_WL = RigidTransform(RollPitchYaw(rng.uniform(-0.3, 0.3, 3)), [0.0, 0.0, 3.0])
    R = X_WL.rotation().matrix()
    w_L, v_L = rng.uniform(-0.5, 0.5, 3), rng.uniform(-0.5, 0.5, 3)
    xi = np.array([0.0, 0.0, -1.0]) + rng.uniform(-0.2, 0.2, (n, 3))
    xi /= np.linalg.norm(xi, axis=1, keepdims=True)
    w = np.cross(xi, rng.uniform(-0.5, 0.5, (n, 3)))
    thrust = rng.uniform(4.0, 6.0, n)
    plant.SetFreeBodyPose(pc, station.payload_body.body, X_WL)
    plant.SetFreeBodySpatialVelocity(pc, station.payload_body.body, SpatialVelocity(w_L, v_L))
    F = np.empty((n, 3))
    for i, quadrotor in enumerate(station.quadrotors):
        R_WQ = RollPitchYaw(*rng.uniform(-0.2, 0.2, 2), 0.0).ToRotationMatrix()
        p_C, v_C = X_WL @ contacts[i], v_L + np.cross(w_L, R @ contacts[i])
        plant.SetFreeBodyPose(pc, quadrotor.body, RigidTransform(R_WQ, p_C - l * xi[i]))
        v_Q = v_C - l * np.cross(w[i], xi[i])
        plant.SetFreeBodySpatialVelocity(pc, quadrotor.body, SpatialVelocity(np.zeros(3), v_Q))
        F[i] = thrust[i] * R_WQ.matrix()[:, 2]
        station.cables[i].place(plant, pc)
    com = model.p_LLcm
    state = PayloadState(
        (X_WL @ com)[None],
        (v_L + np.cross(w_L, R @ com))[None],
        R[None],
        (R.T @ w_L)[None],
        xi[None],
        w[None],
        F[None],
    )
    expected = derivative(model, state, F[None])
    if kind == "elastic":
        # Stretched as far as gives the model's tension.
        k = parameters.cable.stiffness
        for i, quadrotor in enumerate(station.quadrotors):
            X_WQ = plant.EvalBodyPoseInWorld(pc, quadrotor.body)
            p = X_WQ.translation() - xi[i] * expected.tension[0, i] / k
            plant.SetFreeBodyPose(pc, quadrotor.body, RigidTransform(X_WQ.rotation(), p))
    station.GetInputPort("attitude.thrust_vectors").FixValue(context, F.ravel())
    # The solver's regularised constraints take some steps (0.2 ms here) to carry the full load.
    simulator = Simulator(station, context)
    simulator.AdvanceTo(10 * dt)
    tension = station.GetOutputPort("cables.tension").Eval(context)
    before = station.GetOutputPort("payload.state").Eval(context).copy()
    simulator.AdvanceTo(30 * dt)
    change = (station.GetOutputPort("payload.state").Eval(context) - before) / (20 * dt)
    assert tension == pytest.approx(expected.tension[0], rel=0.005)
    dw_W, arm = change[7:10], R @ com
    assert dw_W == pytest.approx(R @ expected.dW[0], abs=0.01 * np.abs(expected.dW).max())
    a_com = change[10:13] + np.cross(dw_W, arm) + np.cross(w_L, np.cross(w_L, arm))
    assert a_com == pytest.approx(expected.a[0], abs=0.01 * 9.81)


def test_propeller_commands_may_be_held(hang):
    s = hang()
    parameters = StationParameters(attitude_period=0.01, noise=0.0, time_step=0.002)
    station = make_transport_station(s.payload, s.p_LC, s.normal_L, parameters=parameters)
    context = station.CreateDefaultContext()
    station.place(context)
    # A command for a turn: the moment follows the attitude, so commands would change every step.
    station.GetInputPort("attitude.thrust_vectors").FixValue(context, [0.5, 0.0, 3.0])
    commands = station.GetOutputPort("propellers.command")
    hover = 0.25 * 9.81 / (4 * parameters.quadrotor.thrust_coefficient)
    assert commands.Eval(context) == pytest.approx(np.full(4, hover))
    simulator, seen = Simulator(station, context), []
    for k in range(16):
        simulator.AdvanceTo(2e-3 * k + 1e-3)
        seen.append(commands.Eval(context).copy())
    changes = [k for k in range(1, 16) if (seen[k] != seen[k - 1]).any()]
    assert changes == [2, 7, 12]
    assert np.ptp(seen[2]) > 0.01 * hover


def test_a_station_starts_at_rest_and_serves_many_contexts(hang, quick):
    s = hang(0.1, 0.1)
    station = make_transport_station(s.payload, s.p_LC, s.normal_L)
    for seed in (0, 1):
        context = station.CreateDefaultContext()
        station.place(context, seed=seed)
        hover = [0.0, 0.0, 0.25 * 9.81]
        station.GetInputPort("attitude.thrust_vectors").FixValue(context, hover)
        simulator = Simulator(station, context)
        simulator.AdvanceTo(0.5)
        payload = station.GetOutputPort("payload.state").Eval(context)
        quadrotor = station.GetOutputPort("quadrotors.state").Eval(context)
        assert payload[4:7] == pytest.approx([0, 0, station.payload_body.rest_height], abs=1e-4)
        assert quadrotor[4:7] == pytest.approx(payload[4:7] + s.p_LC[0] + [0, 0, 0.45], abs=3e-3)
        times, states = station.log(context, "payload.state")
        assert len(times) == len(states) == 51
    with pytest.raises(InputError, match=r"payload\.state"):
        station.log(context, "payload")
