from dataclasses import replace

import numpy as np
import pytest

from drake_aerial.control.controller_parameters import GeometricGains, GeometricParameters
from drake_aerial.control.geometric import GeometricController, cable_forces
from drake_aerial.dynamics.payload_model import PayloadState, derivative, retract
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.observation import PositionFilter, observe
from drake_aerial.references.trajectory import HoverTrajectory, TransportTrajectory
from drake_aerial.statics.gravity import GRAVITY
from tests.control.control_steps import first_command, port_values
from tests.control.light_loop import fly, hanging
from tests.control.payload_cases import random_model

INERTIA = np.diag([0.006, 0.0059, 0.0107])
THREE = [[-0.154, -0.267, 0.011], [0.308, 0.0, 0.011], [-0.154, 0.267, 0.011]]
HOVER = HoverTrajectory(start=(0.0, 0.0, 1.0))
GAINS = GeometricGains()
EXACT = GeometricParameters("geometric", position_filter=PositionFilter(0.0))


def observed(model, x):
    return observe(*port_values(model, x))


@pytest.mark.parametrize("n", [1, 3, 5])
def test_hovering_quadrotors_carry_themselves_and_the_payload(n):
    model = random_model(n, seed=n)
    model = PayloadModelParameters(
        model.mass,
        model.inertia,
        model.p_LC,
        model.p_LC.mean(0) - [0, 0, 0.1],
        model.quadrotor_mass,
        model.cable_length,
        max_thrust=12.0,
    )
    x = hanging(model, [0.0, 0.0, 1.0])
    if n > 1:  # cables along the desired forces, so that the law has nothing to correct
        mu, _ = cable_forces(model, GAINS, observed(model, x), HOVER.sample(0.0))
        x = x._replace(xi=-(mu / np.linalg.norm(mu, axis=1, keepdims=True))[None])
    thrust = first_command(GeometricController(model, EXACT), model, x, HOVER)
    np.testing.assert_allclose(thrust.sum(0), [0.0, 0.0, model.weight], atol=1e-9)
    rest = derivative(model, x._replace(F=thrust[None]), thrust[None])
    np.testing.assert_allclose(rest.a, 0.0, atol=1e-9)
    np.testing.assert_allclose(rest.dw, 0.0, atol=1e-8)


def test_forces_make_the_wrench_that_the_payload_law_demands():
    model = random_model(4, seed=1)
    x = hanging(model, [0.1, -0.2, 0.9])
    x = retract(x, 0.05 * np.random.default_rng(0).normal(size=(1, 12 + 28)))
    observation, desired = observed(model, x), HOVER.sample(0.0)
    mu, feedback = cable_forces(model, GAINS, observation, desired)
    np.testing.assert_allclose(mu.sum(0), model.mass * feedback, atol=1e-9)
    R, W = observation.R, observation.W
    E = 0.5 * (R - R.T)
    moment = -np.array(GAINS.rotation) * [E[2, 1], E[0, 2], E[1, 0]] - np.array(GAINS.rate) * W
    np.testing.assert_allclose(np.cross(model.arms, mu @ R).sum(0), moment, atol=1e-9)
    # Least sum of squares: orthogonal to every distribution that makes no wrench.
    null = np.linalg.svd(model.grasp_matrix)[2][6:]
    np.testing.assert_allclose(null @ (mu @ R).ravel(), 0.0, atol=1e-9)


def test_the_cable_obeys_the_second_order_law_it_is_given():
    """The whole chain on the model: with the thrust applied, w' is what the gains promise."""
    model = PayloadModelParameters(0.25, INERTIA, [[0.0, 0.0, 0.14]])
    tilt = np.array([0.15, -0.1, -1.0])
    xi = tilt / np.linalg.norm(tilt)
    x = hanging(model, [0.0, 0.0, 1.0])._replace(xi=xi[None, None])
    w = np.cross(xi, [0.2, 0.1, 0.0])
    x = PayloadState(x.p, x.v, x.R, x.W, x.xi, w[None, None], x.F)
    controller = GeometricController(model, EXACT)
    thrust = first_command(controller, model, x, HOVER)
    d = derivative(model, x._replace(F=thrust[None]), thrust[None])
    e_xi = np.cross([0.0, 0.0, -1.0], xi)
    promised = -np.array(GAINS.direction) * e_xi - np.array(GAINS.direction_rate) * w
    promised -= xi * (xi @ promised)
    # The law feeds the desired contact acceleration forward; the actual one differs.
    contact = d.a[0] + [0, 0, GRAVITY] + x.R[0] @ np.cross(d.dW[0], model.arms[0])
    missing = np.cross(xi, contact - [0, 0, GRAVITY]) / model.cable_length[0]
    np.testing.assert_allclose(d.dw[0, 0], promised + missing, atol=1e-9)


def test_unequal_quadrotors_may_come_in_any_order():
    model = random_model(3, seed=5)
    order = [2, 0, 1]
    shuffled = PayloadModelParameters(
        model.mass,
        model.inertia,
        model.p_LC[order],
        model.p_LLcm,
        model.quadrotor_mass[order],
        model.cable_length[order],
    )
    x = retract(hanging(model, [0, 0, 1]), 0.05 * np.random.default_rng(2).normal(size=(1, 33)))
    y = x._replace(xi=x.xi[:, order], w=x.w[:, order])
    a = first_command(GeometricController(model), model, x, HOVER)
    b = first_command(GeometricController(shuffled), shuffled, y, HOVER)
    np.testing.assert_allclose(b, a[order], atol=1e-9)


@pytest.mark.parametrize("contacts", [[[0.0, 0.0, 0.14]], THREE])
def test_feed_forward_of_the_cable_rate_pays_on_a_circle(contacts):
    model = PayloadModelParameters(0.25, INERTIA, contacts)
    circle = TransportTrajectory.airborne(
        start=(1.0, 0.0, 1.0), turns=1.0, circle_time=6.0, hover_time=0.5
    )
    errors = []
    for kind in ("geometric", "geometric_ff"):
        controller = GeometricController(model, replace(EXACT, kind=kind))
        log = fly(controller, model, hanging(model, [1.0, 0.0, 1.0]), circle, 6.0)
        errors.append(np.sqrt((log["error"] ** 2).mean()))
    assert errors[1] < 0.12
    assert errors[1] < 0.6 * errors[0]


@pytest.mark.slow
def test_the_published_law_has_the_errors_of_two_independent_simulators():
    """Three quadrotors, exact state, forces and moments held at 100 Hz.

    A circle at constant rate from rest, then the stop: RMSE 0.137 m over the twelve seconds; the
    peak, 0.480 m, is the overshoot after the stop.
    """
    model = PayloadModelParameters(0.25, INERTIA, THREE)
    circle = TransportTrajectory.airborne(start=(1.0, 0.0, 1.0), timing="constant", hover_time=2.0)
    controller = GeometricController(model, replace(EXACT, period=0.01), offset=0.0)
    start = hanging(model, [1.0, 0.0, 1.0])
    log = fly(controller, model, start, circle, 13.0, sensor_period=None, step=0.002, hold=0.01)
    during = log["t"] < 12.0
    assert np.sqrt((log["error"][during] ** 2).mean()) == pytest.approx(0.137, abs=0.002)
    assert log["error"].max() == pytest.approx(0.480, abs=0.005)
    assert log["t"][log["error"].argmax()] > 12.0
