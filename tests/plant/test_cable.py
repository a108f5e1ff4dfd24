"""Both kinds of cable against statics, momentum, energy and the pendulum."""

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder
from scipy.integrate import solve_ivp

from drake_aerial.errors import InputError
from drake_aerial.plant.cable import CableParameters, add_cable
from drake_aerial.plant.cable_forces import connect_cables
from drake_aerial.plant.cable_tensions import CableTensions
from drake_aerial.plant.elastic_step import check_elastic_step, tension_matrix
from drake_aerial.plant.gripper import Gripper, GripperParameters, add_gripper
from drake_aerial.plant.payload import TABLE_INERTIA, Payload
from drake_aerial.plant.payload_body import PayloadBody, add_payload
from drake_aerial.plant.quadrotor import QuadrotorParameters, add_quadrotor
from drake_aerial.plant.world import add_plant

G = 9.81
M_Q = QuadrotorParameters().mass
M_G = GripperParameters().mass
M_P = 0.25 + M_G
LENGTH = 0.5
KINDS = pytest.mark.parametrize("kind", ["inextensible", "elastic"])
WEIGHT = (M_Q + M_P) * G


@KINDS
def test_static_tension_is_the_weight_below(rig, kind):
    r = rig(kind, p_LC=[0.0, 0.0, 0.14], thrust=WEIGHT)
    r.place([0, 0, 2.0], [0, 0, 2.64])
    r.simulator.AdvanceTo(0.6)
    assert r.tension() == pytest.approx(M_P * G, rel=0.01)
    d = r.state("quadrotor")[6] - r.state("payload")[6] - 0.14
    assert LENGTH - 1e-5 < d < LENGTH + 6e-4
    if kind == "elastic":
        assert d - LENGTH == pytest.approx(M_P * G / CableParameters().stiffness, rel=0.01)


@KINDS
def test_pendulum_period(rig, kind):
    # Two masses on a cable, the upper one with a constant vertical thrust:
    # omega^2 = g (1 + m_payload/m_quadrotor) / l.
    r = rig(kind, thrust=WEIGHT)
    angle = np.deg2rad(4.0)
    offset = LENGTH * np.array([np.sin(angle), 0.0, np.cos(angle)])
    r.place([0, 0, 2.0], [0, 0, 2.0] + offset)
    times, swing = np.arange(0.0, 5.0, 0.004), []
    for t in times:
        r.simulator.AdvanceTo(t)
        swing.append(r.state("quadrotor")[4] - r.state("payload")[4])
    swing = np.array(swing)
    down = np.flatnonzero((swing[:-1] > 0) & (swing[1:] <= 0))
    crossings = times[down] + 0.004 * swing[down] / (swing[down] - swing[down + 1])
    assert len(crossings) >= 4
    expected = 2 * np.pi / np.sqrt(G * (1 + M_P / M_Q) / LENGTH) * (1 + angle**2 / 16)
    assert np.mean(np.diff(crossings)) == pytest.approx(expected, rel=0.01)


def test_an_inextensible_cable_that_tightens_again_ends_in_a_common_velocity(rig):
    r = rig(gravity=False)
    r.place([0, 0, 0], [0, 0, 0.45], v_quadrotor=[0, 0, 1.0])
    r.simulator.AdvanceTo(0.04)
    assert r.state("payload")[12] == pytest.approx(0.0, abs=1e-9)
    r.simulator.AdvanceTo(0.1)
    common = M_Q / (M_Q + M_P)
    assert r.state("payload")[12] == pytest.approx(common, rel=0.02)
    assert r.state("quadrotor")[12] == pytest.approx(common, rel=0.02)


