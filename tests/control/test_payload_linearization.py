import numpy as np
import pytest
from payload_cases import random_input, random_model, random_state

from drake_aerial.control.payload_linearization import change_chart, discretize, linearize, repeated
from drake_aerial.control.payload_model import (
    PayloadState,
    derivative,
    difference,
    integrate,
    retract,
    tangent_basis,
)
from drake_aerial.geometry import cross, matrix_from_quat, quat_exp


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


@pytest.mark.parametrize(("n", "wrench"), [(1, None), (2, None), (3, None), (1, WRENCH), (3, WRENCH)])
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
        np.testing.assert_allclose(taken.flow[k], whole.flow[k], rtol=1e-5, atol=1e-6 * np.abs(whole.flow[k]).max())
