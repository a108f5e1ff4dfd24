import itertools

import numpy as np
import pytest

from drake_aerial.control.mpc.tracking_cost import (
    deviation,
    deviation_jacobian,
    hover_state,
    terminal_cost,
)
from drake_aerial.dynamics.discretization import discretize
from drake_aerial.dynamics.flatness import ReferenceTable
from drake_aerial.dynamics.linearization import linearize
from drake_aerial.dynamics.payload_model import retract, tangent_basis
from drake_aerial.geometry import matrix_from_quat, quat_exp
from drake_aerial.references.trajectory import HoverTrajectory
from tests.control.payload_cases import random_input, random_model, random_state
from tests.dynamics.integration import integrate


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
    """Roll out the nonlinear model under the gain of P: the summed cost is nearly e' P e."""
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


def far(model, batch=5):
    """States that move and turn, and a reference that does not."""
    x = random_state(model.n, batch, seed=3)
    return x, ReferenceTable(model, HoverTrajectory(start=(0.3, -0.2, 0.5), yaw=0.4)).at([0.0])


@pytest.mark.parametrize("n", [1, 3])
def test_places_and_velocities_are_those_of_the_tracked_point(n):
    model = random_model(n, seed=n)
    x, desired = far(model)
    e = deviation(model, x, desired, tangent_basis(x.xi))
    tracked = x.p - (x.R @ model.p_LLcm)
    np.testing.assert_allclose(e[:, 0:3], tracked - [0.3, -0.2, 0.5], atol=1e-12)
    h = 1e-6
    steps = []
    for s in (h, -h):
        y = integrate(model, x, random_input(n, 5), s)
        steps.append(y.p - y.R @ model.p_LLcm)
    np.testing.assert_allclose(e[:, 3:6], (steps[0] - steps[1]) / (2 * h), atol=1e-6)
    # Angular velocity in the world: how the payload's axes move there.
    omega = e[:, 9:12]
    y = integrate(model, x, random_input(n, 5), h)
    np.testing.assert_allclose(
        (y.R - x.R) / h,
        np.cross(omega[:, None, :], np.swapaxes(x.R, 1, 2)).swapaxes(1, 2),
        atol=1e-4,
    )


def test_attitudes_cables_and_thrusts_are_differences_from_the_reference():
    model = random_model(3, seed=3)
    _, desired = far(model)
    theta = np.array([[0.3, -0.5, 0.2], [0.0, 0.0, 1.5]])
    x = hover_state(model, desired)
    x = type(x)(*(np.repeat(field, 2, axis=0) for field in x))
    x = x._replace(R=matrix_from_quat(quat_exp(theta)) @ x.R, F=x.F + [0.1, 0.2, -0.3], w=x.w + 0.0)
    e = deviation(model, x, desired, tangent_basis(x.xi))
    np.testing.assert_allclose(e[:, 6:9], theta, atol=1e-9)
    np.testing.assert_allclose(e[:, -9:], np.tile([0.1, 0.2, -0.3], (2, 3)), atol=1e-12)
    # Cables turned a little, and turning.
    y = hover_state(model, desired)
    delta = np.zeros((1, 33))
    delta[0, 12:24] = 1e-3 * np.arange(1.0, 13.0)
    moved = retract(y, delta)
    e = deviation(model, moved, desired, tangent_basis(y.xi))
    np.testing.assert_allclose(e[0, 12:24], delta[0, 12:24], atol=1e-4)
    # As fast as the reference's cables turn is no deviation.
    E = tangent_basis(y.xi)
    turning = 0.4 * E[..., 0] - 0.7 * E[..., 1]
    e = deviation(
        model, y._replace(w=y.w + turning), desired._replace(w=desired.w + 0.5 * turning), E
    )
    np.testing.assert_allclose(e[0, 18:24], np.tile([0.2, -0.35], 3), atol=1e-12)


@pytest.mark.parametrize("n", [1, 3])
def test_the_jacobian_holds_at_any_rate(n):
    model = random_model(n, seed=n)
    x, desired = far(model, 1)
    C, eps = deviation_jacobian(model, x)[0], 1e-6
    for k in range(12):
        step = np.zeros((1, 12 + 7 * n))
        step[0, k] = eps
        plus, minus = (
            deviation(model, y, desired, tangent_basis(y.xi))
            for y in (retract(x, step), retract(x, -step))
        )
        numeric = (plus - minus)[0, :12] / (2 * eps)
        # All but the attitude's rows, whose error is compared at small angles only.
        rows = [*range(6), *range(9, 12)]
        np.testing.assert_allclose(C[rows, k], numeric[rows], atol=1e-7)
    np.testing.assert_allclose(C[6:9, 6:9], x.R[0])


@pytest.mark.parametrize("n", [2, 3])
def test_the_terminal_cost_solves_the_riccati_equation(n):
    from scipy.linalg import solve_discrete_are

    model = random_model(n, seed=n)
    desired = ReferenceTable(model, HoverTrajectory(start=(0.0, 0.0, 0.0))).at([0.0])
    h, nx, nu = 0.05, 12 + 7 * n, 3 * n
    rng = np.random.default_rng(0)
    Q, R = h * rng.uniform(0.5, 2.0, nx), h * rng.uniform(0.5, 2.0, nu)
    P = terminal_cost(model, desired, Q, R, h)
    # On the error state e = C d, where the step is that of the linear model.
    x0 = hover_state(model, desired)
    step = discretize(linearize(model, x0, desired.F), h)
    C = np.eye(nx)
    C[:12, :12] = deviation_jacobian(model, x0)[0]
    exact = solve_discrete_are(step.Phi[0], step.Gamma[0], C.T @ np.diag(Q) @ C, np.diag(R))
    np.testing.assert_allclose(C.T @ P @ C, exact, rtol=1e-5, atol=1e-7 * np.abs(exact).max())
    np.testing.assert_array_equal(P, P.T)


def test_few_sweeps_are_the_cost_of_few_steps():
    model = random_model(2, seed=2)
    desired = ReferenceTable(model, HoverTrajectory(start=(0.0, 0.0, 0.0))).at([0.0])
    Q, R = np.arange(1.0, 27.0), np.ones(6)
    np.testing.assert_array_equal(terminal_cost(model, desired, Q, R, 0.05, sweeps=0), np.diag(Q))
    costs = [
        np.linalg.eigvalsh(terminal_cost(model, desired, Q, R, 0.05, sweeps=k)) for k in (1, 2, 4)
    ]
    assert all((b >= a - 1e-9).all() for a, b in itertools.pairwise(costs))  # more steps cost more
