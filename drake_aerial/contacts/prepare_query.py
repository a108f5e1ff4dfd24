"""Prepare the densities of a transfer: votes, query densities, priors (docs/method.md)."""

import numpy as np

from drake_aerial.choices import METHODS
from drake_aerial.contacts.canonical_scan import CanonicalScan
from drake_aerial.contacts.contact_query import ContactQuery
from drake_aerial.contacts.likelihood.contact_likelihood import ContactLikelihood, ScalePrior
from drake_aerial.contacts.likelihood.query_density import (
    NormalisedQuery,
    Query,
    ResampledQuery,
    draw_candidates,
)
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.votes.height_profile import HeightProfile
from drake_aerial.contacts.votes.hull_votes import HullVotes
from drake_aerial.contacts.votes.paper_votes import paper_votes
from drake_aerial.contacts.votes.scan_cuts import ScanCuts
from drake_aerial.skill.configuration_model import ConfigurationModel
from drake_aerial.skill.contact_skill import ContactSkill


def random_streams(seed: int) -> list[np.random.Generator]:
    """Return three random generators: for densities, initial configurations and annealing.

    Draws from one of them do not change the others.
    """
    return np.random.default_rng(seed).spawn(3)


def prepare_query(
    skill: ContactSkill,
    scan: CanonicalScan,
    method: str,
    parameters: TransferParameters,
    seed: int,
) -> ContactQuery:
    """Build the densities of a method on a new scan.

    Methods that differ in their votes alone draw the same candidates from the same seed.

    Parameters
    ----------
    skill : ContactSkill
        The learnt skill, for n grippers.
    scan : CanonicalScan
        The new payload's scan, with features of the skill's parameters.
    method : str
        A key of `METHODS` except `centroid`, which has no densities.
    parameters : TransferParameters
        Bandwidths and sample counts.
    seed : int
        Seed of the transfer.

    Raises
    ------
    JobError
        If votes or contact density are zero on the whole scan; the message says which.
    """
    votes_kind, sampling = METHODS[method]
    votes_rng, *gripper_rngs = random_streams(seed)[0].spawn(len(skill) + 1)
    cuts = _cuts(scan, sampling, parameters)
    hull = cuts.completed(scan.hull)
    votes = None
    if votes_kind == "hull":
        scale = "support" if parameters.scale == "auto" else parameters.scale
        votes = HullVotes(skill, scan.features, hull, cuts, scale, parameters, votes_rng)
    queries = tuple(
        _query_density(skill, n, scan, method, parameters, rng)
        for n, rng in enumerate(gripper_rngs)
    )
    prior = _scale_prior(skill, scan, cuts, votes, sampling, parameters)
    configuration = skill.configuration
    if len(skill) > 1 and sampling == "normalised":
        configuration = _with_heights_of(scan, skill, prior)
    return ContactQuery(scan, ContactLikelihood(configuration, queries, votes, prior))


def _cuts(scan: CanonicalScan, sampling: str, parameters: TransferParameters) -> ScanCuts:
    """Return the scan's cuts for methods that choose the votes' scale by the scan, else none.

    `control` uses them as `task` does, so that the two differ in the votes alone.
    """
    if parameters.scale != "auto" or sampling != "normalised":
        return ScanCuts.none()
    if scan.boundary is not None:
        return ScanCuts.known(scan.features, scan.hull, scan.boundary)
    return ScanCuts.find(scan.features, scan.hull, scan.viewpoint)


def _query_density(
    skill: ContactSkill,
    gripper: int,
    scan: CanonicalScan,
    method: str,
    parameters: TransferParameters,
    rng: np.random.Generator,
) -> Query:
    """Return the query density Q_n or C_n of one gripper."""
    votes_kind, sampling = METHODS[method]
    bandwidth, axial = skill.parameters.bandwidth, skill.parameters.axial
    candidates_rng, votes_rng, resampling_rng = rng.spawn(3)
    normalised = sampling == "normalised"
    count = parameters.candidates if normalised else parameters.paper_candidates
    candidates, log_weights = draw_candidates(skill, gripper, scan.features, count, candidates_rng)
    if votes_kind == "paper":
        size_ratio = float(np.sqrt(scan.hull.area / skill.hull.area))
        votes = paper_votes(skill, gripper, scan.features, size_ratio, parameters, votes_rng)
        log_weights = log_weights + votes.log_density(candidates)
    if normalised:
        return NormalisedQuery(
            candidates,
            log_weights,
            bandwidth.position,
            bandwidth.rotation,
            axial,
            parameters.floor,
        )
    return ResampledQuery(
        candidates,
        log_weights,
        parameters.kernels,
        bandwidth.position,
        bandwidth.rotation,
        axial,
        resampling_rng,
    )


def _scale_prior(
    skill: ContactSkill,
    scan: CanonicalScan,
    cuts: ScanCuts,
    votes: HullVotes | None,
    sampling: str,
    parameters: TransferParameters,
) -> ScalePrior:
    """Return the prior of the formation's scale: read off the hulls, or one as demonstrated.

    `control` has the prior of `task`, so that the two differ in the votes alone. Without votes the
    yaw between the objects is the one at which their hulls are most alike.
    """
    if len(skill) == 1 or parameters.scale == "rigid" or sampling != "normalised":
        return ScalePrior(0.0, 0.02)
    p_FG = skill.configuration.X_FG.p
    hull = cuts.completed(scan.hull)
    if votes is None:
        return ScalePrior.of_best_yaw(hull, skill.hull, p_FG, cuts)
    yaw = float(votes.density.mode[2])
    return ScalePrior.of_hulls(hull, skill.hull, yaw, p_FG, cuts)


def _with_heights_of(
    scan: CanonicalScan, skill: ContactSkill, prior: ScalePrior
) -> ConfigurationModel:
    """Return the configuration model with the heights that suit the new scan.

    Heights are stretched as the height profiles of the two objects compare. Their bandwidth grows
    by what the stretch leaves unexplained.
    """
    configuration, cell = skill.configuration, scan.features.rho
    demonstrated = HeightProfile.of_points(skill.points, cell)
    scale = float(np.exp(prior.log_mean))
    stretch, residual = HeightProfile.of_points(scan.features.p, cell).stretch_from(
        demonstrated, scale, configuration.sigma_p
    )
    vertical = configuration.sigma_p / np.hypot(configuration.sigma_p, residual)
    # The likelihood scales the whole formation, heights included.
    return configuration.with_heights(stretch / scale, vertical)
