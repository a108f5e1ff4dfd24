"""Gripper losses. The oracles are statics, and a controller of the smaller team."""

import numpy as np
import pytest

from drake_aerial.control.geometric import GeometricController
from drake_aerial.control.gripper_loss import GripperLosses
from drake_aerial.control.mpc.payload_mpc import PayloadMpc
from drake_aerial.dynamics.payload_model import PayloadState
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.references.trajectory import HoverTrajectory
from tests.control.control_steps import control_step, first_command, fix_inputs

G = 9.81
HOVER = HoverTrajectory()
INERTIA = np.diag([0.011, 0.012, 0.0107])
# The outer two are in line with the centre of mass: without the middle one they carry half each.
ROW = PayloadModelParameters(
    mass=0.25,
    inertia=INERTIA,
    p_LC=[[-0.3, 0.0, 0.1], [0.1, 0.0, 0.1], [0.3, 0.0, 0.1]],
    quadrotor_mass=[0.25, 0.3, 0.2],
    cable_length=[0.5, 0.4, 0.6],
)


def rest(model, p=(0.0, 0.0, 0.0)):
    n = model.n
    down = np.tile([0.0, 0.0, -1.0], (n, 1))
    zero, thrust = np.zeros((1, n, 3)), np.zeros((n, 3))
    thrust[:, 2] = G * (model.quadrotor_mass + model.mass / n)
    return PayloadState(
        np.array([p]),
        np.zeros((1, 3)),
        np.eye(3)[None],
        np.zeros((1, 3)),
        down[None],
        zero,
        thrust[None],
    )


@pytest.mark.parametrize("law", [PayloadMpc, GeometricController])
def test_after_a_loss_statics_holds(law):
    controller = law(ROW)
    context = controller.CreateDefaultContext()
    fix_inputs(controller, context, ROW, rest(ROW, (0.4, -0.2, 1.0)), HOVER)
    controller.GetInputPort("attached").FixValue(context, [1.0, 1.0, 1.0])
    control_step(controller, context)
    controller.GetInputPort("attached").FixValue(context, [1.0, 0.0, 1.0])
    # The reference at the origin is far; the remaining team holds the payload where it is.
    for _ in range(20):
        thrust = control_step(controller, context)
    up = np.array([[0.0, 0.0, 1.0]])
    assert thrust[[0, 2]] == pytest.approx(G * (np.array([[0.25], [0.2]]) + 0.125) * up, abs=0.01)
    # The freed one accelerates up: the take-off's gain on an error limited to 0.15 m.
    assert thrust[1] == pytest.approx([0.0, 0.0, 0.3 * (G + 10.0 * 0.15)], abs=1e-6)


@pytest.mark.parametrize("law", [PayloadMpc, GeometricController])
def test_the_remaining_quadrotors_fly_as_a_smaller_team(law):
    kept = [0, 2]
    rng = np.random.default_rng(4)
    x = rest(ROW)
    x = x._replace(v=rng.uniform(-0.2, 0.2, (1, 3)), W=rng.uniform(-0.2, 0.2, (1, 3)))
    controller = law(ROW)
    context = controller.CreateDefaultContext()
    fix_inputs(controller, context, ROW, x, HOVER)
    controller.GetInputPort("attached").FixValue(context, [1.0, 1.0, 1.0])
    before = control_step(controller, context)
    controller.GetInputPort("attached").FixValue(context, [1.0, 0.0, 1.0])
    thrust = control_step(controller, context)
    two = ROW.carried_by(kept)
    assert two.p_LC == pytest.approx(ROW.p_LC[kept])
    fields = {name: getattr(x, name)[:, kept] for name in ("xi", "w", "F")}
    small, alone = law(two), None
    alone = small.CreateDefaultContext()
    fix_inputs(small, alone, two, x._replace(**fields), HOVER)
    alone.get_mutable_discrete_state(small._thrust_index).SetFromVector(before[kept].ravel())
    assert thrust[kept] == pytest.approx(control_step(small, alone), abs=1e-6)


def test_without_the_port_nothing_changes():
    x = rest(ROW)
    controller = PayloadMpc(ROW)
    context = controller.CreateDefaultContext()
    fix_inputs(controller, context, ROW, x, HOVER)
    controller.GetInputPort("attached").FixValue(context, np.ones(3))
    assert (
        control_step(controller, context) == first_command(PayloadMpc(ROW), ROW, x, HOVER)
    ).all()


def test_losses_come_back_from_memory_and_only_grow():
    losses = GripperLosses(
        np.array([False, True, False]), np.arange(9.0).reshape(3, 3), np.array([1.0, 2.0, 3.0])
    )
    again = GripperLosses.unpack(losses.pack())
    assert (again.lost == losses.lost).all()
    assert (again.p_WQ == losses.p_WQ).all()
    assert (again.p_WL == losses.p_WL).all()
    assert again.updated(np.array([True, True, True]), True, None, np.ones(3)) is again
    assert not GripperLosses.unpack(np.zeros(15)).lost.any()
