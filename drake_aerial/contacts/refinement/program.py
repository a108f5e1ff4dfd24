"""Refinement of contacts as a Drake MathematicalProgram that users can extend (docs/method.md)."""

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pydrake.solvers import MathematicalProgram, MathematicalProgramResult

from drake_aerial.contacts.contact_query import ContactQuery
from drake_aerial.contacts.feasibility.contact_checker import ContactChecker
from drake_aerial.contacts.feasibility.reasons import ReasonKind
from drake_aerial.contacts.likelihood.formation_frame import FormationFrames
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.refinement.contact_constraints import (
    Constraint,
    contact_constraints,
)
from drake_aerial.contacts.refinement.differentiable import Differentiable
from drake_aerial.contacts.refinement.equilibrium_constraint import EquilibriumConstraint
from drake_aerial.contacts.refinement.gripper_variables import GripperVariables
from drake_aerial.contacts.refinement.likelihood_factors import LikelihoodFactors
from drake_aerial.contacts.refinement.solvers import perturbed, solver_by_name, violated_constraints
from drake_aerial.contacts.solutions import Solution
from drake_aerial.density.kernels import turned_to_axis
from drake_aerial.errors import InputError, JobError
from drake_aerial.geometry import Array, Pose, axis_of, invert, quat_normalize
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.statics.tensions import load_shares

REACH = 0.1
"""Default of the largest displacement of a contact from its seed along each axis [m]."""

# Typical step of a tension, as a fraction of the weight: solvers see variables over it.
_SCALE_TENSION = 0.3
# Least tension of a cable in the program, as a fraction of the weight.
_LEAST_TENSION = 0.01
# Times that a program is solved again from a perturbed guess.
_RETRIES = 3
# Variables that all change by less than this have not moved.
_UNMOVED = 1e-6


@dataclass(frozen=True, eq=False)
class ProgramResult:
    """Result of a contact program.

    Attributes
    ----------
    solution : Solution
        Grippers at the solver's last point, in the cloud's frame S, with their likelihood. They
        are infeasible if `reasons_against` says so, or a constraint of the user's is violated.
    success : bool
        True if the solver reports an optimum that satisfies all constraints.
    seconds : float
        Wall-clock time [s].
    drake : MathematicalProgramResult
        Drake's result, for the values of a user's variables, duals and solver details.
    """

    solution: Solution
    success: bool
    seconds: float
    drake: MathematicalProgramResult


