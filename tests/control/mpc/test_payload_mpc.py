from dataclasses import replace

import numpy as np
import pytest

from drake_aerial.control.controller_parameters import MpcParameters
from drake_aerial.control.mpc.horizon import STAGES, normalized, pack, shifting, unpack
from drake_aerial.control.mpc.payload_mpc import PayloadMpc
from drake_aerial.dynamics.flatness import reference_table
from drake_aerial.dynamics.payload_model import PayloadState, retract, rotation_exp
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.errors import InputError
from drake_aerial.estimation.observation import PositionFilter
from drake_aerial.references.trajectory import HoverTrajectory, TransportTrajectory
from drake_aerial.statics.gravity import GRAVITY
from tests.control.control_steps import control_step, first_command, fix_inputs
from tests.control.light_loop import fly, hanging
from tests.control.payload_cases import random_model
from tests.dynamics.integration import integrate

INERTIA = np.diag([0.006, 0.0059, 0.0107])
THREE = [[-0.154, -0.267, 0.011], [0.308, 0.0, 0.011], [-0.154, 0.267, 0.011]]
EXACT = MpcParameters(position_filter=PositionFilter(0.0))
CIRCLE = TransportTrajectory.airborne(
    start=(1.0, 0.0, 1.0), turns=1.0, circle_time=6.0, hover_time=1.0
)
HOVER = HoverTrajectory(start=(0.0, 0.0, 1.0))


def at_rest(model, trajectory):
    reference = reference_table(model, trajectory).at([-1.0])
    x = hanging(model, trajectory.start, reference.R[0])
    return x._replace(xi=reference.xi)


def rms(error):
    return np.sqrt((error**2).mean())


@pytest.mark.parametrize(
    "model",
    [
        PayloadModelParameters(0.25, INERTIA, [[0.0, 0.0, 0.14]]),
        PayloadModelParameters(
            0.25, INERTIA, [[0.2, 0.05, 0.14]], p_LLcm=[0.0, 0.0, -0.02], cable_length=0.7
        ),
        PayloadModelParameters(
            0.25, INERTIA, THREE, quadrotor_mass=[0.2, 0.25, 0.3], cable_length=[0.4, 0.5, 0.6]
        ),
    ],
    ids=["centred", "off-centre", "three unequal"],
)
def test_a_circle_is_tracked_within_millimetres_by_the_true_state(model):
    controller = PayloadMpc(model, EXACT)
    log = fly(controller, model, at_rest(model, CIRCLE), CIRCLE, 7.0, step=0.002)
    assert rms(log["error"]) < 0.005
    # The cables would have to tilt before the reference begins, so the first second is left out.
    assert log["error"][log["t"] > 1.5].max() < 0.01


def test_a_centimetre_of_noise_is_not_passed_on():
    model = PayloadModelParameters(0.25, INERTIA, [[0.0, 0.0, 0.14]])
    log = fly(PayloadMpc(model), model, at_rest(model, CIRCLE), CIRCLE, 7.0, noise=0.01, seed=3)
    assert rms(log["error"]) < 0.008


def test_integral_action_removes_what_a_wrong_mass_leaves():
    truth = PayloadModelParameters(0.3, INERTIA, [[0.0, 0.0, 0.14]])
    belief = PayloadModelParameters(0.25, INERTIA, [[0.0, 0.0, 0.14]])
    sag = []
    for gain in (0.0, 1.0):
        controller = PayloadMpc(belief, replace(EXACT, integral_gain=gain))
        log = fly(controller, truth, at_rest(truth, HOVER), HOVER, 5.0)
        sag.append(abs((log["p"] - log["reference"])[-125:, 2].mean()))
    assert sag[0] > 0.01
    assert sag[1] < 0.1 * sag[0]


