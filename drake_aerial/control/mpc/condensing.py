"""The condensed quadratic program of the MPC, and its solution within bounds of the thrusts."""

from typing import Any

import numpy as np
import piqp
from scipy.linalg import lapack

from drake_aerial.dynamics.discretization import DiscreteModel
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.geometry import Array


class BoxProgram:
    """Solver of min 1/2 u^T H u + g^T u over low <= u <= high, for programs of one size.

    If the unconstrained minimum respects the bounds it is the solution; otherwise PIQP solves the
    program. PIQP's workspace is kept between calls.
    """

    def __init__(self) -> None:
        self._qp: Any = None

    def solve(self, H: Array, g: Array, low: Array, high: Array) -> tuple[Array, int, int]:
        """Return the solution, the number of iterations, and the number of active bounds.

        Parameters
        ----------
        H : (m, m) array
            Only its lower triangle is read.
        g, low, high : (m,) arrays

        Returns
        -------
        solution : (m,) array
            NaN if H or g is not finite.
        iterations, active : int
            0 if no bound is active.
        """
        _, solution, failed = lapack.dposv(H.T, -g, lower=0)
        if not failed and (solution >= low).all() and (solution <= high).all():
            return solution, 0, 0
        if not (np.isfinite(H).all() and np.isfinite(g).all()):
            return np.full(len(g), np.nan), 0, 0
        H = np.tril(H) + np.tril(H, -1).T
        if self._qp is None:
            self._qp = piqp.DenseSolver()
            self._qp.settings.eps_abs = self._qp.settings.eps_rel = 1e-6
            self._qp.setup(H, g, x_l=low, x_u=high)
        else:
            self._qp.update(P=H, c=g, x_l=low, x_u=high)
        self._qp.solve()
        solution = np.clip(self._qp.result.x, low, high)
        active = int(((solution - low < 1e-4) | (high - solution < 1e-4)).sum())
        return solution, int(self._qp.result.info.iter), active


def thrust_box(model: PayloadModelParameters) -> Array:
    """Return the bounds of the commanded thrust vectors, (2, 3 n) [N].

    Sideways, a thrust vector may be tilted by up to 45 deg at full thrust.
    """
    side = np.sqrt(0.5) * model.max_thrust
    low = np.stack([-side, -side, model.min_thrust], axis=1)
    high = np.stack([side, side, model.max_thrust], axis=1)
    return np.stack([low.ravel(), high.ravel()])


class CondensedProblem:
    """Condensed form of a linear-quadratic problem, with its buffers.

    The problem is min sum_k 1/2 d_k^T Q_k d_k + q_k^T d_k + 1/2 u_k^T R_k u_k + r_k^T u_k over
    d_{k+1} = A_k d_k + B_k u_k + c_k with d_0 = 0, the measured state. The Hessian is built
    backwards through the horizon, in O(N^2) products of small matrices.

    Parameters
    ----------
    stages, nx, nu : int
        Number N of steps, and sizes of state and input.
    """

    def __init__(self, stages: int, nx: int, nu: int):
        self.N, self.nx, self.nu = stages, nx, nu
        N, width = stages, 1 + stages * nu
        # d_k = G_k (1, u_0, ..., u_{k-1}); the first column is the motion without input. A last row
        # (1, 0, ...) includes drifts and gradients in the products. Block k of the buffer holds the
        # Hessian's rows of u_k, W_k (derivative of the cost by d_k) and G_{k-1}. A step backwards,
        # rows_k and W_k from W_{k+1} and G_k, is then one product of one block into the next.
        Y = np.zeros((N + 2, nu + 2 * nx + 1, width))
        Y[1:, -1, 0] = 1.0
        self._rows, self._W = Y[:N, :nu, 1:], Y[N, nu : nu + nx]
        self._gradient = Y[:N, :nu, 0]
        self._G = Y[1:, nu + nx : -1]
        free = [1 + k * nu for k in range(N + 1)]
        self._known = [Y[k + 1, nu + nx :, : free[k]] for k in range(N)]
        self._next = [Y[k + 2, nu + nx : -1, : free[k]] for k in range(N)]
        self._after = [Y[k + 1, nu:, : free[k + 1]] for k in range(N)]
        self._before = [Y[k, : nu + nx, : free[k + 1]] for k in range(N)]
        # Places of the inputs' matrices in G: one block of columns further right in each block.
        first = Y[2:, nu + nx : -1, 1:]
        steps = (first.strides[0] + nu * first.strides[2], *first.strides[1:])
        self._new = np.lib.stride_tricks.as_strided(first, (N, nx, nu), steps)
        self._backward = np.zeros((N, nu + nx, 2 * nx + 1))

    def condense(
        self, model: DiscreteModel, Q: Array, q: Array, R: Array, r: Array
    ) -> tuple[Array, Array]:
        """Return the Hessian (only its lower triangle) and the gradient (N nu,) at zero input.

        Parameters
        ----------
        model : DiscreteModel
            Matrices A, B, c of the N steps.
        Q, q : (N + 1, nx, nx), (N + 1, nx) arrays
            Weights of d_0 (ignored) to d_N.
        R, r : (N, nu), (N, nu) arrays
            Weights of the inputs; R holds diagonals.
        """
        N, nx, nu, flow = self.N, self.nx, self.nu, model.flow
        self._new[:] = model.Gamma
        for A, known, after in zip(flow[:, :, nu:], self._known, self._next):
            np.matmul(A, known, out=after)
        L = self._backward
        L[:, :, :nx] = np.swapaxes(flow[:, :, :-1], 1, 2)
        L[:, nu:, nx:-1] = Q[:N]
        L[:, nu:, -1] = q[:N]
        np.matmul(Q[N], self._G[N], out=self._W)
        self._W[:, 0] += q[N]
        for k in range(N - 1, -1, -1):
            np.matmul(L[k], self._after[k], out=self._before[k])
        hessian = self._rows.reshape(N * nu, N * nu)
        hessian.ravel()[:: N * nu + 1] += R.ravel()
        return hessian, (self._gradient + r).ravel()

    def expand(self, u: Array) -> Array:
        """Return the states d_0 to d_N (N + 1, nx) under inputs u (N nu,)."""
        return self._G @ np.concatenate([[1.0], u])
