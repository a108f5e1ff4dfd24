import numpy as np
import pytest

from drake_aerial.dynamics.linearization import (
    DiscreteModel,
    change_chart,
    discretize,
    linearize,
    own_blocks,
    repeated,
)
from drake_aerial.dynamics.payload_model import (
    PayloadState,
    derivative,
    difference,
    integrate,
    retract,
    tangent_basis,
)
from drake_aerial.geometry import cross, matrix_from_quat, quat_exp
from tests.control.payload_cases import random_input, random_model, random_state


def one(x, k):
    return PayloadState(*(field[k : k + 1] for field in x))


def chart_velocity(model, x, delta, u, wrench=None, eps=1e-5):
    """The velocity of delta in the chart at x, for a batch of deltas, by differences of moved states."""
    batch = len(delta)
    at = PayloadState(*(np.repeat(field, batch, axis=0) for field in x))
    y = retract(at, delta)
    d = derivative(model, y, np.repeat(u, batch, axis=0), wrench)

    def moved(s):
        xi = y.xi + s * cross(y.w, y.xi)
        xi /= np.linalg.norm(xi, axis=-1, keepdims=True)
        w = y.w + s * d.dw
        w -= xi * (w * xi).sum(-1, keepdims=True)
        R = y.R @ matrix_from_quat(quat_exp(s * d.W))
        return PayloadState(y.p + s * d.v, y.v + s * d.a, R, y.W + s * d.dW, xi, w, y.F + s * d.dF)

    return (difference(at, moved(eps)) - difference(at, moved(-eps))) / (2 * eps)


WRENCH = np.array([0.5, -0.4, 0.3, 0.05, -0.06, 0.07])


@pytest.mark.parametrize(
    ("n", "wrench"), [(1, None), (2, None), (3, None), (1, WRENCH), (3, WRENCH)]
)
def test_jacobians_agree_with_finite_differences(n, wrench):
    model = random_model(n, seed=n)
    x, u = random_state(n, 4, seed=n), random_input(n, 4)
    linear = linearize(model, x, u, wrench=wrench)
    A, B = linear.full()
    step = 1e-4
    for k in range(4):
        columns = step * np.eye(12 + 7 * n)
        here = one(x, k)
        rate = chart_velocity(model, here, 0 * columns[:1], u[k : k + 1], wrench)[0]
        scale = np.abs(A[k]).max()
        np.testing.assert_allclose(linear.rate[k], rate, atol=1e-7 * scale)
        plus = chart_velocity(model, here, columns, u[k : k + 1], wrench)
        minus = chart_velocity(model, here, -columns, u[k : k + 1], wrench)
        np.testing.assert_allclose(A[k], (plus - minus).T / (2 * step), atol=2e-6 * scale)
    np.testing.assert_allclose(B[-3 * n :], np.diag(1.0 / model.thrust_lag.ravel()))
    np.testing.assert_array_equal(B[: -3 * n], 0.0)


@pytest.mark.parametrize("n", [1, 3])
def test_discretization_is_the_exponential_of_the_linear_model(n):
    from scipy.linalg import expm

    model = random_model(n, seed=n)
    x, u = random_state(n, 3, seed=n, rates=0.3), random_input(n, 3)
    linear = linearize(model, x, u)
    discrete = discretize(linear, 0.05)
    A, B = linear.full()
    nx, nu = B.shape
    for k in range(3):
        augmented = np.zeros((nx + nu + 1, nx + nu + 1))
        augmented[:nx] = np.hstack([A[k], B, linear.rate[k][:, None]])
        exact = expm(0.05 * augmented)
        np.testing.assert_allclose(discrete.Phi[k], exact[:nx, :nx], atol=1e-3)
        np.testing.assert_allclose(discrete.Gamma[k], exact[:nx, nx : nx + nu], atol=1e-3)
        np.testing.assert_allclose(discrete.drift[k], exact[:nx, -1], atol=1e-3)


@pytest.mark.parametrize("n", [1, 3])
def test_the_error_of_a_step_falls_with_the_square_of_its_length(n):
    model = random_model(n, seed=n)
    batch, eps = 4, 1e-5
    x, u = random_state(n, batch, seed=n, rates=0.5), random_input(n, batch)
    rng = np.random.default_rng(1)
    delta, du = rng.normal(size=(batch, 12 + 7 * n)), rng.normal(size=(batch, n, 3))
    errors = []
    for h in (0.02, 0.01):
        y = integrate(model, x, u, h / 40, 40)
        linear = linearize(model, x, u)
        step = change_chart(discretize(linear, h), x, linear.E, y, tangent_basis(y.xi))
        plus = integrate(model, retract(x, eps * delta), u + eps * du, h / 40, 40)
        minus = integrate(model, retract(x, -eps * delta), u - eps * du, h / 40, 40)
        exact = (difference(y, plus) - difference(y, minus)) / (2 * eps)
        change = step.Phi @ delta[..., None] + step.Gamma @ du.reshape(batch, -1, 1)
        errors.append((np.abs(step.drift).max(), np.abs(change[..., 0] - exact).max()))
    (drift, slope), (finer_drift, finer_slope) = errors
    assert finer_drift < drift / 5  # the exponential step is of second order: its error is of third
    assert finer_slope < slope / 3.2
    assert finer_slope < 0.03 * np.abs(exact).max()


