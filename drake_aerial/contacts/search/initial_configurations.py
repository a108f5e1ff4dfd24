"""Initial configurations of annealing, drawn by their likelihood (docs/method.md)."""

from __future__ import annotations

import numpy as np

from drake_aerial.contacts.likelihood.contact_likelihood import ContactLikelihood
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.density.resampling import systematic_resample
from drake_aerial.geometry import Array, Pose, quat_about_axis, rotate

_Z = np.array([0.0, 0.0, 1.0])
# Placements of the formation that are weighed for several grippers.
_PLACEMENTS = 5000


def draw_initial_configurations(
    likelihood: ContactLikelihood, parameters: TransferParameters, rng: np.random.Generator
) -> Pose:
    """Draw configurations X_NG, batch (starts, n), with probability proportional to J.

    One gripper starts at candidates of its query density. For several grippers, one of them is
    placed on one of its candidates. The demonstrated formation is placed around it, at a random yaw
    and a scale from the prior, and the others move to their own nearest candidates.
    """
    if len(likelihood.queries) == 1:
        candidates = likelihood.queries[0].candidates
        placed = Pose(candidates.p[:, None], candidates.q[:, None])
        log_j = likelihood(placed, log_queries=[likelihood.queries[0].log_candidates])
    else:
        placed = _placements(likelihood, rng)
        log_j = likelihood(placed)
    return placed.take(systematic_resample(np.exp(log_j - log_j.max()), parameters.starts, rng))


def _placements(likelihood: ContactLikelihood, rng: np.random.Generator) -> Pose:
    from scipy.spatial import cKDTree

    n, configuration = len(likelihood.queries), likelihood.configuration
    yaw = rng.uniform(0.0, 2.0 * np.pi, _PLACEMENTS)
    scale = np.exp(
        likelihood.prior.log_mean + likelihood.prior.sigma * rng.standard_normal(_PLACEMENTS)
    )
    first = rng.integers(n, size=_PLACEMENTS)
    origin = np.empty((_PLACEMENTS, 3))
    offset = rotate(quat_about_axis(_Z, yaw), configuration.X_FG.p[first]) * scale[:, None]
    for k, query in enumerate(likelihood.queries):
        rows = np.flatnonzero(first == k)
        at: Array = query.candidates.p[rng.integers(len(query.candidates.p), size=len(rows))]
        origin[rows] = at - offset[rows]
    wanted = configuration.demonstrated_at(origin, yaw, scale)
    p, q = np.empty_like(wanted.p), np.empty_like(wanted.q)
    for k, query in enumerate(likelihood.queries):
        _, nearest = cKDTree(query.candidates.p).query(wanted.p[:, k])
        p[:, k], q[:, k] = query.candidates.p[nearest], query.candidates.q[nearest]
    return Pose(p, q)