@pytest.mark.parametrize("n", [2, 4])
def test_the_order_of_unequal_quadrotors_does_not_matter(n):
    model = random_model(n, seed=n)
    order = np.random.default_rng(n).permutation(n)
    shuffled = PayloadModelParameters(
        model.mass,
        model.inertia,
        model.p_LC[order],
        model.p_LLcm,
        model.quadrotor_mass[order],
        model.cable_length[order],
        model.thrust_lag[order],
    )
    x = at_rest(model, HOVER)
    x = retract(x, 0.03 * np.random.default_rng(1).normal(size=(1, 12 + 7 * n)))
    y = x._replace(xi=x.xi[:, order], w=x.w[:, order], F=x.F[:, order])
    a = first_command(PayloadMpc(model), model, x, HOVER)
    b = first_command(PayloadMpc(shuffled), shuffled, y, HOVER)
    np.testing.assert_allclose(b, a[order], atol=2e-4)


def test_commands_stay_in_the_thrust_box_however_far_the_goal():
    model = PayloadModelParameters(0.25, INERTIA, [[0.0, 0.0, 0.14]])
    controller = PayloadMpc(model)
    far = HoverTrajectory(start=(3.0, -3.0, 6.0))
    context = controller.CreateDefaultContext()
    fix_inputs(controller, context, model, at_rest(model, HOVER), far)
    active = 0
    for _ in range(10):
        thrust = control_step(controller, context)
        size = np.linalg.norm(thrust)
        # Commands are rounded to micronewtons.
        assert model.min_thrust[0] - 2e-6 <= size <= model.max_thrust[0] + 2e-6
        active += controller.GetOutputPort("diagnostics").Eval(context)[1]
    assert active > 0


def test_all_memory_is_in_the_context():
    model = PayloadModelParameters(0.25, INERTIA, [[0.0, 0.0, 0.14]])
    controller = PayloadMpc(model)
    x = retract(at_rest(model, HOVER), 0.02 * np.random.default_rng(0).normal(size=(1, 19)))
    a = controller.CreateDefaultContext()
    fix_inputs(controller, a, model, x, HOVER)
    for _ in range(3):
        control_step(controller, a)
    b = a.Clone()
    expected = control_step(controller, a)
    # A control step in another context in between.
    first_command(controller, model, at_rest(model, HOVER), HOVER)
    np.testing.assert_array_equal(control_step(controller, b), expected)


@pytest.mark.parametrize("steps", [(1,) * 20, STAGES, (1, 3, 2, 2)])
def test_a_plan_moves_on_in_time(steps):
    places = np.concatenate([[0.0], np.cumsum(steps)])
    t, count = 0.05 * places, len(places)
    rng = np.random.default_rng(0)
    slope = rng.normal(size=(1, 3))
    xi = np.stack([0.2 * np.sin(t), 0.1 * np.cos(t), -np.ones(count)], axis=1)
    xi /= np.linalg.norm(xi, axis=1, keepdims=True)
    line = t[:, None] * slope
    R = rotation_exp(line)
    x = PayloadState(line, line, R, line, xi[:, None], 0 * xi[:, None], line[:, None])
    rows = pack(x)
    for got, field in zip(unpack(rows, 1), x):
        np.testing.assert_array_equal(got, field)
    moved = normalized(unpack(shifting(places, 0.4) @ rows, 1))
    np.testing.assert_allclose(moved.p, line + 0.02 * slope, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(moved.xi, axis=-1), 1.0, atol=1e-12)
    np.testing.assert_allclose(
        moved.R[:-1], rotation_exp(line + 0.02 * slope)[:-1], atol=1e-4 * max(steps) ** 2
    )
    np.testing.assert_allclose(
        moved.R @ np.swapaxes(moved.R, 1, 2),
        np.tile(np.eye(3), (count, 1, 1)),
        atol=1e-6 * max(steps) ** 4,
    )
    if set(steps) == {1}:
        np.testing.assert_allclose((shifting(places, 2.0) @ rows)[:19], rows[2:], atol=1e-12)


