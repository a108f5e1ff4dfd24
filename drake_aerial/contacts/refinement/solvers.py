"""Solvers of the refinement, and the check of constraints that users add."""

from collections.abc import Callable, Container
from typing import Any

import numpy as np
from pydrake.solvers import (
    IpoptSolver,
    MathematicalProgram,
    NloptSolver,
    SnoptSolver,
    SolverOptions,
)

from drake_aerial.contacts.feasibility.reasons import Reason, ReasonKind
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

SOLVERS = ("snopt", "ipopt", "nlopt")
"""Names of the solvers that `ContactProgram.solve` accepts."""

FEASIBILITY_TOLERANCE = 1e-5
"""Largest violation of a constraint, in the constraint's unit."""
# Standard deviation of a perturbation, over the variable's scaling.
_PERTURBATION = 0.25


def solver_by_name(name: str, iterations: int, tolerance: float) -> tuple[Any, Any]:
    """Return Drake's solver of that name and its SolverOptions.

    Parameters
    ----------
    name : str
        One of `SOLVERS`.
    iterations : int
        Largest number of major iterations (function evaluations for nlopt).
    tolerance : float
        Optimality tolerance, in the solver's own measure.

    Raises
    ------
    InputError
        If the solver is unknown or not available.
    """
    settings: dict[str, tuple[Callable[[], Any], dict[str, float | int]]] = {
        "snopt": (
            SnoptSolver,
            {
                "Major iterations limit": iterations,
                "Major optimality tolerance": tolerance,
                "Major feasibility tolerance": FEASIBILITY_TOLERANCE,
            },
        ),
        "ipopt": (
            IpoptSolver,
            {"max_iter": iterations, "tol": tolerance, "constr_viol_tol": FEASIBILITY_TOLERANCE},
        ),
        "nlopt": (
            NloptSolver,
            {
                "max_eval": iterations,
                "constraint_tol": FEASIBILITY_TOLERANCE,
                "xtol_rel": tolerance,
            },
        ),
    }
    if name not in settings:
        raise InputError(f"`solver` must be one of {', '.join(SOLVERS)}, got {name!r}")
    make, values = settings[name]
    solver, options = make(), SolverOptions()
    if not (solver.available() and solver.enabled()):
        raise InputError(
            f"the solver {name} is not available in this Drake; use another of {', '.join(SOLVERS)}"
        )
    for key, value in values.items():
        options.SetOption(solver.solver_id(), key, value)
    return solver, options


def perturbed(prog: MathematicalProgram, guess: Array, rng: np.random.Generator) -> Array:
    """Return a guess (N,) plus Gaussian noise of a quarter of each variable's scaling."""
    scale = np.ones(len(guess))
    for index, size in prog.GetVariableScaling().items():
        scale[index] = size
    return guess + _PERTURBATION * scale * rng.standard_normal(len(guess))


# Solvers apply their tolerance to scaled constraints.
_TOLERANCE = 2.0 * FEASIBILITY_TOLERANCE


def violated_constraints(
    prog: MathematicalProgram, own: Container[Any], x: Array
) -> tuple[Reason, ...]:
    """Return a reason for each constraint of the user's that is violated.

    The program's own constraints are left out: `ContactChecker` judges what they stand for.

    Parameters
    ----------
    prog : MathematicalProgram
        The program.
    own : container of bindings
        The program's own constraints.
    x : (N,) array
        Values of all decision variables.
    """
    reasons = []
    for binding in prog.GetAllConstraints():
        if binding in own:
            continue
        constraint, variables = binding.evaluator(), binding.variables()
        values = x[prog.FindDecisionVariableIndices(variables)]
        if not constraint.CheckSatisfied(values, _TOLERANCE):
            y = constraint.Eval(values)
            excess = np.maximum(constraint.lower_bound() - y, y - constraint.upper_bound()).max()
            names = ", ".join(variable.get_name() for variable in variables)
            name = constraint.get_description() or f"{type(constraint).__name__} of {names}"
            name = " ".join(name.split())
            reasons.append(Reason(ReasonKind.CONSTRAINT_VIOLATED, value=float(excess), name=name))
    return tuple(reasons)
