import numpy as np
from scipy.optimize import lsq_linear

from drake_aerial.control.mpc.box_program import BoxProgram, thrust_box
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters


def test_the_program_with_bounds_is_solved_to_its_minimum():
    program = BoxProgram()
    rng = np.random.default_rng(0)
    for _ in range(20):
        root = rng.normal(size=(14, 12))
        H, g = root.T @ root + 0.1 * np.eye(12), 3.0 * rng.normal(size=12)
        low, high = -rng.uniform(0.1, 1.0, 12), rng.uniform(0.1, 1.0, 12)
        got, iterations, active = program.solve(np.tril(H), g, low, high)
        L = np.linalg.cholesky(H)
        exact = lsq_linear(L.T, -np.linalg.solve(L, g), (low, high), tol=1e-14).x
        np.testing.assert_allclose(got, exact, atol=1e-4)
        assert (iterations > 0) == (active > 0)


def test_the_box_lets_a_quadrotor_tilt_by_45_degrees():
    low, high = thrust_box(
        PayloadModelParameters(0.25, np.eye(3), np.eye(3), max_thrust=[5.0, 6.0, 7.0])
    )
    np.testing.assert_allclose(high.reshape(3, 3)[:, 2], [5.0, 6.0, 7.0])
    np.testing.assert_allclose(low.reshape(3, 3)[:, 0], -np.array([5.0, 6.0, 7.0]) / np.sqrt(2.0))


def test_a_program_that_is_not_finite_has_no_solution():
    H, g, bound = np.eye(3), np.array([0.0, np.nan, 0.0]), np.ones(3)
    solution, iterations, active = BoxProgram().solve(H, g, -bound, bound)
    assert np.isnan(solution).all()
    assert (iterations, active) == (0, 0)
