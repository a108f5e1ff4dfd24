import numpy as np
import pytest

from drake_aerial.dynamics.payload_model import (
    PayloadState,
    derivative,
    retract,
    rotation_exp,
    rotation_log,
    tangent_basis,
)
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.errors import InputError
from drake_aerial.geometry import matrix_from_quat, quat_exp, quat_from_two_vectors, rotate, skew
from drake_aerial.statics.gravity import GRAVITY
from tests.control.payload_cases import random_input, random_model, random_state
from tests.dynamics.integration import difference, integrate, transport


def newton_euler(model, x, k, wrench=(0.0,) * 6):
    """Solve the Newton-Euler equations of all bodies, one rod multiplier per cable; state k.

    Unknowns: linear and angular acceleration of the payload (world), accelerations of the
    quadrotors, tensions.
    """
    n, M = model.n, model.mass
    R = x.R[k]
    J = R @ model.inertia @ R.T
    W = R @ x.W[k]
    arms = model.arms @ R.T
    size = 6 + 3 * n + n
    lhs, rhs = np.zeros((size, size)), np.zeros(size)
    lhs[0:3, 0:3], rhs[0:3] = M * np.eye(3), [0.0, 0.0, -M * GRAVITY] + np.array(wrench[0:3])
    lhs[3:6, 3:6], rhs[3:6] = J, -np.cross(W, J @ W) + R @ np.array(wrench[3:6])
    for i in range(n):
        rows, t = slice(6 + 3 * i, 9 + 3 * i), 6 + 3 * n + i
        xi, m = x.xi[k, i], model.quadrotor_mass[i]
        lhs[rows, rows] = m * np.eye(3)
        rhs[rows] = x.F[k, i] - [0.0, 0.0, m * GRAVITY]
        lhs[rows, t] = -xi  # the quadrotor is pulled towards the contact
        lhs[0:3, t] = xi  # and the contact towards the quadrotor
        lhs[3:6, t] = np.cross(arms[i], xi)
        # |d|^2 = l^2 for d = p_C - p_Q, twice differentiated: d.d'' + |d'|^2 = 0.
        l = model.cable_length[i]
        gap, gap_rate = l * xi, l * np.cross(x.w[k, i], xi)
        lhs[t, 0:3] = gap
        lhs[t, 3:6] = -gap @ skew(arms[i])
        lhs[t, rows] = -gap
        rhs[t] = -gap_rate @ gap_rate - gap @ np.cross(W, np.cross(W, arms[i]))
    solution = np.linalg.solve(lhs, rhs)
    dW_world = solution[3:6]
    contact = solution[0:3] + np.cross(dW_world, arms) + np.cross(W, np.cross(W, arms))
    gap_acceleration = contact - solution[6 : 6 + 3 * n].reshape(n, 3)
    dw = np.cross(x.xi[k], gap_acceleration / model.cable_length[:, None])
    return solution[0:3], R.T @ dW_world, dw, solution[6 + 3 * n :]


@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_accelerations_and_tensions_agree_with_newton_euler(n):
    model = random_model(n, seed=n)
    x, u = random_state(n, 8, seed=n), random_input(n, 8)
    d = derivative(model, x, u)
    for k in range(8):
        a, dW, dw, tension = newton_euler(model, x, k)
        for got, expected in ((d.a[k], a), (d.dW[k], dW), (d.dw[k], dw), (d.tension[k], tension)):
            np.testing.assert_allclose(
                got, expected, rtol=0, atol=1e-12 * max(1.0, np.abs(expected).max())
            )


@pytest.mark.parametrize("n", [1, 3])
def test_a_wrench_on_the_payload_enters_newton_euler(n):
    model = random_model(n, seed=n)
    x, u = random_state(n, 4, seed=n), random_input(n, 4)
    wrench = np.array([0.5, -0.4, 0.3, 0.05, -0.06, 0.07])
    d = derivative(model, x, u, wrench)
    for k in range(4):
        a, dW, dw, tension = newton_euler(model, x, k, wrench)
        for got, expected in ((d.a[k], a), (d.dW[k], dW), (d.dw[k], dw), (d.tension[k], tension)):
            np.testing.assert_allclose(
                got, expected, rtol=0, atol=1e-12 * max(1.0, np.abs(expected).max())
            )


def test_thrust_follows_the_command_with_its_lag():
    model = random_model(2)
    x, u = random_state(2, 3), random_input(2, 3)
    np.testing.assert_allclose(derivative(model, x, u).dF, (u - x.F) / model.thrust_lag, rtol=1e-14)


