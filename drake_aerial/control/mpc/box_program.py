"""Dense quadratic programs with bounds, and the bounds of the thrusts."""

from __future__ import annotations

from typing import Any

import numpy as np
import piqp
from scipy.linalg import lapack

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
