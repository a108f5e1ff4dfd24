"""The contact program and the refinement: never worse, feasible where it can be, open to a user's own costs."""

import json
from dataclasses import replace

import numpy as np
import pytest

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.feasibility.contact_checker import Examination
from drake_aerial.contacts.feasibility.reasons import load_shares
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.refinement.program import ContactProgram
from drake_aerial.contacts.refinement.refine import refine, refine_one
from drake_aerial.contacts.refinement.solvers import SOLVERS
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.contacts.transfer import transfer
from drake_aerial.errors import InputError
from drake_aerial.geometry import (
    Pose,
    axis_of,
    cross,
    invert,
    perpendicular,
    quat_exp,
    quat_multiply,
    transform,
)
from drake_aerial.skill.learn import learn
from tests.contacts.box_scans import box_cloud, box_demonstration
from tests.contacts.formations import FAST, SIZE, learnt_skill, transferred

LIMITS = TransferParameters()


def examined(n, X_SG, **kinds):
    """The solution that grippers X_SG are, with what speaks against them."""
    query = transferred(n, **kinds).query
    return Examination(query, LIMITS).solution(invert(query.scan.X_SN) @ X_SG)


def off(X, rng):
    d = rng.uniform(0.015, 0.05, (len(X.p), 1)) * rng.choice([-1.0, 1.0], (len(X.p), 1))
    return Pose(X.p + d * axis_of(X.q, 2), X.q)


def tilted(X, rng):
    z, angle = axis_of(X.q, 2), rng.uniform(-np.pi, np.pi, (len(X.p), 1))
    e = perpendicular(z)
    about = np.cos(angle) * e + np.sin(angle) * cross(z, e)
    return Pose(
        X.p, quat_multiply(quat_exp(np.deg2rad(rng.uniform(20.0, 70.0, angle.shape)) * about), X.q)
    )


@pytest.mark.parametrize("n", [1, 2, 3])
def test_never_worse_than_the_seed(n):
    solutions, skill = transferred(n), learnt_skill(n)
    each = [refine_one(skill, solutions.query, seed) for seed in solutions.solutions]
    for seed, refined in zip(solutions.solutions, each):
        assert seed.feasible
        assert refined.feasible
        assert refined.log_likelihood >= seed.log_likelihood
    # Annealing at these settings leaves something to gain.
    assert (
        max(r.log_likelihood - s.log_likelihood for s, r in zip(solutions.solutions, each)) > 1e-3
    )
    together = refine(skill, solutions, merge=False)
    assert [s.rank for s in together.solutions] == list(range(1, len(solutions) + 1))
    assert sorted(s.log_likelihood for s in together.solutions) == sorted(
        s.log_likelihood for s in each
    )
    assert np.all(np.diff([s.log_likelihood for s in together.solutions]) <= 0.0)
    # What is said of a refined solution is what the transfer's own functions say of its poses.
    query = solutions.query
    for refined in together.solutions:
        X_NG = invert(query.scan.X_SN) @ refined.X_SG
        assert query.likelihood(Pose(X_NG.p[None], X_NG.q[None]))[0] == pytest.approx(
            refined.log_likelihood
        )
        np.testing.assert_allclose(refined.X_SG.p[:, 2], 0.14, atol=0.003)
        np.testing.assert_allclose(axis_of(refined.X_SG.q, 2), refined.normal, atol=0.05)
        gap = np.abs(
            np.linalg.norm(refined.X_SQ.p - refined.X_SG.p, axis=1)
            - skill.configuration.cable_length
        )
        assert gap.max() < 1e-9


@pytest.mark.parametrize("n", [1, 3])
@pytest.mark.parametrize("disturbed", [off, tilted])
def test_infeasible_seeds_become_feasible(n, disturbed):
    solutions, rng = transferred(n), np.random.default_rng(n)
    found = []
    for solution in solutions.solutions * (3 if n == 1 else 1):
        seed = examined(n, disturbed(solution.X_SG, rng))
        assert not seed.feasible
        found.append(refine_one(learnt_skill(n), solutions.query, seed).feasible)
    # The undisturbed solution, which is feasible, is at most 5 cm away.
    assert np.mean(found) >= 0.8


def test_crowded_quadrotors_move_apart():
    solutions = transferred(3)
    X = solutions[0].X_SG
    middle = X.p.mean(axis=0)
    seed = examined(3, Pose(middle + 0.84 * (X.p - middle), X.q))
    assert "too close" in "".join(seed.reasons)
    refined = refine_one(learnt_skill(3), solutions.query, seed)
    assert refined.feasible
    gaps = np.linalg.norm(refined.X_SQ.p - np.roll(refined.X_SQ.p, 1, axis=0), axis=1)
    assert gaps.min() >= LIMITS.separation


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
    assert "equilibrium" in "".join(seed.reasons)
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