def test_an_impossible_horizon_is_refused():
    model = PayloadModelParameters(0.25, INERTIA, [[0.0, 0.0, 0.14]])
    with pytest.raises(InputError, match="stages"):
        PayloadMpc(model, MpcParameters(stages=1))
    with pytest.raises(InputError, match="stages"):
        PayloadMpc(model, MpcParameters(stages=[1, 0, 2]))
    with pytest.raises(InputError, match="stages"):
        PayloadMpc(model, MpcParameters(stages=[1.5, 1.0]))
    with pytest.raises(InputError, match="period"):
        PayloadMpc(model, MpcParameters(period=0.0))
    for wrong in (0, -1, 1.5):
        with pytest.raises(InputError, match="ticks_per_plan"):
            PayloadMpc(model, MpcParameters(ticks_per_plan=wrong))


def test_a_plan_is_kept_for_ticks_per_plan_control_steps():
    model = PayloadModelParameters(0.25, INERTIA, [[0.0, 0.0, 0.14]])
    for ticks in (1, 2, 3):
        controller = PayloadMpc(model, replace(EXACT, ticks_per_plan=ticks))
        x = at_rest(model, HOVER)
        context = controller.CreateDefaultContext()
        commanded = []
        for k in range(7):
            # The state differs at every control step, so a new command means a new plan.
            fix_inputs(
                controller, context, model, x._replace(v=np.full((1, 3), 0.02 * (k + 1))), HOVER
            )
            commanded.append(control_step(controller, context))
        new = [k for k in range(1, 7) if (commanded[k] != commanded[k - 1]).any()]
        assert new == list(range(ticks, 7, ticks))
        assert len(controller.step_seconds) == 1 + len(new)


def test_a_state_that_is_not_finite_gives_hover_thrust_and_a_new_plan():
    model = PayloadModelParameters(0.25, INERTIA, [[0.0, 0.0, 0.14]])
    controller = PayloadMpc(model, EXACT)
    x = at_rest(model, HOVER)
    context = controller.CreateDefaultContext()
    fix_inputs(controller, context, model, x, HOVER)
    control_step(controller, context)
    fix_inputs(controller, context, model, x._replace(W=np.full((1, 3), np.nan)), HOVER)
    np.testing.assert_allclose(
        control_step(controller, context), [[0.0, 0.0, model.weight]], atol=1e-6
    )
    fix_inputs(controller, context, model, x, HOVER)
    for _ in range(3):
        np.testing.assert_allclose(
            control_step(controller, context), [[0.0, 0.0, model.weight]], atol=1e-3
        )


@pytest.mark.parametrize("contacts", [[[0.0, 0.0, 0.14]], THREE], ids=["one", "three"])
@pytest.mark.parametrize("lag", [0.01, 1e-3, (0.1, 0.1, 0.01)])
def test_quadrotors_faster_than_the_mpcs_step_reach_their_goal(contacts, lag):
    """The plant is the model itself, whose thrusts follow their commands with the short lag."""
    model = PayloadModelParameters(0.25, INERTIA, contacts, thrust_lag=lag)
    controller, n = PayloadMpc(model, EXACT), model.n
    x = hanging(model, [0.3, -0.2, 1.1])
    x = x._replace(F=GRAVITY * (model.mass / n + 0.25) * np.tile([0.0, 0.0, 1.0], (1, n, 1)))
    context = controller.CreateDefaultContext()
    controller.set_thrusts(context, x.F[0])
    substeps = 4 + int(0.02 / model.thrust_lag.min())
    for _ in range(200):
        axes = x.F[0] / np.linalg.norm(x.F[0], axis=1, keepdims=True)
        fix_inputs(controller, context, model, x, HOVER, axes)
        thrust = control_step(controller, context)
        x = integrate(model, x, thrust[None], 0.02 / substeps, substeps)
    np.testing.assert_allclose(x.p[0] - x.R[0] @ model.p_LLcm, HOVER.start, atol=1e-3)


def test_the_law_of_a_smaller_team_has_the_same_configuration():
    model = PayloadModelParameters(0.25, INERTIA, THREE)
    controller = PayloadMpc(model, MpcParameters(stages=7, period=0.01), offset=0.0004)
    law = controller.for_smaller_team(model.carried_by([0, 2]))
    assert law.parameters is controller.parameters
    assert (law.offset, law.period, law.model.n) == (0.0004, 0.01, 2)
