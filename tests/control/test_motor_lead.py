"""Compensated motors against the desired first-order response, and the attitude loop's margins."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput

from drake_aerial.control.attitude import RATE_GAIN, ROTATION_GAIN
from drake_aerial.control.motor_lead import RESPONSE, MotorLead
from drake_aerial.errors import InputError
from drake_aerial.plant.motor_lag import MotorLag
from tests.control.test_allocation import CROSS

STEP = 0.002


def respond(tau, wanted, begin, seconds, led=True):
    """Times and speeds (T, 4) of the motors, and what they were commanded."""
    builder = DiagramBuilder()
    lag = builder.AddSystem(MotorLag(4, tau, STEP, begin))
    lead = builder.AddSystem(MotorLead([CROSS], tau, STEP))
    source = builder.AddSystem(ConstantVectorSource(np.square(wanted)))
    builder.Connect(source.get_output_port(), lead.get_input_port())
    builder.Connect((lead if led else source).get_output_port(), lag.get_input_port())
    logs = [LogVectorOutput(system.get_output_port(), builder, STEP) for system in (lag, lead)]
    simulator = Simulator(builder.Build())
    lead.set_speeds(
        lead.GetMyMutableContextFromRoot(simulator.get_mutable_context()), np.broadcast_to(begin, 4)
    )
    simulator.AdvanceTo(seconds)
    speed, command = (np.sqrt(log.FindLog(simulator.get_context()).data().T) for log in logs)
    return STEP * np.arange(len(speed)), speed, command


@pytest.mark.parametrize("tau", [0.02, 0.05, 0.08])
def test_small_changes_are_followed_within_the_response_time_whatever_the_lag(tau):
    begin = 0.5 * (CROSS.min_rpm + CROSS.max_rpm)
    wanted = begin + np.array([100.0, -100.0, 50.0, 0.0])
    t, speed, _ = respond(tau, wanted, begin, 0.1)
    expected = wanted + (begin - wanted) * np.exp(-t / RESPONSE)[:, None]
    np.testing.assert_allclose(speed, expected, atol=1e-6)


def test_large_changes_are_as_fast_as_the_limits_let_them_and_do_not_overshoot():
    low, high = CROSS.min_rpm, CROSS.max_rpm
    wanted = low + 0.9 * (high - low)
    _, speed, command = respond(0.05, np.full(4, wanted), low, 0.5)
    _, alone, _ = respond(0.05, np.full(4, wanted), low, 0.5, led=False)
    assert command.max() == pytest.approx(high)
    assert ((command >= low - 1e-6) & (command <= high + 1e-6)).all()
    assert speed.max() <= wanted + 1e-6
    assert (
        np.argmax(speed > 0.95 * wanted, axis=0) < np.argmax(alone > 0.95 * wanted, axis=0)
    ).all()


def test_motors_faster_than_the_response_are_left_alone():
    wanted = CROSS.min_rpm + np.array([10.0, 200.0, 300.0, 0.0])
    _, _, command = respond(0.005, wanted, CROSS.min_rpm, 0.05)
    np.testing.assert_allclose(command, np.tile(wanted, (len(command), 1)))


def test_the_tables_attitude_loop_bears_a_lag_of_rate_gain_over_rotation_gain():
    """J tau s^3 + J s^2 + D s + K is stable for tau < D / K by Routh, whatever the inertia J."""
    for K, D, J in zip(ROTATION_GAIN, RATE_GAIN, (6e-4, 5e-4, 1e-3), strict=True):
        for tau, stable in ((0.98 * D / K, True), (1.02 * D / K, False)):
            assert (np.roots([J * tau, J, D, K]).real < 0.0).all() == stable


@pytest.mark.parametrize("bad", [{"time_constant": 0.0}, {"period": -1.0}, {"response": np.nan}])
def test_impossible_times_are_refused(bad):
    with pytest.raises(InputError, match=f"`{next(iter(bad))}` must be"):
        MotorLead([CROSS], **{"time_constant": 0.05, "period": STEP, **bad})
