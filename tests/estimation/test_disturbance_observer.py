"""The observer against statics and the model under known forces; the MPC with it has no offset."""

import warnings

import numpy as np
import pytest

from drake_aerial.control.controller_parameters import MpcParameters
from drake_aerial.control.mpc.payload_mpc import PayloadMpc
from drake_aerial.dynamics.payload_model import derivative
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.disturbance_observer import DisturbanceObserver, ObserverMemory
from drake_aerial.estimation.observation import PositionFilter, observe
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.statics.gravity import GRAVITY
from tests.control.control_steps import control_step, fix_inputs, port_values
from tests.control.light_loop import fly, hanging
from tests.control.payload_cases import random_model, random_state
from tests.dynamics.integration import integrate

INERTIA = np.diag([0.006, 0.0059, 0.0107])
CENTRED = [[0.0, 0.0, 0.14]]
THREE = [[-0.154, -0.267, 0.011], [0.308, 0.0, 0.011], [-0.154, 0.267, 0.011]]
HOVER = HoverTrajectory(start=(0.0, 0.0, 1.0))


def initial(n):
    return ObserverMemory.unpack(np.zeros(ObserverMemory.size(n)))


def observed(model, x, thrust):
    z = thrust / np.linalg.norm(thrust, axis=1, keepdims=True)
    return observe(*port_values(model, x, z))


def disturbance_at(observer, model, x, thrust, steps=400):
    """The estimate after so many steps in a constant state."""
    memory, observation = initial(model.n), observed(model, x, thrust)
    for _ in range(steps):
        found, memory = observer.step(model, memory, observation, thrust, 0.02)
    return found


def test_pushes_on_a_hanging_load_are_found():
    # By hand: the cable points along weight plus push. The thrust carries both, the quadrotor's
    # weight and its push.
    model = PayloadModelParameters(0.25, INERTIA, CENTRED)
    on_payload, on_quadrotor = np.array([0.4, -0.3, 0.1]), np.array([0.05, 0.06, 0.0])
    pull = on_payload - [0.0, 0.0, 0.25 * GRAVITY]
    xi = pull / np.linalg.norm(pull)
    thrust = np.array([0.0, 0.0, 0.25 * GRAVITY]) - pull - on_quadrotor
    found = disturbance_at(
        DisturbanceObserver(),
        model,
        hanging(model, [0, 0, 1])._replace(xi=xi[None, None]),
        thrust[None],
    )
    # A push along the cable counts as one on the payload.
    along = xi * (xi @ on_quadrotor)
    np.testing.assert_allclose(found.on_quadrotors[0], on_quadrotor - along, atol=1e-6)
    np.testing.assert_allclose(found.force, on_payload + along, atol=1e-6)
    # The payload is upright and the cable is not: a moment balances the pull.
    np.testing.assert_allclose(
        found.moment, np.cross([0.0, 0.0, 0.14], np.linalg.norm(pull) * xi), atol=5e-3
    )


def test_the_estimate_follows_with_its_time_constant():
    model = PayloadModelParameters(0.25, INERTIA, CENTRED)
    thrust = np.array([[0.0, 0.0, model.weight + 0.2]])
    observer = DisturbanceObserver(time=0.5)
    found = disturbance_at(observer, model, hanging(model, [0, 0, 1]), thrust, steps=26)
    np.testing.assert_allclose(found.force, [0, 0, -0.2 * (1 - np.exp(-1.0))], atol=1e-9)


@pytest.mark.parametrize("n", [1, 3])
def test_pushes_are_found_in_motion(n):
    model = random_model(n, seed=n)
    x = random_state(n, 1, seed=n, rates=0.1)
    x = x._replace(R=np.eye(3)[None])
    wrench = np.array([0.3, -0.2, 0.25, 0.02, -0.01, 0.015])
    observer = DisturbanceObserver(time=1e-9, moment_time=1e-9, lever=1.0, share=5.0)  # at once
    thrust, h = x.F[0], 1e-3
    _, memory = observer.step(model, initial(n), observed(model, x, thrust), thrust, h)
    x = pushed_step(model, x, thrust[None], h, wrench)
    # The quadrotors keep their attitude.
    after = observed(model, x, thrust)
    found, _ = observer.step(model, memory, after, thrust, h)
    np.testing.assert_allclose(found.force, wrench[:3], atol=2e-2)
    np.testing.assert_allclose(found.moment, wrench[3:], atol=2e-3)
    np.testing.assert_allclose(found.on_quadrotors, 0.0, atol=2e-2)


