"""Violation of the smallest distance between quadrotors, for a penalty in the MPC."""

from itertools import combinations

import numpy as np

from drake_aerial.dynamics.payload_model import tangent_basis
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.dynamics.payload_state import PayloadState
from drake_aerial.geometry import Array, skew


class Separation:
    """Distances between the pairs of n quadrotors.

    Parameters
    ----------
    model : PayloadModelParameters
    distance : float
        Smallest distance between two quadrotors' centres [m].
    """

    def __init__(self, model: PayloadModelParameters, distance: float):
        self._distance, self._length = distance, model.cable_length[:, None]
        pairs = np.array(list(combinations(range(model.n), 2)), int).reshape(-1, 2)
        self._first, self._second = pairs.T
        self._arms = model.arms[self._first] - model.arms[self._second]
        self._arm_matrices = skew(self._arms)

    def violation(self, x: PayloadState) -> tuple[Array, Array]:
        """Return smallest minus actual distances (B, P) [m], and unit vectors of the pairs.

        The unit vectors (B, P, 3) in the world point from the second quadrotor of a pair to the
        first.
        """
        hang = self._length * x.xi
        gap = self._arms @ x.R.mT - hang[:, self._first] + hang[:, self._second]
        size = np.sqrt(np.vecdot(gap, gap))
        return self._distance - size, gap / np.maximum(size, 1e-6)[..., None]

    def jacobian(self, x: PayloadState, direction: Array, E: Array | None = None) -> Array:
        """Return the derivative (B, P, nx) of the violation by the error state.

        Parameters
        ----------
        x : PayloadState
            Batch B.
        direction : (B, P, 3) array
            Result of `violation`.
        E : (B, n, 3, 2) array, optional
            Tangent bases at x; computed if not given.
        """
        B, n = x.xi.shape[:2]
        E = tangent_basis(x.xi) if E is None else E
        J = np.zeros((B, len(self._first), 12 + 7 * n))
        J[:, :, 6:9] = (direction[:, :, None] @ (x.R[:, None] @ self._arm_matrices))[:, :, 0]
        swing = np.empty_like(E)  # derivative of l xi by the cable's error
        swing[..., 0] = -E[..., 1]
        swing[..., 1] = E[..., 0]
        swing *= self._length[..., None]
        for sign, index in ((1.0, self._first), (-1.0, self._second)):
            by_swing = sign * np.vecmat(direction, swing[:, index])
            for k, i in enumerate(index):
                J[:, k, 12 + 2 * i : 14 + 2 * i] = by_swing[:, k]
        return J
