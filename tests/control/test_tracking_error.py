import numpy as np
import pytest
from payload_cases import random_model

from drake_aerial.control.flatness import ReferenceTable
from drake_aerial.control.payload_linearization import discretize, linearize
from drake_aerial.control.payload_model import integrate, retract, tangent_basis
from drake_aerial.control.tracking_error import deviation, deviation_jacobian, hover_state, terminal_cost
from drake_aerial.control.trajectory import HoverTrajectory


def near(model, desired, size, seed=0, batch=1):
    x = hover_state(model, desired)
    x = type(x)(*(np.repeat(field, batch, axis=0) for field in x))
    delta = size * np.random.default_rng(seed).normal(size=(batch, 12 + 7 * model.n))
    return retract(x, delta)


@pytest.mark.parametrize("n", [1, 2, 4])
def test_the_deviation_has_the_stated_jacobian(n):
    model = random_model(n, seed=n)
    desired = ReferenceTable(model, HoverTrajectory(start=(0.0, 0.0, 0.0))).at([0.0])
    x = near(model, desired, 1e-3, seed=n)
    eps = 1e-6
    J = np.eye(12 + 7 * n)
    J[:12, :12] = deviation_jacobian(model, x)[0]
    for k in range(12 + 7 * n):
        step = np.zeros((1, 12 + 7 * n))
        step[0, k] = eps
        plus, minus = retract(x, step), retract(x, -step)
        numeric = deviation(model, plus, desired, tangent_basis(plus.xi)) - deviation(
            model, minus, desired, tangent_basis(minus.xi)
        )
        expected = J[:, k].copy()
        if n == 1:  # turning about the pull itself does not count
            expected[6:9] -= desired.pull[0] * (desired.pull[0] @ expected[6:9])
        # Attitudes and directions are compared to first order, a little away from the reference.
        np.testing.assert_allclose(numeric[0] / (2 * eps), expected, atol=1e-2)


@pytest.mark.parametrize("n", [1, 3])
def test_on_the_reference_there_is_no_deviation(n):
    model = random_model(n, seed=n)
    desired = ReferenceTable(model, HoverTrajectory(start=(0.0, 0.0, 0.0), yaw=0.4)).at([0.0])
    x = hover_state(model, desired)
    np.testing.assert_allclose(deviation(model, x, desired, tangent_basis(x.xi)), 0.0, atol=1e-9)


def test_the_terminal_cost_is_the_cost_of_the_feedback_it_implies():
    """Roll the nonlinear model out under the gain that P implies: the summed cost is e' P e, nearly."""
    model = random_model(3, seed=7)
    desired = ReferenceTable(model, HoverTrajectory(start=(0.0, 0.0, 0.0))).at([0.0])
    h, nx, nu = 0.05, 33, 9
    Q, R = np.ones(nx) * h, np.ones(nu) * h
    P = terminal_cost(model, desired, Q, R, h)
    x0 = hover_state(model, desired)
    linear = linearize(model, x0, desired.F)
    C = np.eye(nx)
    C[:12, :12] = deviation_jacobian(model, x0)[0]

    step = discretize(linear, h)
    A, B = C @ step.Phi[0] @ np.linalg.inv(C), C @ step.Gamma[0]
    K = np.linalg.solve(np.diag(R) + B.T @ P @ B, B.T @ P @ A)
    x = near(model, desired, 2e-3, seed=3)
    e = deviation(model, x, desired, tangent_basis(x.xi))[0]
    expected, cost = e @ P @ e, 0.0
    for _ in range(400):
        e = deviation(model, x, desired, tangent_basis(x.xi))[0]
        u = -K @ e
        cost += e @ (Q * e) + u @ (R * u)
        x = integrate(model, x, desired.F + u.reshape(1, 3, 3), h / 2, 2)
    assert cost == pytest.approx(expected, rel=0.02)
    assert np.abs(e).max() < 1e-4


def test_one_cable_weighs_no_yaw():
    model = random_model(1, seed=4)
    desired = ReferenceTable(model, HoverTrajectory(start=(0.0, 0.0, 0.0))).at([0.0])
    x = hover_state(model, desired)
    pull = x.R[0].T @ desired.pull[0]
    turned = retract(x, np.concatenate([np.zeros(6), 0.8 * pull, np.zeros(10)])[None])
    arm = turned.R[0] @ model.p_LLcm
    turned = turned._replace(p=arm[None])
    e = deviation(model, turned, desired, tangent_basis(turned.xi))
    np.testing.assert_allclose(e, 0.0, atol=1e-9)
