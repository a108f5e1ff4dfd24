"""Recompute the densities of a saved transfer: contacts.json holds only solutions."""

import numpy as np

from drake_aerial.choices import BASELINES, METHODS
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.canonical_scan import CanonicalScan
from drake_aerial.contacts.contact_query import ContactQuery
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.prepare_query import prepare_query
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.skill.contact_skill import ContactSkill

# Largest difference of log J at which the recomputed densities count as those of the transfer.
_TOLERANCE = 1e-3


def recompute_query(
    solutions: ContactSolutions, skill: ContactSkill, cloud: PointCloud
) -> ContactQuery | None:
    """Rebuild the densities of a transfer from its inputs, without the search.

    Parameters
    ----------
    solutions : ContactSolutions
        Solutions of a transfer, for instance read from a file. Its method, seed and parameters
        are used.
    skill : ContactSkill
        The skill of the transfer.
    cloud : PointCloud
        The scan of the transfer, in its frame S.

    Returns
    -------
    ContactQuery or None
        None if the solutions are not as likely as they say, since skill, scan or parameters are
        others. None too if there is no solution, or the method has no densities (a baseline).

    Raises
    ------
    InputError, JobError
        If the densities cannot be built on this scan; as `transfer`.
    """
    method = solutions.method
    if not solutions.solutions or method not in METHODS or method in BASELINES:
        return None
    X_SG = solutions.X_SG
    if X_SG.p.shape[1] != len(skill):
        return None
    query = prepare_query(
        skill,
        CanonicalScan.of_cloud(cloud, skill.parameters.features),
        solutions.method,
        solutions.parameters or TransferParameters(),
        solutions.seed,
    )
    saved = [solution.log_likelihood for solution in solutions.solutions]
    same = np.allclose(query.log_likelihood(X_SG), saved, rtol=0.0, atol=_TOLERANCE)
    return query if same else None
