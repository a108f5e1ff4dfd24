"""Overloaded grippers in a user's own diagram: with `install` they let go, without it they warn."""

import warnings

import numpy as np
import pytest
from pydrake.systems.framework import EventStatus

G = 9.81
WEIGHT = (0.25 + 0.25 + 0.002) * G
BELOW = 0.252 * G
KINDS = pytest.mark.parametrize("kind", ["inextensible", "elastic"])


@pytest.fixture
def hanging(rig):
    """One quadrotor holds a box of 0.25 kg by a gripper, with the thrust that carries both."""

    def make(kind="inextensible", monitor=None, **options):
        options = {"holding_force": 1.0, **options}
        r = rig(kind, p_LC=[0, 0, 0.14], thrust=WEIGHT, monitor=monitor, **options)
        # An elastic cable starts as stretched as it is in equilibrium.
        stretch = BELOW / 5e3 if kind == "elastic" else 0.0
        r.place([0, 0, 3.0], [0, 0, 3.64 + stretch])
        return r

    return make


def velocity(r):
    return r.state("payload")[10:13].copy()


@KINDS
def test_an_overloaded_gripper_lets_go_and_the_payload_falls_freely(hanging, kind):
    r = hanging(kind)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        r.simulator.AdvanceTo(0.1)
        before = velocity(r)
        r.simulator.AdvanceTo(0.4)
    assert not r.cables.attached(r.root)[0]
    assert (velocity(r) - before) / 0.3 == pytest.approx([0.0, 0.0, -G], abs=1e-6)
    port = r.cables.attached_port
    assert port.Eval(port.get_system().GetMyContextFromRoot(r.root)) == [0.0]


def test_without_install_one_warning_says_that_the_gripper_stays_attached(hanging):
    r = hanging(install=False)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        r.simulator.AdvanceTo(0.5)
    assert [w.category for w in caught] == [RuntimeWarning]
    message = str(caught[0].message)
    assert message.startswith("gripper 1 of 1 is pulled by more than its holding force of 1 N")
    assert "install(simulator)" in message
    assert r.cables.attached(r.root)[0]
    assert r.tension() == pytest.approx(BELOW, rel=0.01)


def test_a_new_context_warns_again(hanging):
    r = hanging(install=False)
    with pytest.warns(RuntimeWarning, match="stays attached"):
        r.simulator.AdvanceTo(0.1)
    diagram = r.simulator.get_system()
    diagram.SetDefaultContext(r.root)
    r.place([0, 0, 3.0], [0, 0, 3.64])
    with pytest.warns(RuntimeWarning, match="stays attached"):
        r.simulator.AdvanceTo(0.1)


def test_the_warning_can_be_an_error(hanging):
    r = hanging(install=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(RuntimeWarning, match="stays attached"):
            r.simulator.AdvanceTo(0.5)


@pytest.mark.parametrize(
    "options", [{"holding_force": 4.0}, {"normal": (1, 0, 0)}, {"holding_force": np.inf}]
)
def test_a_gripper_within_its_holding_force_does_not_warn(hanging, options):
    r = hanging(install=False, **options)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        r.simulator.AdvanceTo(0.5)
    assert r.cables.attached(r.root)[0]


@KINDS
def test_a_monitor_that_was_set_before_is_called_too_and_may_end_the_simulation(hanging, kind):
    times = []

    def monitor(context):
        times.append(context.get_time())
        if context.get_time() >= 0.2 - 1e-9:
            return EventStatus.ReachedTermination(r.plant, "enough")
        return EventStatus.DidNothing()

    r = hanging(kind, monitor=monitor)
    status = r.simulator.AdvanceTo(1.0)
    assert "enough" in status.FormatMessage()
    assert r.root.get_time() == pytest.approx(0.2)
    assert len(times) >= 40
    assert not r.cables.attached(r.root)[0]


def test_installed_twice_it_still_lets_go_once(hanging):
    r = hanging()
    r.cables.install(r.simulator)
    r.simulator.AdvanceTo(0.2)
    before = velocity(r)
    r.simulator.AdvanceTo(0.3)
    assert velocity(r)[2] - before[2] == pytest.approx(-0.1 * G, abs=1e-6)


def test_a_gripper_that_let_go_holds_again_in_a_default_context(hanging):
    r = hanging()
    r.simulator.AdvanceTo(0.2)
    assert not r.cables.attached(r.root)[0]
    assert not r.plant.GetConstraintActiveStatus(r.context, r.cable.grip)
    r.simulator.get_system().SetDefaultContext(r.root)
    assert r.cables.attached(r.root)[0]
    assert r.plant.GetConstraintActiveStatus(r.context, r.cable.grip)
