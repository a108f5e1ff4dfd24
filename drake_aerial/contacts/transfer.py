"""Transfer learnt contacts to a new cloud (the paper's "Transferring to novel surfaces")."""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from drake_aerial.choices import BASELINES, METHODS
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.baselines.baseline_contacts import baseline_contacts
from drake_aerial.contacts.canonical_scan import CanonicalScan
from drake_aerial.contacts.contact_query import ContactQuery
from drake_aerial.contacts.feasibility.checks import reasons_against
from drake_aerial.contacts.hidden_extent import hidden_extents
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.prepare_query import prepare_query, random_streams
from drake_aerial.contacts.search.annealing import anneal, draw_initial_configurations
from drake_aerial.contacts.search.selection import distinct
from drake_aerial.contacts.solutions import ContactSolutions, Solution
from drake_aerial.contacts.trust.with_trust import with_trust
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, Pose, axis_of, quat_about_axis, quat_from_xz, rotate
from drake_aerial.parallel import one_blas_thread
from drake_aerial.skill.contact_skill import ContactSkill

_PHASES = ("features_s", "query_s", "optimise_s")


@one_blas_thread
def transfer(
    skill: ContactSkill,
    cloud: PointCloud,
    *,
    method: str = "task",
    top: int = 5,
    seed: int = 0,
    parameters: TransferParameters | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> ContactSolutions:
    """Find contacts for the skill's grippers on a new cloud.

    The method works in the cloud's canonical frame N. Contacts therefore follow the cloud under yaw
    and translation, and under any rotation if `up` turns with it.

    Parameters
    ----------
    skill : ContactSkill
        The learnt skill, for n grippers.
    cloud : PointCloud
        The new payload's cloud in its frame S [m]; its `up` and `viewpoint` are used.
    method : str
        `task`, `paper`, `kopicki`, `control` (`task` without votes), `registration`, `obb` or
        `centroid`.
    top : int
        Number of distinct solutions wanted; fewer are returned where fewer exist.
    seed : int
        Random seed. The same inputs and seed give the same solutions, bit for bit.
    parameters : TransferParameters, optional
        Bandwidths, sample counts and limits of feasibility.
    progress : callable, optional
        Called now and then with the fraction done and the name of the current step.

    Returns
    -------
    ContactSolutions
        Solutions in S, the likeliest first; those that cannot be flown carry the reasons.

    Raises
    ------
    InputError
        If an argument is out of range, or the cloud has no surface features.
    JobError
        If votes or contact density are zero on the whole cloud; the message says which.

    Examples
    --------
    >>> from drake_aerial import read_scan, read_skill, transfer
    >>> contacts = transfer(read_skill("flat"), read_scan("box_68x68x28"), top=1)
    >>> bool(abs(contacts.best.X_SG.p[0] - [0.0, 0.0, 0.14]).max() < 0.02)  # middle of the top
    True
    """
    _check_arguments(method, top, seed)
    parameters = parameters or TransferParameters()
    report = progress or (lambda fraction, step: None)
    clock = [time.perf_counter()]
    report(0.0, "surface features")
    scan = CanonicalScan.of_cloud(cloud, skill.parameters.features)
    clock.append(time.perf_counter())
    if method in BASELINES:
        query = None
        X_NG, log_j = baseline_contacts(method, skill, scan)
        clock.append(time.perf_counter())
    else:
        report(0.2, "query density")
        query = prepare_query(skill, scan, method, parameters, seed)
        _, starts_rng, annealing_rng = random_streams(seed)
        starts = draw_initial_configurations(query.likelihood, parameters, starts_rng)
        clock.append(time.perf_counter())
        X_NG, log_j = _maximise(query, starts, parameters, annealing_rng, report)
        query = replace(query, chains=X_NG.take(np.argsort(-log_j, kind="stable")))
    solutions = _ranked_solutions(skill, scan, X_NG, log_j, top, parameters)
    solutions = with_trust(method, skill, scan, solutions, parameters)
    clock.append(time.perf_counter())
    report(1.0, "done")
    timing = {name: round(b - a, 4) for name, a, b in zip(_PHASES, clock, clock[1:])}
    cloud = cloud.assuming(*scan.features.assumptions)
    votes = None if query is None else query.likelihood.votes
    return ContactSolutions(
        method,
        seed,
        skill.label,
        cloud.to_record(),
        timing,
        solutions,
        parameters,
        query,
        cloud,
        hidden_extents(skill, votes, scan.hull, scan.X_SN),
    )


def _check_arguments(method: str, top: int, seed: int) -> None:
    if method not in METHODS:
        raise InputError(f"`method` must be one of {', '.join(METHODS)}, got {method!r}")
    if top < 1:
        raise InputError(f"`top` must be at least 1, got {top}")
    if seed < 0:
        raise InputError(f"`seed` must be at least 0, got {seed}")


def _maximise(
    query: ContactQuery,
    starts: Pose,
    parameters: TransferParameters,
    rng: np.random.Generator,
    report: Callable[[float, str], None],
) -> tuple[Pose, Array]:
    """Anneal the start configurations and set their ends down on the surface.

    Returns
    -------
    X_NG : Pose
        Configurations on the surface, batch (chains, n).
    log_j : (chains,) array
        log J there.
    """
    X_NG, _ = anneal(
        partial(query.likelihood, coarse=True),
        starts,
        parameters,
        rng,
        lambda fraction: report(0.4 + 0.6 * fraction, "annealing"),
    )
    X_NG, _, _ = query.scan.surface.set_down(X_NG)
    return X_NG, query.likelihood(X_NG)


def _ranked_solutions(
    skill: ContactSkill,
    scan: CanonicalScan,
    X_NG: Pose,
    log_j: Array,
    top: int,
    parameters: TransferParameters,
) -> tuple[Solution, ...]:
    """Return at most `top` distinct solutions in S, likeliest first, checked for feasibility."""
    configuration, X_SN = skill.configuration, scan.X_SN
    chosen = distinct(X_NG, log_j, top, parameters.distinct, configuration.cable_length)
    log_j, X_NG = log_j[chosen], _with_fixed_spin(skill, X_NG.take(chosen))
    X_NQ = configuration.quadrotors_over(X_NG)
    _, normal, distance = scan.surface.set_down(X_NG)
    solutions = []
    for k in range(len(log_j)):
        reasons = reasons_against(
            X_NG.take(k), X_NQ.take(k), distance[k], scan.hull.centroid, scan.surface, parameters
        )
        solutions.append(
            Solution(
                rank=k + 1,
                log_likelihood=float(log_j[k]),
                feasible=not reasons,
                reasons=reasons,
                X_SG=X_SN @ X_NG.take(k),
                normal=rotate(X_SN.q, normal[k]),
                X_SQ=X_SN @ X_NQ.take(k),
            )
        )
    return tuple(solutions)


def _with_fixed_spin(skill: ContactSkill, X_NG: Pose) -> Pose:
    """Return grippers turned about their z axes so that x lies along the formation's x axis.

    Grippers that are symmetric about z do not notice, and annealing leaves that angle to chance.
    Other grippers are returned unchanged.
    """
    if not skill.parameters.axial:
        return X_NG
    x = np.zeros_like(X_NG.p)
    x[..., 0] = 1.0
    if len(skill) > 1:
        _, yaw = skill.configuration.formation_frames(X_NG)
        x = rotate(quat_about_axis(np.array([0.0, 0.0, 1.0]), yaw)[..., None, :], x)
    z = axis_of(X_NG.q, 2)
    along = np.abs(np.sum(x * z, axis=-1, keepdims=True)) > 0.999
    return Pose(X_NG.p, quat_from_xz(np.where(along, [0.0, 0.0, 1.0], x), z))
