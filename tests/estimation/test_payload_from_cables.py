import numpy as np
import pytest

from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.payload_from_cables import PayloadFromCables
from drake_aerial.geometry import matrix_from_quat, quat_exp, rotate

TRIANGLE = 0.3 * np.array([[1.0, 0.0, 0.3], [-0.5, 0.87, 0.3], [-0.5, -0.87, 0.3]])
LINE = np.array([[-0.3, 0.0, 0.1], [0.2, 0.0, 0.1]])
CENTRE = np.array([0.02, 0.01, -0.03])


def measured(p_LC, q, p, omega, v, directions, lengths):
    """Return the inputs that belong to a moving payload on taut cables, which do not turn."""
    states, cables = [], []
    for c, xi, length in zip(p_LC, directions, lengths, strict=True):
        arm = rotate(q, c)
        contact, rate = p + arm, v + np.cross(omega, arm)
        state = np.eye(1, 13)[0]
        state[4:7], state[10:13] = contact - length * xi, rate
        states.append(state)
        cables.append(np.concatenate([xi, np.zeros(3)]))
    return np.concatenate(states), np.concatenate(cables)


def estimate(model, states, cables):
    system = PayloadFromCables(model)
    context = system.CreateDefaultContext()
    system.GetInputPort("quadrotor_states").FixValue(context, states)
    system.GetInputPort("cable_directions").FixValue(context, cables)
    return system.GetOutputPort("payload_state").Eval(context)


def test_three_cables_give_the_pose_and_the_velocities_of_any_motion():
    rng = np.random.default_rng(0)
    model = PayloadModelParameters(0.6, 0.03 * np.eye(3), TRIANGLE, CENTRE, cable_length=0.7)
    for _ in range(20):
        q = quat_exp(0.5 * rng.standard_normal(3))
        p, omega, v = rng.standard_normal((3, 3))
        directions = rng.standard_normal((3, 3)) * 0.2 - [0.0, 0.0, 1.0]
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        inputs = measured(TRIANGLE, q, p, omega, v, directions, [0.7] * 3)
        found = estimate(model, *inputs)
        np.testing.assert_allclose(matrix_from_quat(found[0:4]), matrix_from_quat(q), atol=1e-9)
        np.testing.assert_allclose(found[4:7], p, atol=1e-9)
        np.testing.assert_allclose(found[7:10], omega, atol=1e-4)
        np.testing.assert_allclose(found[10:13], v, atol=1e-4)


@pytest.mark.parametrize("p_LC", [LINE, LINE[:1]])
def test_a_payload_at_rest_on_one_or_two_cables_hangs_below_them(p_LC):
    n = len(p_LC)
    centre = p_LC.mean(axis=0) + [0.0, 0.1, -0.2]
    model = PayloadModelParameters(0.3, 0.01 * np.eye(3), p_LC, centre)
    # The centre of mass is straight below: turned about the line of the contacts, x.
    q = quat_exp([np.arctan2(0.1, 0.2) * -1.0, 0.0, 0.0])
    inputs = measured(
        p_LC,
        q,
        np.array([1.0, 2.0, 3.0]),
        np.zeros(3),
        np.zeros(3),
        np.tile([0.0, 0.0, -1.0], (n, 1)),
        [0.5] * n,
    )
    found = estimate(model, *inputs)
    np.testing.assert_allclose(matrix_from_quat(found[0:4]), matrix_from_quat(q), atol=1e-9)
    np.testing.assert_allclose(found[4:7], [1.0, 2.0, 3.0], atol=1e-9)
    np.testing.assert_allclose(found[7:13], 0.0, atol=1e-9)
