import numpy as np
import pytest

from drake_aerial.estimation.delay_compensation import DelayCompensation
from drake_aerial.estimation.sensor_parameters import Measurement, SensorParameters
from drake_aerial.estimation.sensor_suite import SensorSuite
from drake_aerial.geometry import matrix_from_quat, quat_exp, quat_multiply
from drake_aerial.statics.gravity import GRAVITY

DELAY = 0.02
LATE = SensorParameters(
    **{
        name: Measurement(delay=0.0 if name in ("specific_force", "quadrotor_rate") else DELAY)
        for name in SensorParameters.__dataclass_fields__
        if name != "level"
    }
)
RATE, VELOCITY, ACCELERATION = np.array([0.3, -0.5, 0.8]), np.array([1.0, 2.0, -0.5]), 3.0


def state_at(t, acceleration):
    """Return a body that turns at a constant rate and accelerates along x."""
    q = quat_multiply(quat_exp(RATE * t), quat_exp([0.1, 0.2, 0.3]))
    a = np.array([acceleration, 0.0, 0.0])
    return np.concatenate([q, VELOCITY * t + 0.5 * a * t**2, RATE, VELOCITY + a * t])


@pytest.fixture
def outputs():
    now = DelayCompensation(SensorSuite(np.zeros((1, 3)), LATE), np.array([[0.0, 0.0, 0.1]]))
    context = now.CreateDefaultContext()
    late = state_at(0.0, ACCELERATION)
    R = matrix_from_quat(late[0:4])
    force = R.T @ [ACCELERATION, 0.0, GRAVITY]
    now.GetInputPort("payload_state").FixValue(context, state_at(0.0, 0.0))
    now.GetInputPort("quadrotor_states").FixValue(context, late)
    now.GetInputPort("imu").FixValue(context, np.concatenate([force, R.T @ RATE]))
    return {
        name: now.GetOutputPort(name).Eval(context)
        for name in ("payload_state", "quadrotor_states", "cable_directions")
    }


def test_a_payload_at_constant_velocity_is_where_it_was_extrapolated_to(outputs):
    np.testing.assert_allclose(outputs["payload_state"], state_at(DELAY, 0.0), atol=1e-12)


def test_an_accelerating_quadrotor_is_extrapolated_by_its_accelerometer(outputs):
    np.testing.assert_allclose(
        outputs["quadrotor_states"], state_at(DELAY, ACCELERATION), atol=1e-12
    )


def test_cable_directions_belong_to_the_extrapolated_states(outputs):
    payload, quadrotor = outputs["payload_state"], outputs["quadrotor_states"]
    contact = payload[4:7] + matrix_from_quat(payload[0:4]) @ [0.0, 0.0, 0.1]
    xi = contact - quadrotor[4:7]
    np.testing.assert_allclose(outputs["cable_directions"][0:3], xi / np.linalg.norm(xi))