def test_the_order_of_the_quadrotors_does_not_matter():
    model, x, u = random_model(4), random_state(4, 5), random_input(4, 5)
    order = [2, 0, 3, 1]
    shuffled = PayloadModelParameters(
        model.mass,
        model.inertia,
        model.p_LC[order],
        model.p_LLcm,
        model.quadrotor_mass[order],
        model.cable_length[order],
        model.thrust_lag[order],
    )
    d = derivative(model, x, u)
    e = derivative(
        shuffled, x._replace(xi=x.xi[:, order], w=x.w[:, order], F=x.F[:, order]), u[:, order]
    )
    np.testing.assert_allclose(e.a, d.a, atol=1e-12)
    np.testing.assert_allclose(e.tension, d.tension[:, order], atol=1e-12)
    np.testing.assert_allclose(e.dw, d.dw[:, order], atol=1e-11)


def test_retract_and_difference_are_inverse():
    x = random_state(3, 50)
    delta = np.random.default_rng(3).normal(0.0, 0.4, (50, 12 + 21))
    y = retract(x, delta)
    np.testing.assert_allclose(difference(x, y), delta, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(y.xi, axis=-1), 1.0, atol=1e-14)
    np.testing.assert_allclose((y.xi * y.w).sum(-1), 0.0, atol=1e-13)


def test_energy_is_kept_without_thrust():
    model = random_model(3)
    x = random_state(3, 4, seed=5, rates=0.5)._replace(F=np.zeros((4, 3, 3)))

    def energy(x):
        arms = model.arms @ np.swapaxes(x.R, 1, 2)
        contact = x.p[:, None] + arms
        omega = (x.R @ x.W[:, :, None])[:, :, 0]
        velocity = x.v[:, None] + np.cross(omega[:, None], arms)
        l = model.cable_length[:, None]
        quadrotor, speed = contact - l * x.xi, velocity - l * np.cross(x.w, x.xi)
        m = model.quadrotor_mass
        return (
            0.5 * model.mass * (x.v**2).sum(-1)
            + model.mass * GRAVITY * x.p[:, 2]
            + 0.5 * np.einsum("bi,ij,bj->b", x.W, model.inertia, x.W)
            + 0.5 * (m * (speed**2).sum(-1)).sum(-1)
            + GRAVITY * (m * quadrotor[:, :, 2]).sum(-1)
        )

    after = integrate(model, x, np.zeros((4, 3, 3)), 2e-4, 1000)
    drift = np.abs(energy(after) - energy(x))
    coarse = integrate(model, x, np.zeros((4, 3, 3)), 2e-3, 100)
    assert drift.max() < 1e-7
    # The remaining drift is the integrator's.
    assert np.abs(energy(coarse) - energy(x)).max() > 10 * drift.max()


def test_a_hanging_payload_pulls_with_its_weight():
    model = PayloadModelParameters(0.25, np.diag([0.006, 0.0059, 0.0107]), [[0.1, 0.0, 0.14]])
    a = model.arms[0] / np.linalg.norm(model.arms[0])
    R = matrix_from_quat(quat_from_two_vectors(a, np.array([0.0, 0.0, 1.0])))
    x = random_state(1, 1, rates=0.0)._replace(
        R=R[None], xi=np.array([[[0.0, 0.0, -1.0]]]), F=np.array([[[0.0, 0.0, 0.5 * GRAVITY]]])
    )
    d = derivative(model, x, x.F)
    assert d.tension[0, 0] == pytest.approx(0.25 * GRAVITY, rel=1e-12)
    for value in (d.a, d.dW, d.dw):
        np.testing.assert_allclose(value, 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mass": 0.0}, r"`mass` must be in \(0, inf\) kg, got 0"),
        (
            {"inertia": np.diag([0.006, 0.0059, 0.107])},
            "`inertia` must have positive principal moments",
        ),
        ({"inertia": np.ones((2, 2))}, "shape"),
        ({"cable_length": [0.5, 0.5]}, "`cable_length` must be of shape"),
        ({"quadrotor_mass": -1.0}, "`quadrotor_mass` must be positive"),
        ({"p_LC": np.zeros((0, 3))}, "p_LC"),
        ({"min_thrust": 8.0}, r"`min_thrust` must be in \[0, max_thrust\)"),
        ({"p_LLcm": [0.0, np.nan, 0.0]}, "finite"),
    ],
)
def test_impossible_parameters_are_refused(change, message):
    good = {"mass": 0.25, "inertia": np.diag([0.006, 0.0059, 0.0107]), "p_LC": [[0.0, 0.0, 0.14]]}
    with pytest.raises(InputError, match=message):
        PayloadModelParameters(**{**good, **change})


def test_rotation_vectors_and_matrices_are_inverse_up_to_a_half_turn():
    from scipy.spatial.transform import Rotation

    rng = np.random.default_rng(0)
    theta = rng.normal(size=(60, 3))
    theta *= (np.linspace(0.0, np.pi - 1e-3, 60) / np.linalg.norm(theta, axis=1))[:, None]
    for part in (theta, theta[:30]):
        R = rotation_exp(part)
        np.testing.assert_allclose(R, Rotation.from_rotvec(part).as_matrix(), atol=1e-14)
        np.testing.assert_allclose(rotation_log(R), part, atol=1e-12)