@pytest.mark.parametrize("damping", [10.0, 35.0])
@pytest.mark.parametrize("p_LC", [(0.0, 0.0, 0.0), (0.12, -0.08, 0.0)])
def test_momentum_through_an_elastic_cable_that_tightens_again(rig, p_LC, damping):
    # Oracle: the stretch under spring and damper, integrated finely until the cable is slack again.
    # The cable may tighten anywhere within the plant's step of 2 ms.
    k = CableParameters().stiffness
    x, y, _ = p_LC
    # The gripper's 2 g shift the centre of mass and add to the inertia by less than 1 %.
    mu = 1.0 / (1.0 / M_Q + 1.0 / M_P + y**2 / TABLE_INERTIA[0] + x**2 / TABLE_INERTIA[1])

    def slack(t, x):
        return k * x[0] + damping * x[1]

    slack.terminal, slack.direction = True, -1
    bounce = solve_ivp(
        lambda t, x: [x[1], -max(0.0, slack(t, x)) / mu],
        (0, 0.2),
        [0.0, 1.0],
        events=slack,
        rtol=1e-9,
        atol=1e-12,
    )
    transferred = mu * (1.0 - bounce.y[1, -1])
    r = rig("elastic", p_LC=p_LC, gravity=False, damping=damping)
    taken = []
    for phase in np.linspace(0.0, 1.0, 8, endpoint=False):
        r.root.SetTime(0.0)
        r.place([0, 0, 0], [x, y, 0.45 + 0.002 * phase], v_quadrotor=[0, 0, 1.0])
        r.simulator.AdvanceTo(0.04)
        assert r.state("payload")[12] == pytest.approx(0.0, abs=1e-12)
        r.simulator.AdvanceTo(0.1)
        taken.append(M_Q * (1.0 - r.state("quadrotor")[12]))
        total = r.plant.CalcSpatialMomentumInWorldAboutPoint(r.context, np.zeros(3)).translational()
        # The gripper's 2 g shift the centre of mass; the step keeps the momentum of a rotating
        # payload to second order.
        assert total == pytest.approx([0, 0, M_Q], abs=1e-5 if any(p_LC) else 1e-9)
    assert taken == pytest.approx([transferred] * 8, rel=0.02)


@KINDS
def test_a_slack_cable_exerts_nothing(rig, kind):
    r = rig(kind, p_LC=[0.2, 0.1, 0.14], thrust=M_Q * G)
    r.place([0, 0, 5.0], [0.1, 0.1, 5.3], rpy=[0.0, 0.0, 0.3], w=[0.3, -0.2, 0.4])
    before = r.state("payload")
    r.simulator.AdvanceTo(0.15)
    after = r.state("payload")
    assert r.tension() < 0.01
    # The gripper's 2 g are off the centre of mass: their common centre falls freely and L rotates
    # about it.
    assert after[10:13] - before[10:13] == pytest.approx([0, 0, -G * 0.15], abs=0.003)
    assert r.state("quadrotor")[10:13] == pytest.approx([0, 0, 0], abs=0.002)
    assert np.linalg.norm(r.state("quadrotor")[7:10]) < 0.05


@KINDS
def test_no_energy_without_thrust(rig, kind):
    r = rig(kind, p_LC=[0.3, 0.25, 0.14], gravity=False)
    r.place([0, 0, 0], [0.3, 0.25, 0.44], v_quadrotor=[0.8, -0.3, 0.5], w=[0.7, 1.0, -1.5])
    energies = []
    for t in np.arange(0.0, 3.0, 0.02):
        r.simulator.AdvanceTo(t)
        energies.append(r.plant.CalcKineticEnergy(r.context))
    assert max(energies) <= energies[0] * 1.002
    assert energies[-1] < 0.95 * energies[0]  # it did tighten, and lost some


@KINDS
def test_the_start_has_no_transient(rig, kind):
    # A tilted quadrotor beside its contact, the cable slanted and taut: no body may jump.
    r = rig(kind, p_LC=[0.1, 0.05, 0.14], gravity=False)
    direction = np.array([0.3, -0.2, 0.93])
    p_Q = np.array([0.1, 0.05, 1.14]) + LENGTH * direction / np.linalg.norm(direction)
    r.place([0, 0, 1.0], p_Q, rpy=[0.3, -0.4, 0.7])
    r.simulator.AdvanceTo(0.1)
    for what, start in (("payload", [0, 0, 1.0]), ("quadrotor", p_Q)):
        state = r.state(what)
        assert state[4:7] == pytest.approx(start, abs=1e-6)
        assert np.abs(state[7:]).max() < 1e-5
    gripper = r.plant.EvalBodyPoseInWorld(r.context, r.gripper.body).translation()
    assert gripper == pytest.approx([0.1, 0.05, 1.14], abs=1e-6)


