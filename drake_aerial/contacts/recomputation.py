"""The evidence of a transfer, asked for again: contacts.json holds the solutions, not what they were found from."""

from __future__ import annotations

import numpy as np

from drake_aerial.choices import METHODS
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.contact_query import Evidence
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.contacts.transfer import query
from drake_aerial.features.canonical_frame import to_canonical
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.surface_features import compute_features
from drake_aerial.geometry import Pose, invert
from drake_aerial.skill.contact_skill import ContactSkill

_TOLERANCE = 0.01


def evidence_again(
    solutions: ContactSolutions,
    skill: ContactSkill,
    cloud: PointCloud,
    parameters: TransferParameters | None = None,
) -> Evidence | None:
    """Return what `transfer` found solutions from, without searching again.

    Parameters
    ----------
    solutions : ContactSolutions
        As read from a file.
    skill, cloud, parameters
        What they were found with.

    Returns
    -------
    Evidence or None
        None where they were found with something else, so that the likelihoods of the solutions are not those that they
        carry; and for `centroid`, which has no likelihood.
    """
    count = len(solutions[0].X_SG.p) if len(solutions) else 0
    if count != len(skill) or solutions.method not in METHODS or solutions.method == "centroid":
        return None
    cloud_N, X_SN = to_canonical(cloud)
    features = compute_features(cloud_N, skill.parameters.features)
    evidence = query(
        skill,
        features,
        HorizontalHull.of_points(features.p),
        X_SN,
        cloud_N.viewpoint,
        solutions.method,
        parameters or TransferParameters(),
        np.random.default_rng(solutions.seed).spawn(3)[0],
    )
    assert evidence.likelihood is not None
    X_SG = Pose(
        np.stack([s.X_SG.p for s in solutions.solutions]),
        np.stack([s.X_SG.q for s in solutions.solutions]),
    )
    log_j = evidence.likelihood(invert(X_SN) @ X_SG)
    known = np.array([s.log_likelihood for s in solutions.solutions])
    return evidence if np.allclose(log_j, known, rtol=0.0, atol=_TOLERANCE) else None