class ContactProgram:
    """Maximise the contact likelihood J around one solution, subject to its feasibility.

    Decision variables are the position p_SG [m] and the unit quaternion q_SG (w, x, y, z) of each
    gripper, both in the cloud's frame S, and for several cables their tensions as parts of the
    payload's weight. A gripper that is symmetric about its axis is free to turn about it. Costs are
    -log H, -log Q_n (of the method's own density) and -gamma log V. All costs and constraints have
    names and analytic gradients, and take double or AutoDiffXd.

    Parameters
    ----------
    skill : ContactSkill
        The learnt skill.
    query : ContactQuery or None
        Scan and densities of a transfer: `ContactSolutions.query`.
    solution : Solution or Pose
        The seed: a solution of that transfer, or any grippers X_SG, batch (n,).
    parameters : TransferParameters, optional
        Limits of feasibility.
    reach : float
        Largest displacement of a contact from the seed along each axis [m].
    start : Pose, optional
        Grippers X_SG (n,) of the initial guess; the seed by default.
    checker : ContactChecker, optional
        Checker of the same query and parameters, if several programs share one.

    Raises
    ------
    InputError
        If `query` is None, or the numbers of grippers differ.

    Examples
    --------
    >>> from drake_aerial import ContactProgram, read_scan, read_skill, transfer
    >>> skill = read_skill("flat")
    >>> contacts = transfer(skill, read_scan("box_68x68x28"), top=1)
    >>> program = ContactProgram(skill, contacts.query, contacts[0])
    >>> x = program.positions()[0, 0]
    >>> constraint = program.prog().AddLinearConstraint(x >= 0.05)
    >>> round(float(program.solve().solution.X_SG.p[0, 0]), 3)
    0.05
    """

    def __init__(
        self,
        skill: ContactSkill,
        query: ContactQuery | None,
        solution: Solution | Pose,
        *,
        parameters: TransferParameters | None = None,
        reach: float = REACH,
        start: Pose | None = None,
        checker: ContactChecker | None = None,
    ):
        X_SG = solution.X_SG if isinstance(solution, Solution) else solution
        if X_SG.p.shape != (len(skill), 3):
            raise InputError(
                f"`solution` must have {len(skill)} grippers, as the skill has, "
                f"got positions of shape {X_SG.p.shape}"
            )
        if not reach > 0.0:
            raise InputError(f"`reach` must be positive, got {reach} m")
        self._checker = checker or ContactChecker(query, parameters or TransferParameters())
        self._frames = FormationFrames(self._checker.likelihood.configuration)
        self._seed = Pose(np.asarray(X_SG.p, float), quat_normalize(X_SG.q))
        self._axial, start = skill.parameters.axial, start or self._seed
        self._prog = MathematicalProgram()
        X_SN = self._checker.X_SN
        self._variables = GripperVariables(self._prog, X_SN, self._seed, start, reach)
        self._tensions = np.empty(0, object)
        self._factors = LikelihoodFactors(self._checker.likelihood, self._frames)
        self._add_costs()
        self._add_constraints(invert(X_SN) @ self._seed, invert(X_SN) @ start, reach)
        self._own = {*self._prog.GetAllCosts(), *self._prog.GetAllConstraints()}

    def prog(self) -> MathematicalProgram:
        """Return the program, to which costs and constraints may be added before `solve`."""
        return self._prog

    def positions(self) -> np.ndarray:
        """Return the decision variables p_SG, shape (n, 3)."""
        return self._variables.p

    def quaternions(self) -> np.ndarray:
        """Return the decision variables q_SG (w, x, y, z), shape (n, 4)."""
        return self._variables.q

    def tensions(self) -> np.ndarray:
        """Return the tension variables (n,), as fractions of the weight; empty if n = 1."""
        return self._tensions

    def gripper_variables(self) -> np.ndarray:
        """Return all gripper variables (7 n): p and q of the first gripper, of the second, etc."""
        return self._variables.of_grippers()

    def log_likelihood(self, x: Any) -> Any:
        """Return log J of gripper variables x (7 n), double or AutoDiffXd."""
        return self._variables.scalar(self._factors)(x)

    def solve(
        self,
        solver: str = "snopt",
        *,
        iterations: int = 100,
        tolerance: float = 1e-4,
        seed: int = 0,
    ) -> ProgramResult:
        """Solve the program from its initial guess.

        Unlike `refine`, this returns the solver's final point, even if it is worse than
        the seed.

        A solver can stop at a guess where the gradient of a user's function is zero: that of
        (x - c)^2 at x = c, for instance. If a user's constraint is violated, or the guess did not
        move although the user added a cost, the program is solved again, up to three times, from
        guesses with random perturbations, and the best end is returned: the one with the fewest
        reasons against it, then the one with the lowest cost.

        Parameters
        ----------
        solver : str
            `snopt`, `ipopt` or `nlopt`.
        iterations : int
            Largest number of major iterations (function evaluations for nlopt).
        tolerance : float
            Optimality tolerance, in the solver's own measure.
        seed : int
            Random seed of the perturbations.

        Raises
        ------
        InputError
            If the solver is unknown or not available.
        JobError
            If the solver returns no point.
        """
        drake_solver, options = solver_by_name(solver, iterations, tolerance)
        begin = time.perf_counter()
        # A user's variables may lack a guess.
        guess = np.nan_to_num(self._prog.initial_guess())
        best = drake_solver.Solve(self._prog, guess, options)
        if not self._has_point(best):
            raise JobError(
                f"the solver {solver} found no solution ({best.get_solution_result().name}); use "
                "another `solver` or remove constraints"
            )
        solution, rng = self._solution(best), np.random.default_rng(seed)
        for _ in range(_RETRIES):
            if not self._stuck(best, solution, guess):
                break
            other = drake_solver.Solve(self._prog, perturbed(self._prog, guess, rng), options)
            if self._has_point(other):
                ends = (best, solution), (other, self._solution(other))
                best, solution = min(
                    ends, key=lambda end: (len(end[1].reasons), end[0].get_optimal_cost())
                )
        return ProgramResult(solution, best.is_success(), time.perf_counter() - begin, best)

    def _has_point(self, result: MathematicalProgramResult) -> bool:
        return bool(np.isfinite(result.GetSolution(self.gripper_variables())).all())

    def _solution(self, result: MathematicalProgramResult) -> Solution:
        """Return the grippers of a result, with reasons for the user's violated constraints."""
        p, q = (np.asarray(result.GetSolution(v)) for v in (self.positions(), self.quaternions()))
        q, x = quat_normalize(q), np.array(result.get_x_val())
        violated = violated_constraints(self._prog, self._own, x)
        if self._axial:
            # The rotation about the axis is that of the seed, unless a user's constraint fixes it.
            turned = turned_to_axis(self._seed.q, axis_of(q, 2))
            x[self._prog.FindDecisionVariableIndices(self.quaternions().ravel())] = turned.ravel()
            if violated or not violated_constraints(self._prog, self._own, x):
                q = turned
        solution = self._checker.solution(invert(self._checker.X_SN) @ Pose(p, q))
        reasons = solution.reasons + violated
        return replace(solution, feasible=not reasons, reasons=reasons)

    def _stuck(self, result: MathematicalProgramResult, solution: Solution, guess: Array) -> bool:
        """Return whether a user's constraint is violated, or a user's cost has moved nothing."""
        if any(reason.kind is ReasonKind.CONSTRAINT_VIOLATED for reason in solution.reasons):
            return True
        has_cost = any(cost not in self._own for cost in self._prog.GetAllCosts())
        return has_cost and bool(np.all(np.abs(result.get_x_val() - guess) < _UNMOVED))

    def _add_costs(self) -> None:
        for name, factor, grippers in self._factors.named:
            cost = self._prog.AddCost(
                self._variables.scalar(factor, -1.0), vars=self._variables.of_grippers(grippers)
            )
            cost.evaluator().set_description(f"-{name}")

    def _add_constraints(self, seed: Pose, start: Pose, reach: float) -> None:
        """Add what makes grippers feasible; seed and start are X_NG (n,)."""
        for name, constraint, grippers in contact_constraints(
            self._checker, self._frames, seed, start, reach
        ):
            over = self._variables.of_grippers(grippers)
            self._add_constraint(name, self._variables.vector(constraint), constraint, over)
        if len(seed.p) > 1:
            self._add_equilibrium(seed, start)

    def _add_equilibrium(self, seed: Pose, start: Pose) -> None:
        n, checker, prog = len(seed.p), self._checker, self._prog
        equilibrium = EquilibriumConstraint(self._frames, seed, checker.centre)

        def function(x: Array) -> tuple[Array, Array]:
            value, by_p, by_w, by_t = equilibrium(self._variables.poses(x[:-n]), x[-n:])
            return value, np.hstack([self._variables.jacobian(x[:-n], by_p, by_w), by_t])

        self._tensions = prog.NewContinuousVariables(n, "tension")
        for variable in self._tensions:
            prog.SetVariableScaling(variable, _SCALE_TENSION)
        over = np.concatenate([self.gripper_variables(), self._tensions])
        self._add_constraint("taut static equilibrium", Differentiable(function), equilibrium, over)
        prog.AddBoundingBoxConstraint(_LEAST_TENSION, 2.0, self._tensions)
        p_NQ = checker.likelihood.configuration.quadrotors_over(start).p
        shares = load_shares(start.p, p_NQ, checker.centre)
        guess = np.full(n, 1.0 / n) if shares is None else np.maximum(shares, _LEAST_TENSION)
        prog.SetInitialGuess(self._tensions, guess)

    def _add_constraint(
        self,
        name: str,
        function: Differentiable,
        bounds: Constraint | EquilibriumConstraint,
        over: np.ndarray,
    ) -> None:
        binding = self._prog.AddConstraint(function, lb=bounds.lower, ub=bounds.upper, vars=over)
        binding.evaluator().set_description(name)
