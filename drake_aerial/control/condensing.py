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
        sizes = [1 + k * nu for k in range(stages)]
        self._known = [self.G[k, :, :size] for k, size in enumerate(sizes)]
        self._next = [self.G[k + 1, :, :size] for k, size in enumerate(sizes)]
        self._new = [self.G[k + 1, :, size : size + nu] for k, size in enumerate(sizes)]
        self._rows = [self.H[size - 1 : size - 1 + nu, : size + nu] for size in sizes]

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
        self._next[0][:, 0] = c[0]
        self._new[0][:] = B[0]
        for k in range(1, N):
            after = self._next[k]
            np.matmul(A[k], self._known[k], out=after)
            after[:, 0] += c[k]
            self._new[k][:] = B[k]
        W = Q[N] @ G[N]
        W[:, 0] += q[N]
        for k in range(N - 1, 0, -1):
            np.matmul(BT[k], W, out=self._rows[k])
            W = AT[k] @ W[:, : 1 + k * nu]
            W += Q[k] @ self._known[k]
            W[:, 0] += q[k]
        np.matmul(BT[0], W, out=self._rows[0])
        hessian = H[:, 1:].copy()
        hessian.ravel()[:: N * nu + 1] += np.tile(R, N)
        return hessian, H[:, 0] + r.ravel()

    def expand(self, u: Array) -> Array:
        """Return the states d_0 to d_N (N + 1, nx) that inputs u (N nu,) lead to."""
        return self.G @ np.concatenate([[1.0], u])
