"""Decision variables of a contact program: gripper poses in the cloud's frame."""

import numpy as np
from pydrake.solvers import MathematicalProgram

from drake_aerial.contacts.refinement.contact_constraints import Constraint
from drake_aerial.contacts.refinement.differentiable import Differentiable
from drake_aerial.contacts.refinement.likelihood_factors import Factor
from drake_aerial.geometry import (
    Array,
    Pose,
    cross,
    invert,
    matrix_from_quat,
    quat_multiply,
    transform,
)

# Number of vectors x whose poses are cached.
_CACHED = 16
# Typical steps of a position [m] and a quaternion: solvers see variables over these.
_SCALE_P, _SCALE_Q = 0.02, 0.1


class GripperVariables:
    """Vector x (7 n): for each gripper its position p_SG [m] and quaternion q_SG (w, x, y, z).

    S is the cloud's frame, which users know; densities and constraints are evaluated in its
    canonical frame N. A quaternion q that is not of unit length stands for the rotation q / |q|, so
    that every function is smooth around the unit sphere.

    Parameters
    ----------
    prog : MathematicalProgram
        Program to which the variables are added, with bounds, scaling and initial guess.
    X_SN : Pose
        The canonical frame in the cloud's frame.
    seed, start : Pose
        Grippers X_SG (n,) from which positions may depart, and those of the initial guess.
    reach : float
        Largest displacement of a position from the seed along each axis [m].

    Attributes
    ----------
    p, q : (n, 3) and (n, 4) arrays of Drake variables
    """

    def __init__(
        self, prog: MathematicalProgram, X_SN: Pose, seed: Pose, start: Pose, reach: float
    ):
        self._X_NS, self._R_SN = invert(X_SN), matrix_from_quat(X_SN.q)
        # A solver evaluates many functions at the same x, one after another.
        self._poses: dict[bytes, Pose] = {}
        n = len(seed.p)
        self.p = prog.NewContinuousVariables(n, 3, "p_SG")
        self.q = prog.NewContinuousVariables(n, 4, "q_SG")
        lower, upper = (seed.p - reach).ravel(), (seed.p + reach).ravel()
        prog.AddBoundingBoxConstraint(lower, upper, self.p.ravel())
        prog.AddBoundingBoxConstraint(-1.1, 1.1, self.q.ravel())
        for variables, size in ((self.p, _SCALE_P), (self.q, _SCALE_Q)):
            for variable in variables.ravel():
                prog.SetVariableScaling(variable, size)
        for q in self.q:
            unit = prog.AddQuadraticConstraint(2.0 * np.eye(4), np.zeros(4), 1.0, 1.0, q)
            unit.evaluator().set_description("unit quaternion")
        prog.SetInitialGuess(self.p, start.p)
        prog.SetInitialGuess(self.q, start.q)

    def of_grippers(self, grippers: slice = slice(None)) -> np.ndarray:
        """Return the variables (7 m) of m grippers: p and q of the first, of the second, etc."""
        return np.hstack([self.p, self.q])[grippers].ravel()

    def poses(self, x: Array) -> Pose:
        """Return the grippers X_NG (n,) of x (7 n); the same object while it is cached."""
        key = x.tobytes()
        if key not in self._poses:
            if len(self._poses) >= _CACHED:
                self._poses.clear()
            rows = np.reshape(x, (-1, 7))
            q = rows[:, 3:] / np.sqrt(np.sum(rows[:, 3:] ** 2, axis=1, keepdims=True))
            self._poses[key] = Pose(
                transform(self._X_NS, rows[:, :3]), quat_multiply(self._X_NS.q, q)
            )
        return self._poses[key]

    def scalar(self, factor: Factor, sign: float = 1.0) -> Differentiable:
        """Return a factor of J, or its negative, as a function of variables x."""

        def function(x: Array) -> tuple[Array, Array]:
            value, by_p, by_w = factor(self.poses(x))
            return np.array([sign * value]), sign * self.jacobian(x, by_p[None], by_w[None])

        return Differentiable(function, scalar=True)

    def vector(self, constraint: Constraint) -> Differentiable:
        """Return a constraint's values as a function of variables x."""

        def function(x: Array) -> tuple[Array, Array]:
            value, by_p, by_w = constraint(self.poses(x))
            return value, self.jacobian(x, by_p, by_w)

        return Differentiable(function)

    def jacobian(self, x: Array, by_p: Array, by_w: Array) -> Array:
        """Return the Jacobian (m, 7 n) by x from the Jacobians by poses in N.

        Parameters
        ----------
        x : (7 n,) array
            The variables' values.
        by_p : (m, n, 3) array
            Derivatives by the positions p_NG [1/m].
        by_w : (m, n, 3) array
            Derivatives by rotation vectors w in N [1/rad] of the perturbed rotations exp(w) R_NG.
        """
        q = np.reshape(x, (-1, 7))[:, 3:]
        # Row vectors: g_S = R_SN g_N.
        g_p, g_w = by_p @ self._R_SN.T, by_w @ self._R_SN.T
        out = np.empty((*g_p.shape[:2], 7))
        out[..., :3] = g_p
        # w = 2 vec(dq conj(q)) / |q|^2.
        scale = 2.0 / np.sum(q * q, axis=1)
        w, v = q[:, :1], q[:, 1:]
        out[..., 3] = -np.sum(v * g_w, axis=-1) * scale
        out[..., 4:] = (w * g_w - cross(v, g_w)) * scale[:, None]
        return out.reshape(len(out), -1)
