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
        # d_k = G_k (1, u_0, ..., u_{k-1}): the first column is where the horizon goes without input.
        self.G = np.zeros((stages + 1, nx, 1 + stages * nu))
        self.H = np.zeros((stages * nu, 1 + stages * nu))

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
        N, nu, G, H = self.N, self.nu, self.G, self.H
        A, B, c = model
        AT, BT = np.swapaxes(A, 1, 2), np.swapaxes(B, 1, 2)
        G[1:, :, 0] = c
        G[0, :, 0] = 0.0
        for k in range(N):
            size = 1 + k * nu
            if k:
                before = G[k + 1, :, 0].copy()
                np.matmul(A[k], G[k, :, :size], out=G[k + 1, :, :size])
                G[k + 1, :, 0] += before
            G[k + 1, :, size : size + nu] = B[k]
        W = Q[N] @ G[N]
        W[:, 0] += q[N]
        for k in range(N - 1, -1, -1):
            size = 1 + k * nu
            H[size - 1 : size - 1 + nu, : size + nu] = BT[k] @ W
            if k:
                W = AT[k] @ W[:, :size]
                W += Q[k] @ G[k, :, :size]
                W[:, 0] += q[k]
        hessian = H[:, 1:].copy()
        hessian.ravel()[:: N * nu + 1] += np.tile(R, N)
        return hessian, H[:, 0] + r.ravel()

    def expand(self, u: Array) -> Array:
        """Return the states d_0 to d_N (N + 1, nx) that inputs u (N nu,) lead to."""
        return self.G @ np.concatenate([[1.0], u])