def test_a_cable_clears_a_wall():
    # A step of two levels: the contact at the wall's foot has its cable against the wall.
    lower, upper = (
        box_cloud([0.6, 0.4, 0.1], seed=5).points,
        box_cloud([0.2, 0.4, 0.4], seed=6).points,
    )
    cloud = np.vstack([lower, upper + [0.4, 0.0, 0.15]])
    skill = learn(box_demonstration(SIZE))
    solutions = transfer(skill, PointCloud.read(cloud), parameters=FAST)
    query = solutions.query
    at_wall = Pose(np.array([[0.292, 0.0, 0.05]]), np.array([[1.0, 0, 0, 0]]))
    seed = Examination(query, LIMITS).solution(invert(query.scan.X_SN) @ at_wall)
    assert "cable through the payload" in seed.reasons
    refined = refine_one(skill, query, seed)
    assert refined.feasible
    assert refined.X_SG.p[0, 0] < 0.292


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
    names = result.drake.GetInfeasibleConstraintNames(program.prog())
    assert any("surface" in name or "Linear" in name for name in names)


def test_contacts_follow_the_cloud():
    skill, cloud = learnt_skill(1), box_cloud([0.45, 0.35, 0.25], seed=1, noise=0.0005)
    X = Pose(np.array([3.0, -1.0, 0.7]), quat_exp([0.0, 0.0, 2.1]))
    here, there = (
        refine(skill, transfer(skill, c, top=1, parameters=FAST))
        for c in (cloud, cloud.transformed(X))
    )
    np.testing.assert_allclose(there[0].X_SG.p, transform(X, here[0].X_SG.p), atol=2e-4)
    assert there[0].log_likelihood == pytest.approx(here[0].log_likelihood, abs=1e-3)


def test_same_solutions_same_bytes():
    first, second = (json.loads(refine(learnt_skill(2), transferred(2)).to_json()) for _ in "ab")
    assert first["timing"].pop("refine_s") > 0.0
    second["timing"].pop("refine_s")
    assert first == second


def test_seeds_that_end_at_one_place_are_returned_once():
    solutions, skill = transferred(1), learnt_skill(1)
    twice = replace(solutions, solutions=(*solutions.solutions, solutions[0]))
    merged, all_ = refine(skill, twice), refine(skill, twice, merge=False)
    assert len(all_) == len(twice)
    assert len(merged) < len(all_)
    assert [s.rank for s in merged.solutions] == list(range(1, len(merged) + 1))
    # The ends of other chains that take the twins' places may be likelier still.
    assert merged[0].log_likelihood >= all_[0].log_likelihood
    p = np.array([s.X_SG.p[0] for s in merged.solutions])
    gaps = np.linalg.norm(p[:, None] - p, axis=-1)[np.triu_indices(len(p), 1)]
    assert np.all(gaps >= LIMITS.distinct)


def test_as_many_distinct_solutions_as_wanted_come_back():
    # All seeds the same: the other places come from the other chains.
    solutions, skill = transferred(3), learnt_skill(3)
    same = replace(solutions, solutions=(solutions[0],) * 5)
    refined = refine(skill, same)
    assert len(refined) == 5
    assert [s.rank for s in refined.solutions] == [1, 2, 3, 4, 5]
    log_j = [s.log_likelihood for s in refined.solutions]
    assert log_j == sorted(log_j, reverse=True)
    assert log_j[0] >= solutions[0].log_likelihood
    p = np.array([s.X_SG.p for s in refined.solutions])
    for i, j in zip(*np.triu_indices(len(p), 1), strict=True):
        # Some gripper stands elsewhere, whichever of the other's it is compared with.
        gap = np.linalg.norm(p[i][:, None] - p[j], axis=-1)
        assert max(gap.min(axis=1).max(), gap.min(axis=0).max()) >= LIMITS.distinct
    assert len(refine(skill, same, top=2)) == 2
    assert len(refine(skill, same, merge=False)) == 5
    with pytest.raises(InputError, match="top"):
        refine(skill, same, top=0)


def test_what_cannot_be_refined_is_refused(tmp_path):
    solutions, skill = transferred(1), learnt_skill(1)
    solutions.write(tmp_path / "contacts.json")
    with pytest.raises(InputError, match="densities of a transfer"):
        refine(skill, ContactSolutions.read(tmp_path / "contacts.json"))
    with pytest.raises(InputError, match="centroid"):
        refine(skill, transferred(1, "centroid"))
    with pytest.raises(InputError, match="3 grippers"):
        ContactProgram(learnt_skill(3), solutions.query, solutions[0])
    with pytest.raises(InputError, match="snopt, ipopt, nlopt"):
        refine(skill, solutions, solver="gurobi")
    with pytest.raises(InputError, match="reach"):
        refine(skill, solutions, reach=0.0)