def pushed_step(model, x, u, h, wrench):
    """One step of the model under a wrench, whose effect is added to first order in h."""
    free, pushed = derivative(model, x, u), derivative(model, x, u, wrench)
    y = integrate(model, x, u, h)
    return y._replace(
        v=y.v + h * (pushed.a - free.a),
        W=y.W + h * (pushed.dW - free.dW),
        w=y.w + h * (pushed.dw - free.dw),
    )


def test_the_estimate_is_zero_without_pushes_and_limited_under_large_ones():
    model = PayloadModelParameters(0.25, INERTIA, CENTRED)
    x, weight = hanging(model, [0, 0, 1]), model.weight
    calm = disturbance_at(DisturbanceObserver(), model, x, np.array([[0.0, 0.0, weight]]))
    assert max(np.abs(part).max() for part in calm if part is not None) < 1e-12
    much = disturbance_at(
        DisturbanceObserver(share=0.3), model, x, np.array([[0.0, 0.0, 3 * weight]])
    )
    np.testing.assert_allclose(much.force, [0, 0, -0.3 * 0.25 * GRAVITY])
    lost = disturbance_at(
        DisturbanceObserver(),
        model,
        x._replace(v=np.full((1, 3), np.nan)),
        np.array([[0.0, 0.0, weight]]),
    )
    np.testing.assert_array_equal(lost.force, 0.0)


def last_error(truth, belief, observer, seconds):
    parameters = MpcParameters(observer=observer, position_filter=PositionFilter(0.0))
    controller = PayloadMpc(belief, parameters)
    log = fly(controller, truth, hanging(truth, HOVER.start), HOVER, seconds)
    return log["error"][-125:].max()


@pytest.mark.parametrize("contacts", [CENTRED, THREE], ids=["one", "three"])
def test_a_wrong_mass_leaves_no_offset(contacts):
    truth = PayloadModelParameters(0.3, INERTIA, contacts)
    belief = PayloadModelParameters(0.25, INERTIA, contacts)
    assert last_error(truth, belief, DisturbanceObserver(), 4.0) < 0.002
    if len(contacts) == 1:
        assert last_error(truth, belief, None, 2.0) > 0.01


def test_a_wrong_centre_of_mass_leaves_no_offset():
    truth = PayloadModelParameters(0.25, INERTIA, CENTRED, p_LLcm=[0.05, 0.0, 0.0])
    belief = PayloadModelParameters(0.25, INERTIA, CENTRED)
    assert last_error(truth, belief, None, 2.5) > 0.03
    assert last_error(truth, belief, DisturbanceObserver(), 9.0) < 0.005


def test_an_estimate_at_a_limit_is_visible():
    model = PayloadModelParameters(0.25, INERTIA, CENTRED)
    x, weight = hanging(model, [0, 0, 1]), model.weight
    for surplus, limited in ((0.1, False), (3.0, True)):
        thrust = np.array([[0.0, 0.0, weight + surplus * 0.25 * GRAVITY]])
        assert disturbance_at(DisturbanceObserver(), model, x, thrust).limited is limited


def test_the_mpc_warns_once_and_counts_the_steps_at_a_limit():
    truth = PayloadModelParameters(0.3, INERTIA, CENTRED)
    belief = PayloadModelParameters(0.25, INERTIA, CENTRED)
    parameters = MpcParameters(
        observer=DisturbanceObserver(share=0.1), position_filter=PositionFilter(0.0)
    )
    controller = PayloadMpc(belief, parameters)
    x = hanging(truth, HOVER.start)
    thrust = np.array([[0.0, 0.0, truth.weight]])
    context = controller.CreateDefaultContext()
    counts = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for k in range(100):
            # The load hangs still under the thrust that its true mass needs.
            controller.set_thrusts(context, thrust)
            context.SetTime(0.02 * k)
            fix_inputs(controller, context, truth, x, HOVER)
            control_step(controller, context)
            counts.append(controller.GetOutputPort("diagnostics").Eval(context)[4])
    # The estimate reaches the limit at half of its final value, after 0.5 s log 2: 18 steps.
    assert counts[16] == 0.0
    assert counts[-1] == pytest.approx(81, abs=2)
    assert [str(w.message) for w in caught if "reached the limit" in str(w.message)] == [
        str(caught[0].message)
    ]
    assert "`share` = 0.1" in str(caught[0].message)


def test_a_memory_comes_back_from_its_vector():
    values = np.random.default_rng(0).normal(size=ObserverMemory.size(2))
    memory = ObserverMemory.unpack(values)
    assert memory.quadrotors.shape == (4, 2, 3)
    np.testing.assert_array_equal(memory.pack(), values)
