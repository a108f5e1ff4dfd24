import time

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drake_aerial.control.attitude import RATE_GAIN, ROTATION_GAIN, AttitudeController
from drake_aerial.errors import InputError
from drake_aerial.geometry import random_rotation
from tests.control.test_allocation import CROSS

J = np.array([[6e-4, 2e-5, 0.0], [2e-5, 5e-4, 1e-5], [0.0, 1e-5, 1e-3]])


def evaluate(system, states, thrusts):
    context = system.CreateDefaultContext()
    system.GetInputPort("quadrotor_states").FixValue(context, np.ravel(states))
    system.GetInputPort("thrust_vectors").FixValue(context, np.ravel(thrusts))
    return {
        name: system.GetOutputPort(name).Eval(context)
        for name in ("propeller_commands", "saturated", "thrusts", "moments")
    }


def law(state, u):
    """The law with matrices, written independently of the system's scalar code."""
    R = Rotation.from_quat(np.roll(state[:4], -1)).as_matrix()
    W = R.T @ state[7:10]
    z = u / np.linalg.norm(u)
    y = np.cross(z, [1.0, 0.0, 0.0])
    y /= np.linalg.norm(y)
    Rd = np.stack([np.cross(y, z), y, z], axis=1)
    E = 0.5 * (Rd.T @ R - R.T @ Rd)
    e = np.array([E[2, 1], E[0, 2], E[1, 0]])
    return u @ R[:, 2], -np.array(ROTATION_GAIN) * e - np.array(RATE_GAIN) * W + np.cross(W, J @ W)


def test_the_law_for_several_quadrotors():
    rng = np.random.default_rng(2)
    n = 4
    states = np.zeros((n, 13))
    states[:, :4] = [
        Rotation.from_rotvec(v).as_quat()[[3, 0, 1, 2]] for v in rng.normal(0, 0.05, (n, 3))
    ]
    states[:, 7:10] = rng.normal(0, 0.2, (n, 3))
    u = rng.normal(0.0, 0.1, (n, 3)) + [0.0, 0.0, 4.0]
    out = evaluate(AttitudeController([CROSS] * n, J), states, u)
    assert not out["saturated"].any()
    for i in range(n):
        thrust, moment = law(states[i], u[i])
        assert out["thrusts"][i] == pytest.approx(thrust, rel=1e-9)
        np.testing.assert_allclose(out["moments"][3 * i : 3 * i + 3], moment, atol=1e-10)


def test_a_quadrotor_turns_to_its_thrust_vector_from_anywhere():
    """Closed loop of a rigid body: from random attitudes to the commanded axis within 2 s."""
    rng = np.random.default_rng(3)
    system = AttitudeController([CROSS], np.diag([6e-4, 5e-4, 1e-3]))
    inertia = np.diag([6e-4, 5e-4, 1e-3])
    u = np.array([1.0, -0.6, 4.0])
    for tilt in (0.5, 1.5, 2.5):
        axis = rng.normal(size=3) * [1, 1, 0]
        R, W = Rotation.from_rotvec(tilt * axis / np.linalg.norm(axis)), np.zeros(3)
        for _ in range(1500):
            state = np.zeros(13)
            state[:4] = np.roll(R.as_quat(), 1)
            state[7:10] = R.apply(W)
            moment = evaluate(system, state, u)["moments"]
            W = W + 2e-3 * np.linalg.solve(inertia, moment - np.cross(W, inertia @ W))
            R = R * Rotation.from_rotvec(2e-3 * W)
        np.testing.assert_allclose(R.as_matrix()[:, 2], u / np.linalg.norm(u), atol=1e-3)
        assert abs(R.as_matrix()[0, 1]) < 1e-3  # yaw zero: y is normal to the world's x


def test_commands_below_the_horizon_do_not_turn_a_quadrotor_over():
    state = np.zeros(13)
    state[0] = 1.0
    out = evaluate(AttitudeController([CROSS], J), state, [0.0, 0.0, -3.0])
    np.testing.assert_allclose(out["moments"], 0.0, atol=1e-9)
    assert out["thrusts"][0] == pytest.approx(CROSS.min_thrust)
    assert out["saturated"][0] == 1.0


def test_a_wrong_inertia_shape_is_refused():
    with pytest.raises(InputError, match="inertia"):
        AttitudeController([CROSS], np.ones(3))


def test_an_evaluation_is_fast_enough_for_500_hz():
    system = AttitudeController([CROSS], J)
    context = system.CreateDefaultContext()
    state = np.concatenate([random_rotation(np.random.default_rng(0)), np.zeros(9)])
    system.GetInputPort("quadrotor_states").FixValue(context, state)
    port = system.GetOutputPort("propeller_commands")
    seconds = []
    for k in range(300):
        system.GetInputPort("thrust_vectors").FixValue(context, [0.1, 0.001 * k, 4.0])
        begin = time.perf_counter()
        port.Eval(context)
        seconds.append(time.perf_counter() - begin)
    # About 2.5e-5 s on an idle core; the bound catches changes by an order of magnitude.
    assert np.median(seconds) < 2e-4
