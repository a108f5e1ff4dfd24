"""Refinement of solutions: each is the initial guess of a contact program; the better is kept."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from drake_aerial.contacts.feasibility.contact_checker import ContactChecker
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.refinement.program import REACH, ContactProgram
from drake_aerial.contacts.search.selection import distinct
from drake_aerial.contacts.solutions import ContactSolutions, Solution
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, Pose, invert
from drake_aerial.skill.contact_skill import ContactSkill

# Number of features near an infeasible gripper that are considered as footholds; of these, the
# likeliest `_TRIED` are tried, then the nearest `_TRIED`.
_CONSIDERED, _TRIED = 150, 30
# Largest number of the solver's major iterations; nearly all programs end within 20.
_ITERATIONS = 40
# Number of further seeds tried per solution wanted, if several seeds end at the same place.
_FURTHER = 3


def refine(
    skill: ContactSkill,
    solutions: ContactSolutions,
    *,
    parameters: TransferParameters | None = None,
    solver: str = "snopt",
    reach: float = REACH,
    merge: bool = True,
    top: int | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> ContactSolutions:
    """Improve the solutions of a transfer by local optimisation (docs/method.md).

    No solution gets worse. A feasible one stays feasible and its likelihood does not fall. An
    infeasible one becomes feasible, at any likelihood; failing that, it is only replaced by one of
    larger likelihood with at most as many reasons against it.

    Parameters
    ----------
    skill : ContactSkill
        The learnt skill.
    solutions : ContactSolutions
        Result of `transfer` with this skill.
    parameters : TransferParameters, optional
        Limits of feasibility; those of the transfer by default.
    solver : str
        `snopt`, `ipopt` or `nlopt`.
    reach : float
        Largest displacement of a contact from its seed along each axis [m].
    merge : bool
        If True, seeds that end at the same place give one solution, and ends of other annealing
        chains are refined until there are `top`. If False, every seed gives one solution.
    top : int, optional
        Number of distinct solutions wanted; by default as many as are given. Fewer are returned if
        the chains found fewer places.
    progress : callable, optional
        Called with the fraction done and the name of the step.

    Returns
    -------
    ContactSolutions
        Ranked by their new likelihood; `timing` gains `refine_s`.

    Raises
    ------
    InputError
        If the solutions have no `query` (they were read from a file, or are of `centroid`) or
        another number of grippers than the skill, the solver is unknown, or `top` is less than 1.

    Examples
    --------
    >>> from drake_aerial import read_scan, read_skill, refine, transfer
    >>> skill = read_skill("flat")
    >>> contacts = transfer(skill, read_scan("box_68x68x28"), top=1)
    >>> refined = refine(skill, contacts)
    >>> bool(refined.best.log_likelihood >= contacts.best.log_likelihood)
    True
    """
    if top is not None and top < 1:
        raise InputError(f"`top` must be at least 1, got {top}")
    begin, report = time.perf_counter(), progress or (lambda fraction, step: None)
    limits = parameters or solutions.parameters or TransferParameters()
    checker = ContactChecker(solutions.query, limits)
    improve = partial(_refined, skill, checker, solver=solver, reach=reach)
    refined = []
    for k, seed in enumerate(solutions.solutions):
        report(k / len(solutions), "refinement")
        refined.append(improve(seed))
    if merge and refined:
        refined = _distinct(refined, top or len(refined), skill, checker, improve)
    refined.sort(key=lambda solution: -solution.log_likelihood)
    report(1.0, "refinement")
    ranked = tuple(replace(solution, rank=rank) for rank, solution in enumerate(refined, 1))
    timing = solutions.timing | {"refine_s": round(time.perf_counter() - begin, 4)}
    return replace(solutions, solutions=ranked, timing=timing)


def _refined(
    skill: ContactSkill, checker: ContactChecker, seed: Solution, *, solver: str, reach: float
) -> Solution:
    """Return the refinement of a seed, or the seed itself if nothing better is found."""
    best = seed
    for start in _starts(checker, seed, reach):
        program = ContactProgram(
            skill,
            checker.query,
            seed,
            start=checker.X_SN @ start,
            reach=reach,
            checker=checker,
        )
        found = program.solve(solver, iterations=_ITERATIONS).solution
        if not found.feasible:
            # The start itself may be better than the seed.
            found = checker.solution(start)
        if _better(found, best):
            best = replace(found, rank=seed.rank)
        if best.feasible:
            break
    return best


def _better(found: Solution, kept: Solution) -> bool:
    """Return True if a solution is to replace the one kept so far."""
    if found.feasible != kept.feasible:
        return found.feasible
    likelier = found.log_likelihood > kept.log_likelihood
    return likelier and (found.feasible or len(found.reasons) <= len(kept.reasons))


def _starts(checker: ContactChecker, seed: Solution, reach: float) -> Iterator[Pose]:
    """Yield initial guesses X_NG (n,) for a seed.

    First the seed set down on the surface, infeasible grippers moved to footholds; then the seed
    set down as it is, if that differs.
    """
    X_NG, _, _ = checker.surface.set_down(invert(checker.X_SN) @ seed.X_SG)
    moved = _on_footholds(checker, X_NG, reach)
    yield moved
    if moved is not X_NG:
        yield X_NG


def _on_footholds(checker: ContactChecker, X_NG: Pose, reach: float) -> Pose:
    """Return grippers (n,) of which infeasible ones are moved to a feasible feature nearby."""
    features, X = checker.features, X_NG
    upward = features.normal[:, 2] > np.sin(checker.parameters.min_elevation)
    for k in range(len(X.p)):
        if not checker.reasons_of_one(X, k):
            continue
        near = np.flatnonzero(upward & np.all(np.abs(features.p - X_NG.p[k]) <= reach, axis=1))
        near = near[:: max(len(near) // _CONSIDERED, 1)]
        if not len(near):
            continue
        trials = Pose(
            np.repeat(X.p[None], len(near), axis=0), np.repeat(X.q[None], len(near), axis=0)
        )
        trials.p[:, k], trials.q[:, k] = features.p[near], features.q[near]
        order = np.argsort(-checker.likelihood(trials, coarse=True), kind="stable")
        nearest = np.argsort(np.linalg.norm(features.p[near] - X_NG.p[k], axis=1), kind="stable")
        tried = [*order[:_TRIED], *nearest[:_TRIED]]
        feasible = (i for i in tried if not checker.reasons_of_one(trials.take(i), k))
        chosen = next(feasible, None)
        X = X if chosen is None else trials.take(chosen)
    return X


def _distinct(
    refined: list[Solution],
    wanted: int,
    skill: ContactSkill,
    checker: ContactChecker,
    improve: Callable[[Solution], Solution],
) -> list[Solution]:
    """Return up to `wanted` distinct solutions, refining ends of other chains if there are fewer.

    Parameters
    ----------
    refined : list of Solution
        Refined solutions; refinements of further seeds are appended.
    wanted : int
        Number of solutions.
    skill : ContactSkill
        The skill, for its cable lengths.
    checker : ContactChecker
        Checker with the ends of the chains.
    improve : callable
        Refinement of one seed.
    """
    distance, lengths = checker.parameters.distinct, skill.configuration.cable_length
    order = _merged(refined, distance, lengths)
    for further in _further_seeds(checker, refined, _FURTHER * wanted):
        if len(order) >= wanted:
            break
        refined.append(improve(further))
        order = _merged(refined, distance, lengths)
    return [refined[i] for i in order[:wanted]]


def _further_seeds(
    checker: ContactChecker, refined: list[Solution], most: int
) -> Iterator[Solution]:
    """Yield up to `most` ends of annealing chains, always the one furthest from all of `refined`.

    The caller may append to `refined` meanwhile. Grippers count as interchangeable.
    """
    chains, X_NS = checker.query.chains, invert(checker.X_SN)
    if chains is None:
        return
    distance, compared = np.full(len(chains.p), np.inf), 0
    for _ in range(most):
        for solution in refined[compared:]:
            distance = np.minimum(distance, _distance(chains.p, (X_NS @ solution.X_SG).p))
        compared = len(refined)
        furthest = int(np.argmax(distance))
        if distance[furthest] < checker.parameters.distinct:
            return
        # Its refinement may end at a known place; it is not tried again.
        distance[furthest] = 0.0
        yield checker.solution(chains.take(furthest))


def _distance(a: Array, b: Array) -> Array:
    """Return the distances (K,) [m] of configurations a (K, n, 3) from b (n, 3).

    That is the largest distance of a gripper of either from the nearest gripper of the other.
    """
    gap = np.linalg.norm(a[:, :, None] - b, axis=-1)
    return np.maximum(gap.min(axis=2).max(axis=1), gap.min(axis=1).max(axis=1))


def _merged(refined: list[Solution], distance: float, cable_length: Array) -> np.ndarray:
    """Return the indices of distinct solutions, the likeliest first.

    A feasible solution is never merged into an infeasible one.
    """
    X = Pose(np.stack([s.X_SG.p for s in refined]), np.stack([s.X_SG.q for s in refined]))
    log_j = np.array([s.log_likelihood for s in refined])
    feasible = np.array([s.feasible for s in refined])
    groups = []
    for group in (np.flatnonzero(feasible), np.flatnonzero(~feasible)):
        if len(group):
            groups.append(
                group[distinct(X.take(group), log_j[group], len(group), distance, cable_length)]
            )
    kept = np.sort(np.concatenate(groups))
    return kept[np.argsort(-log_j[kept], kind="stable")]
