"""Refinement: solutions never get worse, and become feasible and distinct where they can."""

import json
from dataclasses import replace

import numpy as np
import pytest

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.feasibility.contact_checker import ContactChecker
from drake_aerial.contacts.feasibility.reasons import ReasonKind
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.refinement.program import ContactProgram
from drake_aerial.contacts.refinement.refine import refine
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
from drake_aerial.statics.lift import Lift
from tests.contacts.box_scans import box_cloud, box_demonstration
from tests.contacts.formations import FAST, SIZE, examined, kinds, learnt_skill, transferred

LIMITS = TransferParameters()


def refined_alone(skill, solutions, seed):
    """Return the refinement of one seed."""
    return refine(skill, replace(solutions, solutions=(seed,)), merge=False)[0]


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
    each = [refined_alone(skill, solutions, seed) for seed in solutions.solutions]
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
    # Likelihood and surface of a refined solution are those of its poses.
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
        found.append(refined_alone(learnt_skill(n), solutions, seed).feasible)
    # The undisturbed solution, which is feasible, is at most 5 cm away.
    assert np.mean(found) >= 0.8


def test_crowded_quadrotors_move_apart():
    solutions = transferred(3)
    X = solutions[0].X_SG
    middle = X.p.mean(axis=0)
    seed = examined(3, Pose(middle + 0.84 * (X.p - middle), X.q))
    assert ReasonKind.QUADROTORS_TOO_CLOSE in kinds(seed)
    refined = refined_alone(learnt_skill(3), solutions, seed)
    assert refined.feasible
    gaps = np.linalg.norm(refined.X_SQ.p - np.roll(refined.X_SQ.p, 1, axis=0), axis=1)
    assert gaps.min() >= LIMITS.separation


def test_a_cable_clears_a_wall():
    # A step of two levels: the contact at the wall's foot has its cable against the wall.
    lower, upper = (
        box_cloud([0.6, 0.4, 0.1], seed=5).points,
        box_cloud([0.2, 0.4, 0.4], seed=6).points,
    )
    cloud = np.vstack([lower, upper + [0.4, 0.0, 0.15]])
    skill = learn(box_demonstration(SIZE))
    solutions = transfer(skill, PointCloud.read(cloud), parameters=FAST)
    at_wall = Pose(np.array([[0.292, 0.0, 0.05]]), np.array([[1.0, 0, 0, 0]]))
    checker = ContactChecker(solutions.query, LIMITS)
    seed = checker.solution(invert(checker.X_SN) @ at_wall)
    assert ReasonKind.CABLE_THROUGH_PAYLOAD in kinds(seed)
    refined = refined_alone(skill, solutions, seed)
    assert refined.feasible
    assert refined.X_SG.p[0, 0] < 0.292


def test_limits_are_those_of_the_transfer_unless_others_are_given():
    # Each of two carries half of 2 kg, 9.8 N; they hold 7 N less their own 2.5 N.
    solutions, lift = transferred(2), Lift(2.0, (7.0, 7.0), (0.25, 0.25))
    checker = ContactChecker(solutions.query, replace(LIMITS, lift=lift))
    seed = checker.solution(invert(checker.X_SN) @ solutions[0].X_SG)
    assert kinds(seed) == {ReasonKind.TOO_MUCH_TENSION}
    heavy = replace(solutions, parameters=checker.parameters, solutions=(seed,))
    assert kinds(refine(learnt_skill(2), heavy, merge=False)[0]) == {ReasonKind.TOO_MUCH_TENSION}
    assert refine(learnt_skill(2), heavy, parameters=LIMITS, merge=False)[0].feasible


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
