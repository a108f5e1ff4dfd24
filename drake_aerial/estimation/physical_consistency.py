"""The nearest inertial parameters that a body of positive mass inside its hull can have."""

from __future__ import annotations

import numpy as np
from pydrake.solvers import ClarabelSolver, MathematicalProgram
from scipy.spatial import ConvexHull

from drake_aerial.errors import JobError
from drake_aerial.estimation.inertial_parameters import pseudo_inertia
from drake_aerial.geometry import Array

_SMALLEST_MASS = 1e-3
"""Smallest mass, as a fraction of the unit of mass."""


def nearest_possible(phi: Array, information: Array, points: Array, units: Array) -> Array:
    """Return the physically possible parameters (10,) that are nearest to `phi`.

    A semidefinite program minimises (x - phi)^T H (x - phi), where the pseudo-inertia of x is
    positive semidefinite and the centre of mass lies in the convex hull of `points`. Parameters
    that are possible are returned as they are.

    Parameters
    ----------
    phi : (10,) array
    information : (10, 10) array
        H.
    points : (V, 3) array
        Points of the payload's surface in L [m].
    units : (10,) array
        Sizes that bring the parameters to order one.

    Raises
    ------
    JobError
        If the solver fails.
    """
    facets = np.unique(np.round(ConvexHull(points).equations, 9), axis=0)
    scaled = phi / units
    shape = np.diag([1.0 / np.sqrt(units[4])] * 3 + [1.0 / np.sqrt(units[0])])
    inside = facets[:, :3] @ phi[1:4] + facets[:, 3] * phi[0] <= 0.0
    eigenvalues = np.linalg.eigvalsh(shape @ pseudo_inertia(phi) @ shape)
    if phi[0] > _SMALLEST_MASS * units[0] and inside.all() and eigenvalues[0] > 0.0:
        return phi
    program = MathematicalProgram()
    x = program.NewContinuousVariables(10, "x")
    H = information * np.outer(units, units)
    size = np.linalg.norm(H, 2)
    program.AddQuadraticErrorCost(H / size, scaled, x)
    linear = [shape @ pseudo_inertia(column) @ shape for column in np.diag(units)]
    program.AddLinearMatrixInequalityConstraint([np.zeros((4, 4)), *linear], x)
    rows = np.column_stack([facets[:, 3] * units[0], facets[:, :3] * units[1:4]]) / units[1]
    bound = np.zeros(len(rows))
    program.AddLinearConstraint(rows, np.full(len(rows), -np.inf), bound, x[:4])
    program.AddBoundingBoxConstraint(_SMALLEST_MASS, np.inf, x[0])
    result = ClarabelSolver().Solve(program)
    if not result.is_success():
        raise JobError(
            "no physically possible mass properties fit the flight "
            f"(solver: {result.get_solution_result().name}); check the units of the record"
        )
    return np.asarray(result.GetSolution(x)) * units