def test_a_step_taken_several_times_is_a_longer_step():
    model = random_model(2, seed=2)
    x, u = random_state(2, 4, seed=2, rates=0.3), random_input(2, 4)
    linear = linearize(model, x, u)
    times = np.array([1, 2, 3, 2])
    taken = repeated(discretize(linear, 0.01), times)
    for k, count in enumerate(times):
        whole = discretize(linear, 0.01 * count)
        np.testing.assert_allclose(
            taken.flow[k], whole.flow[k], rtol=1e-5, atol=1e-6 * np.abs(whole.flow[k]).max()
        )


def exact_flow(linear, k, h):
    """Gamma, Phi and drift of one state's linear model side by side, by the matrix exponential."""
    from scipy.linalg import expm

    A, B = linear.full()
    nx, nu = B.shape
    augmented = np.zeros((nx + nu + 1, nx + nu + 1))
    augmented[:nx] = np.hstack([A[k], B, linear.rate[k][:, None]])
    whole = expm(h * augmented)[:nx]
    return np.hstack([whole[:, nx : nx + nu], whole[:, :nx], whole[:, -1:]])


@pytest.mark.parametrize("n", [1, 3])
def test_the_error_of_the_series_falls_with_the_eighth_power(n):
    model = random_model(n, seed=n)
    x, u = random_state(n, 3, seed=n, rates=0.3), random_input(n, 3)
    linear = linearize(model, x, u)
    errors = []
    for h in (0.02, 0.01):
        flow = discretize(linear, h).flow
        errors.append(max(np.abs(flow[k] - exact_flow(linear, k, h)).max() for k in range(3)))
    assert errors[0] < 1e-5
    assert errors[1] < errors[0] / 100.0


def test_own_blocks_are_the_cables_own_columns():
    rows = np.random.default_rng(0).normal(size=(4, 3, 2, 20))
    expected = np.stack([rows[:, i, :, 5 + 4 * i : 9 + 4 * i] for i in range(3)], axis=1)
    block = own_blocks(rows, 5, 4)
    np.testing.assert_array_equal(block, expected)
    block[:] = 0.0
    assert (rows == 0.0).sum() == expected.size
    np.testing.assert_array_equal(rows[:, 1, :, 9:13], 0.0)


@pytest.mark.parametrize("n", [1, 3])
def test_a_change_of_charts_is_exact_to_second_order_in_their_distance(n):
    x, rng = random_state(n, 6, seed=n, rates=0.5), np.random.default_rng(2)
    nx, nu, c = 12 + 7 * n, 3 * n, 12 + 2 * n
    direction = rng.normal(size=(6, nx))
    errors = []
    for size in (0.04, 0.02):
        y = retract(x, size * direction)
        E, E_y = tangent_basis(x.xi), tangent_basis(y.xi)
        # A step of no length: what it leads to is told by the charts alone.
        Gamma = rng.normal(size=(6, nx, nu))
        flow = np.concatenate([Gamma, np.tile(np.eye(nx), (6, 1, 1)), np.zeros((6, nx, 1))], axis=2)
        changed = change_chart(DiscreteModel(flow), x, E, y, E_y)
        there, eps, J = difference(x, y), 1e-6, np.empty((6, nx, nx))
        for k in range(nx):
            step = np.zeros((6, nx))
            step[:, k] = eps
            plus, minus = (difference(y, retract(x, there + s * step)) for s in (1.0, -1.0))
            J[:, :, k] = (plus - minus) / (2 * eps)
        # How a cable's rate is carried along depends on the way; that product of rate and distance is neglected.
        J[:, c : c + 2 * n, 12:c] = changed.Phi[:, c : c + 2 * n, 12:c]
        assert np.abs(J - np.eye(nx)).max() > 0.5 * size
        np.testing.assert_allclose(
            changed.drift, -(J @ there[:, :, None])[:, :, 0], atol=1e-5 * size
        )
        np.testing.assert_allclose(changed.Gamma, changed.Phi @ Gamma, atol=1e-12)
        errors.append(np.abs(changed.Phi - J).max())
    assert errors[0] < 0.04**2
    assert errors[1] < errors[0] / 3.5
