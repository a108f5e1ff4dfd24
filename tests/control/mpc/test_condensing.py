import numpy as np
from scipy.optimize import lsq_linear

from drake_aerial.control.mpc.condensing import BoxProgram, CondensedProblem, thrust_box
from drake_aerial.dynamics.discretization import DiscreteModel
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters


def test_the_condensed_minimum_solves_the_full_kkt_system():
    rng = np.random.default_rng(0)
    N, nx, nu = 6, 5, 2
    A, B, c = rng.normal(size=(N, nx, nx)), rng.normal(size=(N, nx, nu)), rng.normal(size=(N, nx))
    root = rng.normal(size=(N + 1, nx, nx))
    Q, q = root @ np.swapaxes(root, 1, 2), rng.normal(size=(N + 1, nx))
    R, r = rng.uniform(0.5, 2.0, (N, nu)), rng.normal(size=(N, nu))
    problem = CondensedProblem(N, nx, nu)
    H, g = problem.condense(
        DiscreteModel(np.concatenate([B, A, c[:, :, None]], axis=2)), Q, q, R, r
    )
    u = -np.linalg.solve(np.tril(H) + np.tril(H, -1).T, g)

    # Unknowns u_0 d_1 u_1 d_2 ...; constraints d_{k+1} - A d_k - B u_k = c with multipliers.
    size = N * (nu + nx)
    K, rhs = np.zeros((size + N * nx, size + N * nx)), np.zeros(size + N * nx)
    for k in range(N):
        iu, ix = k * (nu + nx), k * (nu + nx) + nu
        K[iu : iu + nu, iu : iu + nu], rhs[iu : iu + nu] = np.diag(R[k]), -r[k]
        K[ix : ix + nx, ix : ix + nx], rhs[ix : ix + nx] = Q[k + 1], -q[k + 1]
        row = slice(size + k * nx, size + (k + 1) * nx)
        K[row, ix : ix + nx], K[row, iu : iu + nu], rhs[row] = np.eye(nx), -B[k], c[k]
        if k:
            K[row, ix - nu - nx : ix - nu] = -A[k]
    K[:size, size:] = K[size:, :size].T
    exact = np.linalg.solve(K, rhs)[:size].reshape(N, nu + nx)
    np.testing.assert_allclose(u.reshape(N, nu), exact[:, :nu], atol=1e-8)
    np.testing.assert_allclose(problem.expand(u)[1:], exact[:, nu:], atol=1e-8)
    # Buffers are reused: a second problem must not see the first.
    H2, g2 = problem.condense(
        DiscreteModel(np.concatenate([B, A, c[:, :, None]], axis=2)), Q, q, R, r
    )
    np.testing.assert_allclose(-np.linalg.solve(np.tril(H2) + np.tril(H2, -1).T, g2), u, atol=1e-9)


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
