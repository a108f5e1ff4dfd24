"""Constraints that a user added to a contact program, as reasons if they are violated."""

from __future__ import annotations

from collections.abc import Container
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_aerial.contacts.feasibility.reasons import Reason, ReasonKind
from drake_aerial.contacts.refinement.solvers import FEASIBILITY_TOLERANCE
from drake_aerial.geometry import Array

if TYPE_CHECKING:
    from pydrake.solvers import MathematicalProgram

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
