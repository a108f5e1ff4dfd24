"""Contact programs: solvers, equilibrium, and costs and constraints of the user's."""

import numpy as np
import pytest

from drake_aerial.contacts.feasibility.reasons import ReasonKind
from drake_aerial.contacts.refinement.program import ContactProgram
from drake_aerial.contacts.refinement.solvers import SOLVERS
from drake_aerial.geometry import (
    Pose,
    invert,
    quat_exp,
    quat_multiply,
    transform,
)
from drake_aerial.statics.tensions import load_shares
from tests.contacts.formations import examined, kinds, learnt_skill, transferred


@pytest.mark.parametrize("n", [2, 3])
def test_equilibrium_is_found_again(n):
    solutions = transferred(n)
    X = solutions[0].X_SG
    middle = X.p.mean(axis=0)
    # As small as quadrotors may come, and so far to the side that the centre is outside.
    along = (X.p[0] - middle) / np.linalg.norm(X.p[0] - middle)
    size = 0.36 / np.linalg.norm(X.p[0] - X.p[1])
    inside = 0.5 if n == 3 else 1.0
    shift = inside * size * np.linalg.norm(X.p[0] - middle) + 0.02
    seed = examined(n, Pose(size * (X.p - middle) + middle * [0, 0, 1] + shift * along, X.q))
    assert kinds(seed) & {ReasonKind.ONE_SIDED, ReasonKind.UNBALANCED}
    program = ContactProgram(learnt_skill(n), solutions.query, seed)
    result = program.solve()
    assert result.success
    assert result.solution.feasible
    tension = result.drake.GetSolution(program.tensions())
    assert tension.min() > 0.0
    # The program's tensions are those of the independent non-negative least squares.
    query = solutions.query
    X_NS = invert(query.scan.X_SN)
    share = load_shares(
        transform(X_NS, result.solution.X_SG.p),
        transform(X_NS, result.solution.X_SQ.p),
        query.scan.hull.centroid,
    )
    np.testing.assert_allclose(tension, share, atol=0.02)


@pytest.mark.parametrize("solver", SOLVERS)
def test_solvers_agree(solver):
    solutions, skill = transferred(2), learnt_skill(2)
    result = ContactProgram(skill, solutions.query, solutions[1]).solve(solver, iterations=300)
    assert result.success
    assert result.solution.feasible
    reference = ContactProgram(skill, solutions.query, solutions[1]).solve("snopt")
    assert result.solution.log_likelihood == pytest.approx(
        reference.solution.log_likelihood, abs=2e-3
    )
    assert result.solution.log_likelihood > solutions[1].log_likelihood


def test_a_users_own_cost_draws_the_contact():
    solutions, skill = transferred(1), learnt_skill(1)
    wanted = solutions[0].X_SG.p[0, :2] + [0.04, -0.03]
    distances = []
    for weight in (0.0, 100.0, 1e5):
        program = ContactProgram(skill, solutions.query, solutions[0])
        x, y = program.positions()[0, :2]
        program.prog().AddQuadraticCost(weight * ((x - wanted[0]) ** 2 + (y - wanted[1]) ** 2))
        result = program.solve()
        assert result.success
        assert result.solution.feasible
        distances.append(np.linalg.norm(result.solution.X_SG.p[0, :2] - wanted))
    assert distances[0] > distances[1] > distances[2]
    assert distances[2] < 0.002


def test_a_users_own_constraint_and_generic_cost_hold():
    solutions, skill = transferred(3), learnt_skill(3)
    limit = solutions[0].X_SG.p[0, 0] + 0.02
    spread = []
    for weight in (0.0, 1e4):
        program = ContactProgram(skill, solutions.query, solutions[0])
        program.prog().AddLinearConstraint(program.positions()[0, 0] >= limit)
        # Shares as equal as can be; a plain Python function that Drake differentiates by itself.
        program.prog().AddCost(
            lambda tension, weight=weight: weight * ((tension - 1.0 / 3.0) ** 2).sum(),
            vars=program.tensions(),
        )
        result = program.solve()
        assert result.success
        assert result.solution.X_SG.p[0, 0] == pytest.approx(limit, abs=1e-4)
        spread.append(np.ptp(result.drake.GetSolution(program.tensions())))
    assert spread[0] > 0.02
    assert spread[1] < 0.25 * spread[0]


