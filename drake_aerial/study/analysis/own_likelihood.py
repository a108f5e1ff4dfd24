"""How likely the baseline's own objective finds its contacts, and those of our method (was its search stuck)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.contacts.transfer import query
from drake_aerial.errors import InputError, JobError
from drake_aerial.features.canonical_frame import to_canonical
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.surface_features import compute_features
from drake_aerial.geometry import Pose, invert
from drake_aerial.parallel import one_blas_thread
from drake_aerial.skill.contact_skill import ContactSkill

# A recomputed likelihood further from the file's than this is not the same objective.
_SAME = 1e-3


@dataclass(frozen=True)
class OwnLikelihood:
    """Log-likelihoods under the baseline's objective, in one condition.

    Attributes
    ----------
    condition : str
        Which.
    own : tuple of float
        Of the baseline's solutions, the best first.
    rival : float or None
        Of the likeliest of the other method's solutions; None if it could not be computed.
    rival_method : str
        Which method that is.
    note : str
        Why it could not be.
    """

    condition: str
    own: tuple[float, ...]
    rival: float | None
    rival_method: str
    note: str = ""


@one_blas_thread
def own_likelihood(
    condition: str,
    skill: ContactSkill,
    cloud: PointCloud,
    baseline: ContactSolutions,
    rival: ContactSolutions,
    count: int,
) -> OwnLikelihood:
    """Return the baseline's objective at its own solutions and at another method's.

    Parameters
    ----------
    condition : str
        A name.
    skill : ContactSkill
        Of both transfers.
    cloud : PointCloud
        The scan of both, in S.
    baseline, rival : ContactSolutions
        The transfers.
    count : int
        How many solutions of each are compared.
    """
    own = tuple(solution.log_likelihood for solution in baseline.solutions[:count])
    try:
        cloud_N, X_SN = to_canonical(cloud)
        features = compute_features(cloud_N, skill.parameters.features)
        hull = HorizontalHull.of_points(features.p)
        # As `transfer` does: the first of three streams is the query density's.
        rng = np.random.default_rng(baseline.seed).spawn(3)[0]
        evidence = query(
            skill,
            features,
            hull,
            X_SN,
            cloud_N.viewpoint,
            baseline.method,
            TransferParameters(),
            rng,
        )
    except (InputError, JobError) as error:
        return OwnLikelihood(
            condition, own, None, rival.method, f"the baseline's objective cannot be built: {error}"
        )
    likelihood = evidence.likelihood
    if likelihood is None or not own or not rival.solutions:
        return OwnLikelihood(condition, own, None, rival.method, "one of the methods found nothing")

    def at(solutions: ContactSolutions) -> np.ndarray:
        chosen = [solution.X_SG for solution in solutions.solutions[:count]]
        X_NS = invert(X_SN)
        X_SG = Pose(np.stack([X.p for X in chosen]), np.stack([X.q for X in chosen]))
        return likelihood(X_NS @ X_SG)

    again = at(baseline)
    if np.abs(again - np.array(own)).max() > _SAME:
        return OwnLikelihood(
            condition,
            own,
            None,
            rival.method,
            "the scan or the parameters are not those of the transfer",
        )
    return OwnLikelihood(condition, own, float(at(rival).max()), rival.method)
