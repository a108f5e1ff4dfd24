"""Refining annealed solutions: each seeds a MathematicalProgram, and is kept where that finds nothing better."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from drake_aerial.contacts.contact_query import ContactQuery
from drake_aerial.contacts.feasibility.contact_checker import Examination
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.refinement.program import REACH, ContactProgram
from drake_aerial.contacts.search.selection import distinct
from drake_aerial.contacts.solutions import ContactSolutions, Solution
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, Pose, invert
from drake_aerial.skill.contact_skill import ContactSkill

# Features around an infeasible gripper that are looked at, and how many of them, the likeliest and then the nearest
# first, are tried as footholds.
_CONSIDERED, _TRIED = 150, 30
# Most major iterations of the solver; nearly all programs end within 20.
_ITERATIONS = 40
# Further seeds that are tried, for each solution wanted, where several end at the same place.
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

    No solution gets worse: a feasible one stays feasible and its likelihood does not fall; an infeasible one becomes
    feasible, at whatever likelihood that takes, or else is replaced only by one with fewer or the same reasons against
    it and a larger likelihood.

    Parameters
    ----------
    skill : ContactSkill
        What was learnt.
    solutions : ContactSolutions
        What `transfer` returned with this skill, with its `query`.
    parameters : TransferParameters, optional
        Limits of feasibility; those of the transfer.
    solver : str
        `snopt`, `ipopt` or `nlopt`.
    reach : float
        How far a contact may move from its seed along each axis [m].
    merge : bool
        Whether seeds that end at the same place are returned once, so that solutions stay distinct; then ends of other
        annealing chains are refined too, until there are `top`. Else one is returned for every seed.
    top : int, optional
        Number of distinct solutions wanted; as many as are given by default. Fewer are returned where the chains found
        fewer places.
    progress : callable, optional
        Called with the fraction done and what is being done.

    Returns
    -------
    ContactSolutions
        Ranked by likelihood anew; `timing` gains `refine_s`.

    Raises
    ------
    InputError
        If the solutions have no `query` (they were read from a file, or are of `centroid`), come from a skill
        of another number of grippers, the solver is unknown, or `top` is less than 1.

    Examples
    --------
    >>> from drake_aerial import read_scan, read_skill, refine, transfer
    >>> skill = read_skill("flat")
    >>> contacts = transfer(skill, read_scan("box_68x68x28"), top=1)
    >>> bool(refine(skill, contacts).best.log_likelihood >= contacts.best.log_likelihood)
    True
    """
    if top is not None and top < 1:
        raise InputError(f"top should be at least 1, got {top}")
    wanted = len(solutions) if top is None else top
    parameters = parameters or TransferParameters()
    report = progress or (lambda fraction, what: None)
    begin = time.perf_counter()
    examination = Examination(solutions.query, parameters)
    refined = []
    for k, seed in enumerate(solutions.solutions):
        report(k / len(solutions), "refinement")
        refined.append(_refined(skill, examination, seed, solver, reach))
    order = np.argsort([-solution.log_likelihood for solution in refined], kind="stable")
    if merge and refined:
        cable_length = skill.configuration.cable_length
        order = _merged(refined, parameters.distinct, cable_length)
        for further in _further_seeds(examination, refined, _FURTHER * wanted):
            if len(order) >= wanted:
                break
            refined.append(_refined(skill, examination, further, solver, reach))
            order = _merged(refined, parameters.distinct, cable_length)
        order = order[:wanted]
    report(1.0, "refinement")
    ranked = tuple(replace(refined[i], rank=rank) for rank, i in enumerate(order, 1))
    timing = solutions.timing | {"refine_s": round(time.perf_counter() - begin, 4)}
    return replace(solutions, solutions=ranked, timing=timing)


def refine_one(
    skill: ContactSkill,
    query: ContactQuery | None,
    seed: Solution,
    *,
    parameters: TransferParameters | None = None,
    solver: str = "snopt",
    reach: float = REACH,
) -> Solution:
    """Return the refinement of one solution, or the solution itself where nothing better is found; as `refine`."""
    return _refined(
        skill, Examination(query, parameters or TransferParameters()), seed, solver, reach
    )