def test_a_users_own_variable_needs_no_guess():
    solutions = transferred(1)
    program = ContactProgram(learnt_skill(1), solutions.query, solutions[0])
    slack = program.prog().NewContinuousVariables(1, "slack")
    x = program.positions()[0, 0]
    program.prog().AddLinearConstraint(slack[0] >= x - solutions[0].X_SG.p[0, 0] + 0.03)
    program.prog().AddQuadraticCost(1e5 * slack[0] ** 2)
    result = program.solve()
    assert result.success
    assert result.solution.X_SG.p[0, 0] == pytest.approx(solutions[0].X_SG.p[0, 0] - 0.03, abs=2e-3)


def test_an_impossible_constraint_is_named():
    solutions = transferred(1)
    program = ContactProgram(learnt_skill(1), solutions.query, solutions[0])
    program.prog().AddLinearConstraint(
        program.positions()[0, 2] >= solutions[0].X_SG.p[0, 2] + 0.05
    )
    result = program.solve()
    assert not result.success
    assert not result.solution.feasible
    names = result.drake.GetInfeasibleConstraintNames(program.prog())
    assert any("surface" in name or "Linear" in name for name in names)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_violated_constraint_of_the_users_is_a_reason_with_its_name(solver):
    solutions = transferred(1)
    program = ContactProgram(learnt_skill(1), solutions.query, solutions[0], reach=0.05)
    x, y = program.positions()[0, :2]
    start = solutions[0].X_SG.p[0, :2].sum()
    # Each of x and y may grow by 5 cm, and the constraint asks for 16 cm in all.
    far = program.prog().AddLinearConstraint(x + y >= start + 0.16)
    far.evaluator().set_description("keep to the corner")
    result = program.solve(solver)
    assert not result.solution.feasible
    (reason,) = (r for r in result.solution.reasons if r.kind is ReasonKind.CONSTRAINT_VIOLATED)
    assert reason.name == "keep to the corner"
    assert reason.value >= 0.06 - 1e-3
    assert str(reason).startswith('constraint "keep to the corner" is violated by 0.')


def test_a_constraint_without_a_description_is_named_by_its_variables():
    solutions = transferred(1)
    program = ContactProgram(learnt_skill(1), solutions.query, solutions[0])
    x, y = program.positions()[0, :2]
    program.prog().AddConstraint(x**2 + y**2 >= 25.0)
    (reason,) = program.solve().solution.reasons
    assert reason.name == "QuadraticConstraint of p_SG(0,0), p_SG(0,1)"


@pytest.mark.parametrize("solver", ["snopt", "ipopt"])
def test_a_constraint_at_whose_stationary_point_the_seed_is_gets_satisfied(solver):
    # The gradient of (x - c)^2 is zero at c, where the solver starts.
    solutions, distance = transferred(1), 0.03
    c = solutions[0].X_SG.p[0, :2]
    program = ContactProgram(learnt_skill(1), solutions.query, solutions[0])
    x, y = program.positions()[0, :2]
    program.prog().AddConstraint((x - c[0]) ** 2 + (y - c[1]) ** 2 == distance**2)
    result = program.solve(solver)
    assert result.success
    assert result.solution.feasible
    assert np.linalg.norm(result.solution.X_SG.p[0, :2] - c) == pytest.approx(distance, abs=1e-3)
    again = program.solve(solver)
    np.testing.assert_array_equal(again.solution.X_SG.p, result.solution.X_SG.p)


def test_a_cost_at_whose_stationary_point_the_seed_is_gets_lower():
    # At the refined solution the gradient of J is zero too.
    solutions, distance = transferred(1), 0.03
    seed = ContactProgram(learnt_skill(1), solutions.query, solutions[0]).solve(tolerance=1e-7)
    c = seed.solution.X_SG.p[0, :2]
    program = ContactProgram(learnt_skill(1), solutions.query, seed.solution)
    x, y = program.positions()[0, :2]
    square = (x - c[0]) ** 2 + (y - c[1]) ** 2
    program.prog().AddCost(1e7 * (square - distance**2) ** 2)
    result = program.solve()
    assert result.solution.feasible
    assert np.linalg.norm(result.solution.X_SG.p[0, :2] - c) == pytest.approx(distance, abs=3e-3)


def test_a_constraint_on_the_turn_of_a_symmetric_gripper_is_kept():
    solutions = transferred(1)
    program = ContactProgram(learnt_skill(1), solutions.query, solutions[0])
    wanted = quat_multiply(solutions[0].X_SG.q[0], quat_exp([0.0, 0.0, 0.6]))
    program.prog().AddBoundingBoxConstraint(wanted - 0.05, wanted + 0.05, program.quaternions()[0])
    result = program.solve()
    assert result.solution.feasible
    assert np.abs(result.solution.X_SG.q[0] - wanted).max() <= 0.051
