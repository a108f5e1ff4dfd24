"""A linear-quadratic control problem over a horizon as a dense program in the inputs alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_aerial.control.payload_linearization import DiscreteModel

Array = NDArray[np.float64]


class CondensedProblem:
    """Buffers for min sum_k 1/2 d_k^T Q_k d_k + q_k^T d_k + 1/2 u_k^T R u_k + r_k^T u_k over d_{k+1} = A d + B u + c.

    d_0 = 0: the horizon begins at the measured state. The Hessian is built backwards through the horizon, in
    O(N^2) products of small matrices.

    Parameters
    ----------
    stages, nx, nu : int
        N, and the sizes of state and input.
    """

    def __init__(self, stages: int, nx: int, nu: int):
        self.N, self.nx, self.nu = stages, nx, nu
        self.G = np.zeros((stages + 1, nx, stages * nu))
        self.d = np.zeros((stages + 1, nx))
        self.H = np.zeros((stages * nu, stages * nu))
        self.g = np.zeros(stages * nu)

    def condense(self, model: DiscreteModel, Q: Array, q: Array, R: Array, r: Array) -> tuple[Array, Array]:
        """Return the Hessian, of which the lower triangle counts, and the gradient (N nu,) at zero input.

        Parameters
        ----------
        model : DiscreteModel
            A, B, c of the N steps.
        Q, q : (N + 1, nx, nx), (N + 1, nx) arrays
            Weights of d_0 (ignored) to d_N.
        R, r : (nu,), (N, nu) arrays
            Weights of the inputs; R is a diagonal.
        """
        N, nu, G, d, H, g = self.N, self.nu, self.G, self.d, self.H, self.g
        A, B, c = model
        G[1, :, :nu] = B[0]
        d[1] = c[0]
        for k in range(1, N):
            np.matmul(A[k], G[k, :, : k * nu], out=G[k + 1, :, : k * nu])
            G[k + 1, :, k * nu : (k + 1) * nu] = B[k]
            d[k + 1] = A[k] @ d[k] + c[k]
        slope = q + (Q @ d[:, :, None])[:, :, 0]
        W = Q[N] @ G[N]
        y = slope[N]
        for k in range(N - 1, -1, -1):
            block = slice(k * nu, (k + 1) * nu)
            H[block, : (k + 1) * nu] = B[k].T @ W[:, : (k + 1) * nu]
            g[block] = B[k].T @ y
            if k:
                W = Q[k] @ G[k, :, : k * nu] + A[k].T @ W[:, : k * nu]
                y = slope[k] + A[k].T @ y
        g += r.ravel()
        H[range(N * nu), range(N * nu)] += np.tile(R, N)
        return H, g

    def expand(self, u: Array) -> Array:
        """Return the states d_0 to d_N (N + 1, nx) that inputs u (N nu,) lead to."""
        return self.d + self.G @ u
