"""Drake's solvers for contact programs, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from drake_aerial.errors import InputError

SOLVERS = ("snopt", "ipopt", "nlopt")
"""Names of the solvers that `ContactProgram.solve` accepts."""

# By how much a constraint may be missed, in its own unit.
_FEASIBLE = 1e-5


def solver_by_name(name: str, iterations: int, tolerance: float) -> tuple[Any, Any]:
    """Return Drake's solver of that name and its SolverOptions.

    Parameters
    ----------
    name : str
        One of `SOLVERS`.
    iterations : int
        Most major iterations (function evaluations for nlopt).
    tolerance : float
        Of optimality, in the solver's own measure.

    Raises
    ------
    InputError
        If the solver is unknown or not available.
    """
    from pydrake.solvers import IpoptSolver, NloptSolver, SnoptSolver, SolverOptions

    settings: dict[str, tuple[Callable[[], Any], dict[str, float | int]]] = {
        "snopt": (
            SnoptSolver,
            {
                "Major iterations limit": iterations,
                "Major optimality tolerance": tolerance,
                "Major feasibility tolerance": _FEASIBLE,
            },
        ),
        "ipopt": (
            IpoptSolver,
            {"max_iter": iterations, "tol": tolerance, "constr_viol_tol": _FEASIBLE},
        ),
        "nlopt": (
            NloptSolver,
            {"max_eval": iterations, "constraint_tol": _FEASIBLE, "xtol_rel": tolerance},
        ),
    }
    if name not in settings:
        raise InputError(f"unknown solver {name!r}; accepted: {', '.join(SOLVERS)}")
    make, values = settings[name]
    solver, options = make(), SolverOptions()
    if not (solver.available() and solver.enabled()):
        raise InputError(
            f"Drake has no solver {name} here; accepted: others of {', '.join(SOLVERS)}"
        )
    for key, value in values.items():
        options.SetOption(solver.solver_id(), key, value)
    return solver, options