def _further_seeds(
    examination: Examination, known: list[Solution], most: int
) -> Iterator[Solution]:
    """Yield up to `most` ends of annealing chains, each time the one furthest from the solutions known by then.

    The list may grow meanwhile. Grippers are taken for interchangeable.
    """
    chains, X_NS = examination.query.chains, invert(examination.query.scan.X_SN)
    if chains is None:
        return
    away, seen = np.full(len(chains.p), np.inf), 0
    for _ in range(most):
        for solution in known[seen:]:
            away = np.minimum(away, _apart(chains.p, (X_NS @ solution.X_SG).p))
        seen = len(known)
        furthest = int(np.argmax(away))
        if away[furthest] < examination.parameters.distinct:
            return
        # Where it ends may be known; it is not tried again.
        away[furthest] = 0.0
        yield examination.solution(chains.take(furthest))


def _apart(a: Array, b: Array) -> Array:
    """Return how far configurations a (K, n, 3) are from b (n, 3): the largest distance of a gripper of either from the
    nearest of the other [m], shape (K,).
    """
    gap = np.linalg.norm(a[:, :, None] - b, axis=-1)
    return np.maximum(gap.min(axis=2).max(axis=1), gap.min(axis=1).max(axis=1))


def _refined(
    skill: ContactSkill, examination: Examination, seed: Solution, solver: str, reach: float
) -> Solution:
    query, best = examination.query, seed
    for start in _starts(examination, seed, reach):
        program = ContactProgram(
            skill,
            query,
            seed,
            reach=reach,
            start=query.scan.X_SN @ start,
            examination=examination,
        )
        found = program.solve(solver, iterations=_ITERATIONS).solution
        if not found.feasible:
            # Where it started may do.
            found = examination.solution(start)
        if _better(found, best):
            best = replace(found, rank=seed.rank)
        if best.feasible:
            break
    return best


def _starts(examination: Examination, seed: Solution, reach: float) -> Iterator[Pose]:
    """Yield initial guesses in N: the seed set down on the surface, grippers that cannot stand there on footholds; then
    the seed set down as it is, if that differs.
    """
    X_NG, _, _ = examination.surface.set_down(invert(examination.query.scan.X_SN) @ seed.X_SG)
    standing = _on_footholds(examination, X_NG, reach)
    yield standing
    if standing is not X_NG:
        yield X_NG


def _on_footholds(examination: Examination, X_NG: Pose, reach: float) -> Pose:
    """Return grippers (n,) of which those that cannot stand where they are stand on features nearby that let them."""
    features, X = examination.query.scan.features, X_NG
    upward = features.normal[:, 2] > np.sin(examination.parameters.min_elevation)
    for k in range(len(X.p)):
        if not examination.reasons_of_one(X, k):
            continue
        near = np.flatnonzero(upward & np.all(np.abs(features.p - X_NG.p[k]) <= reach, axis=1))
        near = near[:: max(len(near) // _CONSIDERED, 1)]
        if not len(near):
            continue
        trials = Pose(
            np.repeat(X.p[None], len(near), axis=0), np.repeat(X.q[None], len(near), axis=0)
        )
        trials.p[:, k], trials.q[:, k] = features.p[near], features.q[near]
        order = np.argsort(-examination.likelihood(trials, coarse=True), kind="stable")
        nearest = np.argsort(np.linalg.norm(features.p[near] - X_NG.p[k], axis=1), kind="stable")
        tried = [*order[:_TRIED], *nearest[:_TRIED]]
        stands = (i for i in tried if not examination.reasons_of_one(trials.take(i), k))
        chosen = next(stands, None)
        X = X if chosen is None else trials.take(chosen)
    return X


def _better(found: Solution, kept: Solution) -> bool:
    if found.feasible != kept.feasible:
        return found.feasible
    likelier = found.log_likelihood > kept.log_likelihood
    return likelier and (found.feasible or len(found.reasons) <= len(kept.reasons))


def _merged(refined: list[Solution], distance: float, cable_length: Array) -> np.ndarray:
    """Return the indices of distinct solutions, the likeliest first; a feasible one is never merged into another that
    is not.
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