def test_tangent_bases_are_orthonormal_and_right_handed():
    xi = np.random.default_rng(0).normal(size=(200, 2, 3))
    xi /= np.linalg.norm(xi, axis=-1, keepdims=True)
    xi[0, 0] = [0.0, 0.0, -1.0]  # a hanging cable
    frame = np.concatenate([tangent_basis(xi), xi[..., None]], axis=-1)
    np.testing.assert_allclose(
        np.swapaxes(frame, -1, -2) @ frame, np.tile(np.eye(3), (200, 2, 1, 1)), atol=1e-9
    )
    assert np.linalg.det(frame).min() > 0.0


def test_transport_is_the_smallest_rotation():
    a, b, vector = np.random.default_rng(1).normal(size=(3, 100, 3))
    a, b = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (a, b))
    np.testing.assert_allclose(
        transport(a, b, vector), rotate(quat_from_two_vectors(a, b), vector), atol=1e-9
    )


def test_errors_are_what_their_order_says():
    x, n = random_state(2, 30), 2
    delta = np.random.default_rng(2).normal(0.0, 0.4, (30, 26))
    y, E = retract(x, delta), tangent_basis(x.xi)
    about = (E @ delta[:, 12:16].reshape(30, n, 2, 1))[..., 0]
    xi = rotate(quat_exp(about), x.xi)
    along = (E @ delta[:, 16:20].reshape(30, n, 2, 1))[..., 0]
    np.testing.assert_allclose(y.p - x.p, delta[:, 0:3], atol=1e-12)
    np.testing.assert_allclose(y.v - x.v, delta[:, 3:6], atol=1e-12)
    np.testing.assert_allclose(y.R, x.R @ matrix_from_quat(quat_exp(delta[:, 6:9])), atol=1e-12)
    np.testing.assert_allclose(y.W - x.W, delta[:, 9:12], atol=1e-12)
    np.testing.assert_allclose(y.xi, xi, atol=1e-12)
    np.testing.assert_allclose(y.w, rotate(quat_from_two_vectors(x.xi, xi), x.w + along), atol=1e-9)
    np.testing.assert_allclose((y.F - x.F).reshape(30, 6), delta[:, 20:], atol=1e-12)
    # With known tangent bases the result is the same.
    for got, field in zip(retract(x, delta, E), y):
        np.testing.assert_array_equal(got, field)


@pytest.mark.parametrize("size", [0.0, 1e-13, 1e-9, 1e-5])
def test_tiny_errors_keep_their_digits(size):
    x = random_state(2, 20)
    delta = size * np.random.default_rng(3).normal(size=(20, 26))
    np.testing.assert_allclose(difference(x, retract(x, delta)), delta, rtol=1e-6, atol=5e-15)
    theta = delta[:, 6:9]
    np.testing.assert_allclose(
        rotation_exp(theta) - np.eye(3), skew(theta) + 0.5 * skew(theta) @ skew(theta), atol=1e-15
    )
    np.testing.assert_allclose(rotation_log(rotation_exp(theta)), theta, rtol=1e-6, atol=1e-15)


def solved(model, x, u, time):
    """Integrate the Newton-Euler accelerations of one state in coordinates, to many digits."""
    from scipy.integrate import solve_ivp

    n = model.n
    sizes = np.cumsum([3, 3, 9, 3, 3 * n, 3 * n])

    def state(y):
        p, v, R, W, xi, w, F = np.split(y, sizes)
        shapes = (p, v, R.reshape(3, 3), W, xi.reshape(n, 3), w.reshape(n, 3), F.reshape(n, 3))
        return PayloadState(*(field[None] for field in shapes))

    def rate(_, y):
        at = state(y)
        a, dW, dw, _ = newton_euler(model, at, 0)
        R_rate = at.R[0] @ skew(at.W[0])
        F_rate = (u[0] - at.F[0]) / model.thrust_lag
        parts = (at.v[0], a, R_rate, dW, np.cross(at.w[0], at.xi[0]), dw, F_rate)
        return np.concatenate([part.ravel() for part in parts])

    start = np.concatenate([field[0].ravel() for field in x])
    return state(
        solve_ivp(rate, (0.0, time), start, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    )


@pytest.mark.parametrize("n", [1, 3])
def test_integration_is_of_fourth_order(n):
    model = random_model(n, seed=n)
    x, u = random_state(n, 1, seed=n), random_input(n, 1)
    exact = solved(model, x, u, 0.08)
    coarse, fine = (
        np.abs(difference(exact, integrate(model, x, u, 0.08 / k, k))).max() for k in (4, 8)
    )
    assert coarse < 1e-2
    assert fine < coarse / 11.0
