"""Refinement of contacts as a Drake MathematicalProgram that a user can extend (docs/method.md)."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_aerial.contacts.contact_query import ContactQuery
from drake_aerial.contacts.feasibility.contact_checker import Examination
from drake_aerial.contacts.feasibility.reasons import load_shares
from drake_aerial.contacts.likelihood.formation_frame import FormationFrames
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.refinement.contact_constraints import (
    CableConstraint,
    Constraint,
    SeparationConstraint,
    SurfaceConstraint,
)
from drake_aerial.contacts.refinement.differentiable import Differentiable
from drake_aerial.contacts.refinement.equilibrium_constraint import EquilibriumConstraint
from drake_aerial.contacts.refinement.gripper_variables import GripperVariables
from drake_aerial.contacts.refinement.likelihood_factors import (
    ConfigurationFactor,
    Factor,
    QueryFactor,
    VotesFactor,
)
from drake_aerial.contacts.refinement.smooth_surface import SmoothSurface
from drake_aerial.contacts.refinement.solvers import solver_by_name
from drake_aerial.contacts.solutions import Solution
from drake_aerial.density.kernels import turned_to_axis
from drake_aerial.errors import InputError, JobError
from drake_aerial.geometry import Array, Pose, axis_of, invert, quat_normalize
from drake_aerial.skill.contact_skill import ContactSkill

if TYPE_CHECKING:
    from pydrake.solvers import MathematicalProgram, MathematicalProgramResult

REACH = 0.1
"""How far a contact may move from its seed along each axis [m], unless told otherwise."""

# Sizes of the steps that matter in a position [m], a quaternion and a tension: solvers see variables over these.
_SCALE_P, _SCALE_Q, _SCALE_TENSION = 0.02, 0.1, 0.3
# Least part of the weight that a cable carries.
_LEAST_TENSION = 0.01


@dataclass(frozen=True, eq=False)
class ProgramResult:
    """What a solver made of a contact program.

    Attributes
    ----------
    solution : Solution
        The grippers it ended at, in the cloud's frame S, with their likelihood and what speaks against them.
    success : bool
        Whether the solver reports an optimum that satisfies all constraints.
    seconds : float
        Wall-clock time [s].
    drake : MathematicalProgramResult
        Drake's own result, for the values of a user's variables, duals and solver details.
    """

    solution: Solution
    success: bool
    seconds: float
    drake: MathematicalProgramResult


class ContactProgram:
    """Maximise the contact likelihood J around one solution, subject to what makes contacts feasible.

    Decision variables are, for each gripper, its position p_SG [m] and its unit quaternion q_SG (w, x, y, z), both in
    the cloud's frame S, and for several cables their tensions as parts of the payload's weight. A gripper that is
    symmetric about its axis is free to turn about it. Costs are -log H, -log Q_n (of the method's own density) and
    -gamma log V; all costs and constraints have analytic gradients, take double or AutoDiffXd, and are named.

    Parameters
    ----------
    skill : ContactSkill
        What was learnt.
    query : ContactQuery or None
        Scan and densities of the transfer: `ContactSolutions.query`.
    solution : Solution or Pose
        The seed: a solution of that transfer, or any grippers X_SG, batch (n,).
    parameters : TransferParameters, optional
        Limits of feasibility.
    reach : float
        How far a contact may move from the seed along each axis [m].
    start : Pose, optional
        Grippers X_SG (n,) of the initial guess; the seed by default.
    examination : Examination, optional
        Of the same query and parameters, where several programs share one.

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
    >>> constraint = program.prog().AddLinearConstraint(program.positions()[0, 0] >= 0.05)  # keep to positive x
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
        examination: Examination | None = None,
    ):
        X_SG = solution.X_SG if isinstance(solution, Solution) else solution
        if X_SG.p.shape != (len(skill), 3):
            raise InputError(
                f"the skill has {len(skill)} grippers; the seed's positions have the shape {X_SG.p.shape}"
            )
        if not reach > 0.0:
            raise InputError(f"reach should be a positive length in metres, got {reach}")
        self._examination = examination or Examination(query, parameters or TransferParameters())
        self._frames = FormationFrames(self._examination.likelihood.configuration)
        self._seed = Pose(np.asarray(X_SG.p, float), quat_normalize(X_SG.q))
        self._axial, self._reach = skill.parameters.axial, reach
        self._variables = GripperVariables(self._examination.query.scan.X_SN)
        self._build(start or self._seed)

    def prog(self) -> MathematicalProgram:
        """Return the program, to which costs and constraints may be added before `solve`."""
        return self._prog

    def positions(self) -> np.ndarray:
        """Return the decision variables p_SG, shape (n, 3)."""
        return self._p

    def quaternions(self) -> np.ndarray:
        """Return the decision variables q_SG (w, x, y, z), shape (n, 4)."""
        return self._q

    def tensions(self) -> np.ndarray:
        """Return the decision variables of the cables' tensions over the payload's weight, shape (n,); none if n = 1."""
        return self._tensions

    def gripper_variables(self) -> np.ndarray:
        """Return all gripper variables (7 n): p and q of the first gripper, of the second, and so on."""
        return np.hstack([self._p, self._q]).ravel()

    def log_likelihood(self, x: Any) -> Any:
        """Return log J of gripper variables x (7 n), double or AutoDiffXd."""
        return Differentiable(self._log_likelihood, scalar=True)(x)

    def solve(
        self, solver: str = "snopt", *, iterations: int = 100, tolerance: float = 1e-4
    ) -> ProgramResult:
        """Solve the program from its initial guess.

        Unlike `refine`, this returns whatever the solver ends at, be it worse than the seed.

        Parameters
        ----------
        solver : str
            `snopt`, `ipopt` or `nlopt`.
        iterations : int
            Most major iterations (function evaluations for nlopt).
        tolerance : float
            Of optimality, in the solver's own measure.

        Raises
        ------
        InputError
            If the solver is unknown or not available.
        JobError
            If the solver returns no point at all.
        """
        drake_solver, options = solver_by_name(solver, iterations, tolerance)
        begin = time.perf_counter()
        # Variables of the user's own may lack a guess.
        result = drake_solver.Solve(self._prog, np.nan_to_num(self._prog.initial_guess()), options)
        if not np.isfinite(result.GetSolution(self.gripper_variables())).all():
            raise JobError(f"{solver} gave up without a point: {result.get_solution_result().name}")
        X_SG = Pose(
            np.asarray(result.GetSolution(self._p)), quat_normalize(result.GetSolution(self._q))
        )
        if self._axial:
            # The turn about the axis, which nothing decides, stays the seed's.
            X_SG = Pose(X_SG.p, turned_to_axis(self._seed.q, axis_of(X_SG.q, 2)))
        X_NG = invert(self._variables.X_SN) @ X_SG
        solution = self._examination.solution(X_NG)
        return ProgramResult(
            solution, bool(result.is_success()), time.perf_counter() - begin, result
        )

    def _build(self, start: Pose) -> None:
        from pydrake.solvers import MathematicalProgram

        n, prog = len(self._seed.p), MathematicalProgram()
        self._prog = prog
        self._p = prog.NewContinuousVariables(n, 3, "p_SG")
        self._q = prog.NewContinuousVariables(n, 4, "q_SG")
        self._tensions = prog.NewContinuousVariables(n, "tension") if n > 1 else np.empty(0, object)
        prog.AddBoundingBoxConstraint(
            (self._seed.p - self._reach).ravel(),
            (self._seed.p + self._reach).ravel(),
            self._p.ravel(),
        )
        prog.AddBoundingBoxConstraint(-1.1, 1.1, self._q.ravel())
        for variables, size in (
            (self._p, _SCALE_P),
            (self._q, _SCALE_Q),
            (self._tensions, _SCALE_TENSION),
        ):
            for variable in variables.ravel():
                prog.SetVariableScaling(variable, size)
        for q in self._q:
            unit = prog.AddQuadraticConstraint(2.0 * np.eye(4), np.zeros(4), 1.0, 1.0, q)
            unit.evaluator().set_description("unit quaternion")
        prog.SetInitialGuess(self._p, start.p)
        prog.SetInitialGuess(self._q, start.q)
        self._add_costs(n)
        self._add_constraints(n, invert(self._variables.X_SN) @ start)

    def _add_costs(self, n: int) -> None:
        likelihood = self._examination.likelihood
        self._queries = [QueryFactor(query) for query in likelihood.queries]
        self._joint: dict[str, Factor] = {"-log H": ConfigurationFactor(likelihood, self._frames)}
        if likelihood.votes is not None:
            self._joint["-gamma log V"] = VotesFactor(likelihood, self._frames)
        everything = self.gripper_variables()
        for name, factor in self._joint.items():
            self._add_cost(name, factor, everything)
        for k, query in enumerate(self._queries):
            self._add_cost(f"-log Q_{k + 1}", query, everything[7 * k : 7 * k + 7])

    def _add_cost(self, name: str, factor: Factor, over: np.ndarray) -> None:
        def negative(x: Array) -> tuple[Array, Array]:
            value, by_p, by_w = factor(self._variables.poses(x))
            return np.array([-value]), -self._variables.jacobian(x, by_p[None], by_w[None])

        cost = self._prog.AddCost(Differentiable(negative, scalar=True), vars=over)
        cost.evaluator().set_description(name)

    def _add_constraints(self, n: int, X_NG: Pose) -> None:
        examination, everything = self._examination, self.gripper_variables()
        parameters, features = examination.parameters, examination.query.scan.features
        surface = examination.surface
        seed_N = invert(self._variables.X_SN) @ self._seed
        largest_gap = max(parameters.off_surface, surface.hole) - 5e-4
        clearance = max(parameters.clearance, surface.spacing)
        for k in range(n):
            near = SmoothSurface(features, seed_N.p[k], np.sqrt(3.0) * self._reach, surface.spacing)
            on = SurfaceConstraint(
                near, axis_of(X_NG.q[k], 2), largest_gap, parameters.min_elevation
            )
            self._add_constraint(
                f"gripper {k + 1} on the surface", on, everything[7 * k : 7 * k + 7]
            )
            cable = CableConstraint(self._frames, k, seed_N, features.p, clearance, self._reach)
            self._add_constraint(f"cable {k + 1} clear of the payload", cable, everything)
        if n > 1:
            apart = SeparationConstraint(self._frames, parameters.separation)
            self._add_constraint("quadrotors apart", apart, everything)
            self._add_equilibrium(
                n, EquilibriumConstraint(self._frames, seed_N, examination.centre), X_NG
            )

    def _add_constraint(self, name: str, constraint: Constraint, over: np.ndarray) -> None:
        def function(x: Array) -> tuple[Array, Array]:
            value, by_p, by_w = constraint(self._variables.poses(x))
            return value, self._variables.jacobian(x, by_p, by_w)

        bound = self._prog.AddConstraint(
            Differentiable(function), lb=constraint.lower, ub=constraint.upper, vars=over
        )
        bound.evaluator().set_description(name)

    def _add_equilibrium(self, n: int, constraint: EquilibriumConstraint, X_NG: Pose) -> None:
        def function(x: Array) -> tuple[Array, Array]:
            value, by_p, by_w, by_t = constraint(self._variables.poses(x[:-n]), x[-n:])
            return value, np.hstack([self._variables.jacobian(x[:-n], by_p, by_w), by_t])

        over = np.concatenate([self.gripper_variables(), self._tensions])
        bound = self._prog.AddConstraint(
            Differentiable(function), lb=constraint.lower, ub=constraint.upper, vars=over
        )
        bound.evaluator().set_description("taut static equilibrium")
        self._prog.AddBoundingBoxConstraint(_LEAST_TENSION, 2.0, self._tensions)
        shares = load_shares(
            X_NG.p,
            self._examination.likelihood.configuration.quadrotors_over(X_NG).p,
            self._examination.centre,
        )
        guess = np.full(n, 1.0 / n) if shares is None else np.maximum(shares, _LEAST_TENSION)
        self._prog.SetInitialGuess(self._tensions, guess)

    def _log_likelihood(self, x: Array) -> tuple[Array, Array]:
        X_NG = self._variables.poses(x)
        value, by_p, by_w = 0.0, np.zeros_like(X_NG.p), np.zeros_like(X_NG.p)
        for factor in self._joint.values():
            log_f, f_p, f_w = factor(X_NG)
            value, by_p, by_w = value + log_f, by_p + f_p, by_w + f_w
        for k, query in enumerate(self._queries):
            log_q, q_p, q_w = query(Pose(X_NG.p[k : k + 1], X_NG.q[k : k + 1]))
            value += log_q
            by_p[k] += q_p[0]
            by_w[k] += q_w[0]
        return np.array([value]), self._variables.jacobian(x, by_p[None], by_w[None])
