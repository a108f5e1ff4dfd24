"""The observer against statics and against the model pushed by known forces; the MPC with it leaves no offset."""

import numpy as np
import pytest

from drake_aerial.control.mpc.payload_mpc import PayloadMpc
from drake_aerial.dynamics.payload_model import derivative
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.disturbance_observer import DisturbanceObserver
from drake_aerial.estimation.observation import PositionFilter, observe
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.statics.gravity import GRAVITY
from tests.control.light_loop import fly, hanging
from tests.control.payload_cases import random_model, random_state
from tests.control.ticks import port_values
from tests.dynamics.integration import integrate

INERTIA = np.diag([0.006, 0.0059, 0.0107])
CENTRED = [[0.0, 0.0, 0.14]]
THREE = [[-0.154, -0.267, 0.011], [0.308, 0.0, 0.011], [-0.154, 0.267, 0.011]]
HOVER = HoverTrajectory(start=(0.0, 0.0, 1.0))


def seen(model, x, z):
    return observe(*port_values(model, x))._replace(z_WQ=z)


def watch(observer, model, x, thrust, ticks=400):
    """What the observer says of a state that stays as it is."""
    memory = np.zeros(observer.size(model.n))
    z = thrust / np.linalg.norm(thrust, axis=1, keepdims=True)
    for _ in range(ticks):
        found = observer.step(model, memory, seen(model, x, z), thrust, 0.02)
    return found


def test_a_hanging_load_that_is_pushed_aside_is_understood():
    # By hand: the cable points along weight plus push, the thrust carries both, the quadrotor's weight and its own push.
    model = PayloadModelParameters(0.25, INERTIA, CENTRED)
    on_payload, on_quadrotor = np.array([0.4, -0.3, 0.1]), np.array([0.05, 0.06, 0.0])
    pull = on_payload - [0.0, 0.0, 0.25 * GRAVITY]
    xi = pull / np.linalg.norm(pull)
    thrust = np.array([0.0, 0.0, 0.25 * GRAVITY]) - pull - on_quadrotor
    found = watch(
        DisturbanceObserver(),
        model,
        hanging(model, [0, 0, 1])._replace(xi=xi[None, None]),
        thrust[None],
    )
    # What pushes along the cable is the payload's, wherever it pushes.
    along = xi * (xi @ on_quadrotor)
    np.testing.assert_allclose(found.on_quadrotors[0], on_quadrotor - along, atol=1e-6)
    np.testing.assert_allclose(found.force, on_payload + along, atol=1e-6)
    # Upright while the cable is not: the lever of the pull is what a moment must make up for.
    np.testing.assert_allclose(
        found.moment, np.cross([0.0, 0.0, 0.14], np.linalg.norm(pull) * xi), atol=5e-3
    )


def test_it_takes_its_time():
    model = PayloadModelParameters(0.25, INERTIA, CENTRED)
    thrust = np.array([[0.0, 0.0, model.weight + 0.2]])
    observer = DisturbanceObserver(time=0.5)
    found = watch(observer, model, hanging(model, [0, 0, 1]), thrust, ticks=26)
    np.testing.assert_allclose(found.force, [0, 0, -0.2 * (1 - np.exp(-1.0))], atol=1e-9)


@pytest.mark.parametrize("n", [1, 3])
def test_pushes_are_found_in_motion(n):
    model = random_model(n, seed=n)
    x = random_state(n, 1, seed=n, rates=0.1)
    x = x._replace(R=np.eye(3)[None])
    wrench = np.array([0.3, -0.2, 0.25, 0.02, -0.01, 0.015])
    observer = DisturbanceObserver(time=1e-9, moment_time=1e-9, lever=1.0, share=5.0)  # at once
    memory, thrust = np.zeros(observer.size(n)), x.F[0]
    z = thrust / np.linalg.norm(thrust, axis=1, keepdims=True)
    h = 1e-3
    observer.step(model, memory, seen(model, x, z), thrust, h)
    x = pushed_step(model, x, thrust[None], h, wrench)
    found = observer.step(model, memory, seen(model, x, z), thrust, h)
    np.testing.assert_allclose(found.force, wrench[:3], atol=2e-2)
    np.testing.assert_allclose(found.moment, wrench[3:], atol=2e-3)
    np.testing.assert_allclose(found.on_quadrotors, 0.0, atol=2e-2)


def pushed_step(model, x, u, h, wrench):
    """One step of the model under a wrench: the model's own flow and, to first order in h, what the wrench adds."""
    free, pushed = derivative(model, x, u), derivative(model, x, u, wrench)
    y = integrate(model, x, u, h)
    return y._replace(
        v=y.v + h * (pushed.a - free.a),
        W=y.W + h * (pushed.dW - free.dW),
        w=y.w + h * (pushed.dw - free.dw),
    )


def test_nothing_is_observed_where_nothing_pushes_and_limits_hold():
    model = PayloadModelParameters(0.25, INERTIA, CENTRED)
    x, weight = hanging(model, [0, 0, 1]), model.weight
    calm = watch(DisturbanceObserver(), model, x, np.array([[0.0, 0.0, weight]]))
    assert max(np.abs(part).max() for part in calm) < 1e-12
    much = watch(DisturbanceObserver(share=0.3), model, x, np.array([[0.0, 0.0, 3 * weight]]))
    np.testing.assert_allclose(much.force, [0, 0, -0.3 * 0.25 * GRAVITY])
    lost = watch(
        DisturbanceObserver(),
        model,
        x._replace(v=np.full((1, 3), np.nan)),
        np.array([[0.0, 0.0, weight]]),
    )
    np.testing.assert_array_equal(lost.force, 0.0)


def last_error(truth, belief, observer, seconds):
    controller = PayloadMpc(belief, observer=observer, position_filter=PositionFilter(0.0))
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


def test_what_it_remembers_is_in_the_context():
    belief = PayloadModelParameters(0.25, INERTIA, THREE)
    plain, watching = PayloadMpc(belief), PayloadMpc(belief, observer=DisturbanceObserver())
    sizes = [c.CreateDefaultContext().num_total_states() for c in (plain, watching)]
    assert sizes[1] - sizes[0] == DisturbanceObserver.size(3)
