from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from drake_aerial.dynamics.discretization import (
    DiscreteModel,
    change_chart,
    discretize,
    repeated,
)
from drake_aerial.dynamics.linearization import linearize
from drake_aerial.dynamics.payload_model import retract, tangent_basis
from tests.control.payload_cases import (
    random_input,
    random_model,
    random_model_in_air,
    random_state,
)
from tests.dynamics.integration import difference, integrate


def exact_flow(linear, k, h):
    """Gamma, Phi and drift of state k's linear model, by the matrix exponential."""
    A, B = linear.full()
    nx, nu = B.shape
    augmented = np.zeros((nx + nu + 1, nx + nu + 1))
    augmented[:nx] = np.hstack([A[k], B, linear.rate[k][:, None]])
    whole = expm(h * augmented)[:nx]
    return np.hstack([whole[:, nx : nx + nu], whole[:, :nx], whole[:, -1:]])


@pytest.mark.parametrize("n", [1, 3])
@pytest.mark.parametrize("make", [random_model, random_model_in_air])
def test_discretization_is_the_exponential_of_the_linear_model(n, make):
    model = make(n, seed=n)
    x, u = random_state(n, 3, seed=n, rates=0.3), random_input(n, 3)
    linear = linearize(model, x, u)
    discrete = discretize(linear, 0.05)
    for k in range(3):
        np.testing.assert_allclose(
            discrete.flow[k], exact_flow(linear, k, 0.05), atol=2e-3 if model.air else 1e-3
        )


@pytest.mark.parametrize("lag", [0.028, 0.01, 1e-3, 1e-5])
def test_lags_shorter_than_the_step_are_discretised_exactly(lag):
    model = replace(random_model(2, seed=2), thrust_lag=[0.1, 0.1, lag])
    x, u = random_state(2, 3, seed=2, rates=0.3), random_input(2, 3)
    linear = linearize(model, x, u)
    discrete = discretize(linear, 0.05)
    for k in range(3):
        np.testing.assert_allclose(discrete.flow[k], exact_flow(linear, k, 0.05), atol=2e-3)


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
    # The exponential step is of second order, its error of third.
    assert finer_drift < drift / 5
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


@pytest.mark.parametrize("n", [1, 3])
def test_a_change_of_charts_is_exact_to_second_order_in_their_distance(n):
    x, rng = random_state(n, 6, seed=n, rates=0.5), np.random.default_rng(2)
    nx, nu, c = 12 + 7 * n, 3 * n, 12 + 2 * n
    direction = rng.normal(size=(6, nx))
    errors = []
    for size in (0.04, 0.02):
        y = retract(x, size * direction)
        E, E_y = tangent_basis(x.xi), tangent_basis(y.xi)
        # A step of length zero: only the charts change.
        Gamma = rng.normal(size=(6, nx, nu))
        flow = np.concatenate([Gamma, np.tile(np.eye(nx), (6, 1, 1)), np.zeros((6, nx, 1))], axis=2)
        changed = change_chart(DiscreteModel(flow), x, E, y, E_y)
        there, eps, J = difference(x, y), 1e-6, np.empty((6, nx, nx))
        for k in range(nx):
            step = np.zeros((6, nx))
            step[:, k] = eps
            plus, minus = (difference(y, retract(x, there + s * step)) for s in (1.0, -1.0))
            J[:, :, k] = (plus - minus) / (2 * eps)
        # The transport of a cable's rate depends on the path; this product of rate and distance
        # is neglected.
        J[:, c : c + 2 * n, 12:c] = changed.Phi[:, c : c + 2 * n, 12:c]
        assert np.abs(J - np.eye(nx)).max() > 0.5 * size
        np.testing.assert_allclose(
            changed.drift, -(J @ there[:, :, None])[:, :, 0], atol=1e-5 * size
        )
        np.testing.assert_allclose(changed.Gamma, changed.Phi @ Gamma, atol=1e-12)
        errors.append(np.abs(changed.Phi - J).max())
    assert errors[0] < 0.04**2
    assert errors[1] < errors[0] / 3.5
