"""The motors' lag against the analytic step response."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput

from drake_aerial.errors import InputError
from drake_aerial.plant.motor_lag import MotorLag
from drake_aerial.plant.quadrotor import add_quadrotor, connect_propellers
from drake_aerial.plant.world import add_plant


def test_a_step_is_followed_exponentially_in_speed():
    builder = DiagramBuilder()
    lag = builder.AddSystem(MotorLag(2, 0.05, 0.002, [6000.0, 12000.0]))
    source = builder.AddSystem(ConstantVectorSource([12000.0**2, 8000.0**2]))
    builder.Connect(source.get_output_port(), lag.get_input_port())
    log = LogVectorOutput(lag.get_output_port(), builder, 0.01)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.3)
    found = log.FindLog(simulator.get_context())
    decay = np.exp(-np.array(found.sample_times()) / 0.05)
    expected = np.array([12000.0 - 6000.0 * decay, 8000.0 + 4000.0 * decay])
    assert np.sqrt(found.data()) == pytest.approx(expected, rel=1e-9)


def test_a_quadrotor_with_lag_rises_later():
    # v = 4 k/m int omega^2 - g t, from the lowest speed up to the commanded.
    tau, low, high, t = 0.1, 5500.0, 14000.0, 0.4
    builder = DiagramBuilder()
    plant, _ = add_plant(builder, 0.001)
    quadrotor = add_quadrotor(plant)
    plant.Finalize()
    commands, forces = connect_propellers(builder, plant, [quadrotor], motor_lag=tau)
    builder.Connect(forces, plant.get_applied_spatial_force_input_port())
    source = builder.AddSystem(ConstantVectorSource(np.full(4, high**2)))
    builder.Connect(source.get_output_port(), commands)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(t)
    context = plant.GetMyContextFromRoot(simulator.get_context())
    d, e1, e2 = high - low, np.exp(-t / tau), np.exp(-2 * t / tau)
    integral = high**2 * t - 2 * high * d * tau * (1 - e1) + d**2 * tau / 2 * (1 - e2)
    p = quadrotor.parameters
    expected = 4 * p.thrust_coefficient / p.mass * integral - 9.81 * t
    assert plant.GetVelocities(context)[5] == pytest.approx(expected, rel=0.01)
    assert expected < 0.8 * (4 * p.thrust_coefficient / p.mass * high**2 - 9.81) * t


@pytest.mark.parametrize("tau", [0.0, -0.1, np.inf])
def test_an_impossible_time_constant_is_refused(tau):
    with pytest.raises(InputError, match="time constant"):
        MotorLag(4, tau, 0.002)