def test_a_cable_that_is_too_short_is_refused(rig):
    r = rig()
    with pytest.raises(InputError, match=r"in \(0, 0\.5\] m.*got 0\.6 m"):
        r.place([0, 0, 0], [0, 0, 0.6])


def test_elastic_step_numbers():
    contacts = np.array([[-0.154, -0.267, 0.011], [0.308, 0.0, 0.011], [-0.154, 0.267, 0.011]])
    d = tension_matrix(
        np.full(3, 0.25), 0.25, np.diag(TABLE_INERTIA), contacts, np.tile([0.0, 0.0, -1.0], (3, 1))
    )
    largest = float(np.linalg.eigvalsh(d).max())
    assert check_elastic_step(CableParameters("elastic"), 0.002, largest) == pytest.approx(
        1.7, abs=0.05
    )
    stiff = CableParameters("elastic", damping=35.0)
    with pytest.raises(InputError, match=r"below 2, got 4\.[45].*`damping` below") as refused:
        check_elastic_step(stiff, 0.002, largest)
    admissible = float(str(refused.value).split("`damping` below ")[1].split()[0])
    check_elastic_step(CableParameters("elastic", damping=0.99 * admissible), 0.002, largest)
    with pytest.raises(InputError):
        check_elastic_step(CableParameters("elastic", damping=1.01 * admissible), 0.002, largest)


def test_the_world_body_is_refused():
    plant, _ = add_plant(DiagramBuilder())
    body = add_payload(plant, Payload.from_box([0.2, 0.2, 0.2]))
    world = PayloadBody(body.payload, plant.world_body(), body.model_instance, 0.0, True)
    quadrotor, gripper = add_quadrotor(plant), add_gripper(plant, body, [0, 0, 0.1])
    fixed = Gripper(
        gripper.parameters,
        world,
        gripper.p_LC,
        gripper.normal_L,
        gripper.body,
        gripper.model_instance,
    )
    for kind in ("inextensible", "elastic"):
        with pytest.raises(InputError, match="welded to the world"):
            add_cable(plant, quadrotor, fixed, CableParameters(kind))


@pytest.mark.parametrize(
    "bad",
    [{"kind": "rope"}, {"length": 0.0}, {"length": np.nan}, {"stiffness": -1.0}, {"damping": -0.1}],
)
def test_bad_parameters_are_refused(bad):
    with pytest.raises(InputError, match=str(next(iter(bad)))):
        CableParameters(**bad)


def test_mixed_kinds_are_refused(rig):
    r = rig()
    other = rig("elastic")
    with pytest.raises(InputError, match="elastic and inextensible"):
        connect_cables(None, r.plant, [r.cable, other.cable], None, None)
    assert isinstance(r.cables.system, CableTensions)


@KINDS
def test_parts_are_at_rest_in_a_new_context(rig, kind):
    # Nothing is placed: the box stands on the ground and the quadrotor hovers above its contact.
    r = rig(kind, p_LC=[0.1, 0.05, 0.14], thrust=M_Q * G, ground=True)
    r.simulator.AdvanceTo(0.3)
    payload, quadrotor = r.state("payload"), r.state("quadrotor")
    assert payload[4:7] == pytest.approx([0.0, 0.0, 0.14], abs=1e-3)
    assert np.abs(payload[7:]).max() < 0.01
    assert quadrotor[4:7] == pytest.approx([0.1, 0.05, 0.28 + 0.9 * LENGTH], abs=2e-3)
    assert r.tension() < 0.01
