"""Transfer a learnt contact to a new cloud (the paper's section "Transferring to novel surfaces")."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from drake_aerial.choices import METHODS
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.centroid import centroid_contacts
from drake_aerial.contacts.contact_query import Evidence
from drake_aerial.contacts.feasibility.local_surface import LocalSurface
from drake_aerial.contacts.feasibility.reasons import reasons_against
from drake_aerial.contacts.likelihood.contact_likelihood import ContactLikelihood, ScalePrior
from drake_aerial.contacts.likelihood.query_density import (
    NormalisedQuery,
    Query,
    ResampledQuery,
    draw_candidates,
)
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.search.annealing import anneal
from drake_aerial.contacts.search.selection import distinct
from drake_aerial.contacts.search.starts import draw_starts
from drake_aerial.contacts.solutions import ContactSolutions, Solution
from drake_aerial.contacts.votes.height_profile import Relief
from drake_aerial.contacts.votes.hull_votes import HullVotes
from drake_aerial.contacts.votes.paper_votes import paper_votes
from drake_aerial.contacts.votes.scan_cuts import Cuts
from drake_aerial.errors import InputError
from drake_aerial.features.canonical_frame import to_canonical
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.surface_features import SurfaceFeatures, compute_features
from drake_aerial.geometry import Array, Pose, axis_of, quat_about_axis, quat_from_xz, rotate
from drake_aerial.parallel import one_blas_thread
from drake_aerial.skill.configuration_model import ConfigurationModel
from drake_aerial.skill.contact_skill import ContactSkill


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
    """Find where the skill's grippers belong on a new cloud.

    Everything is computed in the cloud's canonical frame N and mapped back, so that contacts follow the
    cloud under yaw and translation, and under any rotation if `up` turns with it.

    Parameters
    ----------
    skill : ContactSkill
        What was learnt from the demonstration, for n grippers.
    cloud : PointCloud
        The new payload's cloud, in its frame S [m]; its `up` and `viewpoint` are honoured.
    method : str
        `task`, `paper`, `kopicki`, `control` (`task` without votes) or `centroid`.
    top : int
        Number of distinct solutions wanted; fewer where fewer exist.
    seed : int
        The same inputs and seed give the same solutions, bit for bit.
    parameters : TransferParameters, optional
        Bandwidths and numbers.
    progress : callable, optional
        Called now and then with the fraction done and what is being done.

    Returns
    -------
    ContactSolutions
        In S, the likeliest first, feasible or with reasons.

    Raises
    ------
    InputError
        If the method is unknown, or the cloud has no surface features.
    JobError
        If votes or contact density are zero on the whole cloud; the message says which.

    Examples
    --------
    >>> from drake_aerial import read_scan, read_skill, transfer
    >>> contacts = transfer(read_skill("flat"), read_scan("box_68x68x28"), top=1)
    >>> bool(abs(contacts.best.X_SG.p[0] - [0.0, 0.0, 0.14]).max() < 0.02)  # the middle of the top
    True
    """
    parameters = parameters or TransferParameters()
    if method not in METHODS:
        raise InputError(f"unknown method {method!r}; accepted: {', '.join(METHODS)}")
    if top < 1 or seed < 0:
        raise InputError(f"top should be at least 1 and seed not negative, got {top} and {seed}")
    clock = [time.perf_counter()]
    report = progress or (lambda fraction, what: None)

    report(0.0, "surface features")
    # The new object's features, in its canonical frame.
    cloud_N, X_SN = to_canonical(cloud)
    features = compute_features(cloud_N, skill.parameters.features)
    hull = HorizontalHull.of_points(features.p)
    surface = LocalSurface(features)
    clock.append(time.perf_counter())

    if method == "centroid":
        X_NG = centroid_contacts(skill.configuration, hull, surface)
        log_j = np.zeros(1)
        evidence = Evidence(X_SN, features, hull, None, None, "rigid")
        clock.append(time.perf_counter())
    else:
        report(0.2, "query density")
        # Where the surface looks like the contact, and where the votes would have it.
        streams = np.random.default_rng(seed).spawn(3)
        evidence = query(
            skill, features, hull, X_SN, cloud_N.viewpoint, method, parameters, streams[0]
        )
        assert evidence.likelihood is not None
        starts = draw_starts(evidence.likelihood, parameters, streams[1])
        clock.append(time.perf_counter())

        # The likeliest configurations, set down on the surface.
        annealing = lambda fraction: report(0.4 + 0.6 * fraction, "annealing")  # noqa: E731
        X_NG, _ = anneal(
            partial(evidence.likelihood, coarse=True), starts, parameters, streams[2], annealing
        )
        X_NG, _, _ = surface.set_down(X_NG)
        log_j = evidence.likelihood(X_NG)
        evidence = replace(evidence, chains=X_NG.take(np.argsort(-log_j, kind="stable")))
    chosen = distinct(X_NG, log_j, top, parameters.distinct, skill.configuration.cable_length)
    X_NG = _spin_free(skill, X_NG.take(chosen))
    solutions = _solutions(skill, X_NG, log_j[chosen], X_SN, hull, surface, parameters)
    clock.append(time.perf_counter())
    report(1.0, "done")
    names = ("features_s", "query_s", "optimise_s")
    return ContactSolutions(
        method=method,
        seed=seed,
        skill=skill.label,
        cloud=cloud.to_record(),
        timing={name: round(b - a, 4) for name, a, b in zip(names, clock, clock[1:])},
        solutions=solutions,
        parameters=parameters,
        evidence=evidence,
        scan=cloud,
    )


def query(
    skill: ContactSkill,
    features: SurfaceFeatures,
    hull: HorizontalHull,
    X_SN: Pose,
    viewpoint: Array | None,
    method: str,
    parameters: TransferParameters,
    rng: np.random.Generator,
) -> Evidence:
    """Build the densities of a method on a new cloud's features in N (docs/method.md).

    Methods that differ in their votes alone draw the same candidates from the same generator.
    """
    votes_kind, sampling = METHODS[method]
    bandwidth, axial = skill.parameters.bandwidth, skill.parameters.axial
    vote_rng, *gripper_rngs = rng.spawn(len(skill) + 1)
    votes, scale = None, "rigid"
    # `control` knows what `task` knows of the object's size: they differ in the votes alone.
    complete = parameters.scale != "auto" or sampling != "normalised"
    cuts = Cuts.none() if complete else Cuts.find(features, hull, viewpoint)
    if votes_kind == "hull":
        scale = "support" if parameters.scale == "auto" else parameters.scale
        votes = HullVotes(skill, features, hull, cuts, scale, parameters, vote_rng)
    size_ratio = float(np.sqrt(hull.area / skill.hull.area))
    queries: list[Query] = []
    for n, gripper_rng in enumerate(gripper_rngs):
        draw_rng, paper_rng, resample_rng = gripper_rng.spawn(3)
        count = parameters.candidates if sampling == "normalised" else parameters.paper_candidates
        candidates, log_weights = draw_candidates(skill, n, features, count, draw_rng)
        if votes_kind == "paper":
            V = paper_votes(skill, n, features, size_ratio, parameters, paper_rng)
            log_weights = log_weights + V.log_density(candidates)
        if sampling == "normalised":
            queries.append(
                NormalisedQuery(
                    candidates,
                    log_weights,
                    bandwidth.position,
                    bandwidth.rotation,
                    axial,
                    parameters.floor,
                )
            )
        else:
            queries.append(
                ResampledQuery(
                    candidates,
                    log_weights,
                    parameters.kernels,
                    bandwidth.position,
                    bandwidth.rotation,
                    axial,
                    resample_rng,
                )
            )
    prior = _scale_prior(skill, hull, cuts, votes, method, parameters)
    configuration = skill.configuration
    if len(skill) > 1 and sampling == "normalised":
        configuration = _on_relief(skill, features, prior)
    likelihood = ContactLikelihood(configuration, tuple(queries), votes, prior)
    return Evidence(X_SN, features, hull, likelihood, votes, scale)


def _on_relief(
    skill: ContactSkill, features: SurfaceFeatures, prior: ScalePrior
) -> ConfigurationModel:
    """Return the configuration model as this object's levels would have it: heights stretched as its relief is, and as
    much freer as the reliefs differ.
    """
    configuration, cell = skill.configuration, features.rho
    taught, found = (Relief.of_points(points, cell) for points in (skill.points, features.p))
    scale = float(np.exp(prior.log_mean))
    stretch, spread = found.stretch_and_spread(taught, scale, configuration.sigma_p)
    # The whole formation is scaled too.
    return configuration.raised(
        stretch / scale, configuration.sigma_p / np.hypot(configuration.sigma_p, spread)
    )


def _scale_prior(
    skill: ContactSkill,
    hull: HorizontalHull,
    cuts: Cuts,
    votes: HullVotes | None,
    method: str,
    parameters: TransferParameters,
) -> ScalePrior:
    """Return how large the formation is expected: by the hulls, or as demonstrated.

    `control` has the prior of `task`, so that it differs in the votes alone; no vote tells it the yaw.
    """
    if len(skill) == 1 or parameters.scale == "rigid" or METHODS[method][1] != "normalised":
        return ScalePrior(0.0, 0.02)
    p_FG = skill.configuration.X_FG.p
    if votes is None:
        return ScalePrior.of_best_yaw(hull, skill.hull, p_FG, cuts)
    return ScalePrior.of_hulls(hull, skill.hull, float(votes.density.mode[2]), p_FG, cuts)


def _spin_free(skill: ContactSkill, X_NG: Pose) -> Pose:
    """Give grippers that are symmetric about their z axis, whose turn about it annealing left to chance, a
    fixed one.
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


def _solutions(
    skill: ContactSkill,
    X_NG: Pose,
    log_j: Array,
    X_SN: Pose,
    hull: HorizontalHull,
    surface: LocalSurface,
    parameters: TransferParameters,
) -> tuple[Solution, ...]:
    X_NQ = skill.configuration.quadrotors_over(X_NG)
    _, normal, distance = surface.set_down(X_NG)
    solutions = []
    for k in range(len(log_j)):
        reasons = reasons_against(
            X_NG.take(k), X_NQ.take(k), distance[k], hull.centroid, surface, parameters
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
