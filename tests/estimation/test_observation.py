import numpy as np

from drake_aerial.estimation.observation import FilterState, PositionFilter, observe


def test_the_filter_is_unbiased_and_much_quieter_than_the_measurement():
    rng = np.random.default_rng(0)
    kalman, dt = PositionFilter(0.01), 0.02
    state = FilterState.initial()
    errors = []
    for k in range(3000):
        t = k * dt
        p = np.array([np.cos(t), np.sin(t), 0.1 * t])
        v = np.array([-np.sin(t), np.cos(t), 0.1])
        state = kalman.step(state, p + 0.01 * rng.standard_normal(3), v, dt)
        errors.append(state.p - p)
    settled = np.array(errors[200:])
    assert np.sqrt((settled**2).mean()) < 0.0015
    # The mean of white measurements scatters by sigma / sqrt(count); four times that is no chance.
    assert np.abs(settled.mean(0)).max() < 4 * 0.01 / np.sqrt(len(settled))


def test_without_noise_the_measurement_is_taken_as_it_is():
    kalman = PositionFilter(0.0)
    state = FilterState.initial()
    for k in range(3):
        p = np.array([k, -k, 2.0 * k])
        state = kalman.step(state, p, np.ones(3), 0.02)
        np.testing.assert_array_equal(state.p, p)


def test_rates_and_axes_are_read_in_their_frames():
    half = np.sqrt(0.5)
    payload = np.array([half, 0, 0, half, 1, 2, 3, 0.1, 0.2, 0.3, 4, 5, 6.0])  # yawed by 90 deg
    quadrotor = np.array([half, half, 0, 0, 7, 8, 9, 0, 0, 0, 1, 1, 1.0])  # rolled by 90 deg
    observation = observe(payload, quadrotor, np.array([0, 0, -2.0, 0.5, 0.0, 0.3]))
    np.testing.assert_allclose(observation.W, [0.2, -0.1, 0.3], atol=1e-12)
    np.testing.assert_allclose(observation.z_WQ, [[0, -1, 0]], atol=1e-12)
    np.testing.assert_allclose(observation.xi, [[0, 0, -1]])
    # The part along the cable is no rotation.
    np.testing.assert_allclose(observation.xi_dot, [[0.5, 0, 0]])
    np.testing.assert_allclose(
        np.cross(observation.w, observation.xi), observation.xi_dot, atol=1e-15
    )


def test_an_observation_is_extrapolated_along_a_steady_motion():
    # Payload, quadrotor and cable turn about one axis at one rate: a rigid motion, known exactly.
    rate, dt = 1.3, 0.004

    def state(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        c, s = np.cos(rate * t), np.sin(rate * t)
        payload = [
            np.cos(rate * t / 2),
            0,
            0,
            np.sin(rate * t / 2),
            c,
            s,
            0,
            0,
            0,
            rate,
            -rate * s,
            rate * c,
            0,
        ]
        quadrotor = [1, 0, 0, 0, 2 * c, 2 * s, 1, 0, 0, 0, -2 * rate * s, 2 * rate * c, 0]
        xi, xi_dot = [-0.6 * c, -0.6 * s, -0.8], [0.6 * rate * s, -0.6 * rate * c, 0]
        return np.array(payload), np.array(quadrotor), np.array([*xi, *xi_dot])

    later, exact = observe(*state(0.0)).after(dt), observe(*state(dt))
    # The error is of second order in the angle.
    bound = (rate * dt) ** 2
    for name in ("p", "R", "p_WQ", "xi"):
        np.testing.assert_allclose(
            getattr(later, name), getattr(exact, name), atol=bound, err_msg=name
        )
    np.testing.assert_allclose(later.R @ later.R.T, np.eye(3), atol=bound**2)
    np.testing.assert_allclose(np.linalg.norm(later.xi, axis=1), 1.0, atol=1e-12)


def test_a_filter_state_comes_back_from_its_vector():
    state = FilterState.unpack(np.arange(7.0))
    assert (state.p.tolist(), state.v.tolist(), state.variance) == ([0, 1, 2], [3, 4, 5], 6)
    np.testing.assert_array_equal(state.pack(), np.arange(7.0))
