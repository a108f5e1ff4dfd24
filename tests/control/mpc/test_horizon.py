"""Weights and time shifts of a horizon; samples that are linear in time are the oracle."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

from drake_aerial.control.mpc.horizon import Horizon, normalized, pack, shifting, unpack
from drake_aerial.dynamics.payload_model import retract
from tests.control.payload_cases import random_state

STEP = 0.05
STAGES = [(1, 1, 2, 3), (2, 1), 5]


def horizon(stages, ahead=0.02, lag=0.008):
    return Horizon(stages, STEP, ahead, lag)


@pytest.mark.parametrize("stages", STAGES)
def test_steps_follow_each_other(stages):
    units = [1] * stages if isinstance(stages, int) else list(stages)
    h = horizon(stages)
    assert len(h) == len(units)
    assert h.step == STEP
    np.testing.assert_array_equal(h.units, units)
    np.testing.assert_array_equal(h.ends, [sum(units[:k]) for k in range(len(units) + 1)])


@pytest.mark.parametrize("stages", STAGES)
def test_states_count_for_the_time_they_stand_for(stages):
    h = horizon(stages)
    # By the trapezoidal rule: the integral of the hat over a state's neighbours.
    t = np.linspace(0.0, h.ends[-1], 1001 * h.ends[-1])
    for k in range(1, len(h)):
        hat = np.interp(t, h.ends, np.eye(len(h) + 1)[k])
        assert h.shares[k] == pytest.approx(trapezoid(hat, t), rel=1e-3)
    assert h.shares[-1] == 1.0


@pytest.mark.parametrize("stages", STAGES)
def test_inputs_are_averaged_over_their_steps(stages):
    h = horizon(stages)
    assert h.means.shape == (len(h), h.ends[-1])
    inputs = np.random.default_rng(0).normal(size=h.ends[-1])
    expected = [inputs[a:b].mean() for a, b in zip(h.ends[:-1], h.ends[1:])]
    np.testing.assert_allclose(h.means @ inputs, expected, atol=1e-14)


@pytest.mark.parametrize("stages", STAGES)
@pytest.mark.parametrize("ahead", [0.0, 0.02, 0.05, 0.12])
def test_a_plan_that_is_linear_in_time_moves_on_exactly(stages, ahead):
    h = Horizon(stages, STEP, ahead, lag=0.4 * ahead)
    t = STEP * h.ends
    line = 3.0 - 2.0 * t
    np.testing.assert_allclose(h.shift_states @ line, line - 2.0 * ahead, atol=1e-12)
    # What happens within the lag, before the plan begins.
    assert h.lag_change @ line == pytest.approx(-2.0 * 0.4 * ahead, abs=1e-12)
    assert h.lag_change @ np.ones(len(t)) == pytest.approx(0.0, abs=1e-12)
    middle = 0.5 * (t[:-1] + t[1:])
    np.testing.assert_allclose(h.shift_inputs @ middle, middle + ahead, atol=1e-12)


def test_between_samples_a_plan_is_interpolated_and_beyond_them_extrapolated():
    times = np.array([0.0, 1.0, 3.0, 4.0])
    values = np.random.default_rng(1).normal(size=4)
    for ahead in (0.0, 0.3, 1.0, 1.7):
        got, at = shifting(times, ahead) @ values, times + ahead
        inside = at <= 4.0
        np.testing.assert_allclose(got[inside], np.interp(at[inside], times, values), atol=1e-12)
        slope = values[3] - values[2]
        np.testing.assert_allclose(
            got[~inside], values[3] + slope * (at[~inside] - 4.0), atol=1e-12
        )


def test_two_stages_are_enough():
    assert len(Horizon(2, STEP, 0.02)) == len(Horizon((1, 1), STEP, 0.02)) == 2


@pytest.mark.parametrize("n", [1, 3])
def test_states_fit_in_rows(n):
    x = random_state(n, 4, seed=n)
    rows = pack(x)
    assert rows.shape == (4, 18 + 9 * n)
    back = unpack(rows, n)
    for got, field in zip(back, x):
        np.testing.assert_array_equal(got, field)
    assert back.F.base is not None  # views


def test_blended_states_return_to_their_manifold():
    # Two states 0.2 rad apart; their mean lies beside the manifold by that squared, over eight.
    x = random_state(2, 20, seed=5, rates=0.3)
    rng = np.random.default_rng(0)
    y = retract(x, 0.05 * rng.normal(size=(20, 26)))
    blend = unpack(0.5 * (pack(x) + pack(y)), 2)
    got = normalized(blend)
    np.testing.assert_allclose(np.linalg.norm(got.xi, axis=-1), 1.0, atol=1e-14)
    np.testing.assert_allclose((got.xi * got.w).sum(-1), 0.0, atol=1e-14)
    before, after = (s.R @ np.swapaxes(s.R, 1, 2) - np.eye(3) for s in (blend, got))
    assert np.abs(after).max() < 2.0 * np.abs(before).max() ** 2
    for name in ("p", "v", "W", "F"):
        np.testing.assert_array_equal(getattr(got, name), getattr(blend, name))
    assert np.abs(got.w - blend.w).max() < 0.05
    # A state of the model is left where it is.
    for got_field, field in zip(normalized(x), x):
        np.testing.assert_allclose(got_field, field, atol=1e-13)
