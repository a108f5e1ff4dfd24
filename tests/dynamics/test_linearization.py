import numpy as np
import pytest

from drake_aerial.dynamics.linearization import linearize, own_blocks
from drake_aerial.dynamics.payload_model import PayloadState, derivative, retract
from drake_aerial.geometry import cross, matrix_from_quat, quat_exp
from tests.control.payload_cases import (
    random_input,
    random_model,
    random_model_in_air,
    random_state,
)
from tests.dynamics.integration import difference


def one(x, k):
    return PayloadState(*(field[k : k + 1] for field in x))


def chart_velocity(model, x, delta, u, wrench=None, wind=None, eps=1e-5):
    """The velocity of each delta in the chart at x, by differences of moved states."""
    batch = len(delta)
    at = PayloadState(*(np.repeat(field, batch, axis=0) for field in x))
    y = retract(at, delta)
    d = derivative(model, y, np.repeat(u, batch, axis=0), wrench, wind)

    def moved(s):
        xi = y.xi + s * cross(y.w, y.xi)
        xi /= np.linalg.norm(xi, axis=-1, keepdims=True)
        w = y.w + s * d.dw
        w -= xi * (w * xi).sum(-1, keepdims=True)
        R = y.R @ matrix_from_quat(quat_exp(s * d.W))
        return PayloadState(y.p + s * d.v, y.v + s * d.a, R, y.W + s * d.dW, xi, w, y.F + s * d.dF)

    return (difference(at, moved(eps)) - difference(at, moved(-eps))) / (2 * eps)


WRENCH = np.array([0.5, -0.4, 0.3, 0.05, -0.06, 0.07])
WIND = np.array([4.0, -2.0, 0.5])


@pytest.mark.parametrize(
    ("n", "wrench", "wind"),
    [
        (1, None, None),
        (2, None, None),
        (3, None, None),
        (1, WRENCH, None),
        (3, WRENCH, None),
        (1, None, WIND),
        (3, WRENCH, WIND),
    ],
)
def test_jacobians_agree_with_finite_differences(n, wrench, wind):
    model = random_model(n, seed=n) if wind is None else random_model_in_air(n, seed=n)
    x, u = random_state(n, 4, seed=n), random_input(n, 4)
    linear = linearize(model, x, u, wrench=wrench, wind=wind)
    A, B = linear.full()
    step = 1e-4
    for k in range(4):
        columns = step * np.eye(12 + 7 * n)
        here = one(x, k)
        rate = chart_velocity(model, here, 0 * columns[:1], u[k : k + 1], wrench, wind)[0]
        scale = np.abs(A[k]).max()
        np.testing.assert_allclose(linear.rate[k], rate, atol=1e-7 * scale)
        plus = chart_velocity(model, here, columns, u[k : k + 1], wrench, wind)
        minus = chart_velocity(model, here, -columns, u[k : k + 1], wrench, wind)
        np.testing.assert_allclose(A[k], (plus - minus).T / (2 * step), atol=2e-6 * scale)
    np.testing.assert_allclose(B[-3 * n :], np.diag(1.0 / model.thrust_lag.ravel()))
    np.testing.assert_array_equal(B[: -3 * n], 0.0)


def test_own_blocks_are_the_cables_own_columns():
    rows = np.random.default_rng(0).normal(size=(4, 3, 2, 20))
    expected = np.stack([rows[:, i, :, 5 + 4 * i : 9 + 4 * i] for i in range(3)], axis=1)
    block = own_blocks(rows, 5, 4)
    np.testing.assert_array_equal(block, expected)
    block[:] = 0.0
    assert (rows == 0.0).sum() == expected.size
    np.testing.assert_array_equal(rows[:, 1, :, 9:13], 0.0)
