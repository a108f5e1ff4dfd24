"""Log-likelihoods under the baseline's objective: of its own contacts, and of another method's.

If the other method's contacts are likelier, the baseline's search ended in a local maximum.
"""

from dataclasses import dataclass

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.recomputation import recompute_query
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.errors import InputError, JobError
from drake_aerial.parallel import one_blas_thread
from drake_aerial.skill.contact_skill import ContactSkill


@dataclass(frozen=True)
class OwnLikelihood:
    """Log-likelihoods under the baseline's objective, in one condition.

    Attributes
    ----------
    condition : str
        Name of the condition.
    own : tuple of float
        Log-likelihoods of the baseline's solutions, the best first.
    rival : float or None
        Largest log-likelihood of the other method's solutions; None if it could not be computed.
    rival_method : str
        Name of the other method.
    note : str
        Why `rival` is None; otherwise empty.
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
    """Evaluate the baseline's objective at its own solutions and at another method's.

    Parameters
    ----------
    condition : str
        Name of the condition.
    skill : ContactSkill
        The skill of both transfers.
    cloud : PointCloud
        The scan of both transfers, in S.
    baseline, rival : ContactSolutions
        The transfers. The objective has the baseline's seed and parameters.
    count : int
        Number of solutions of each that are compared.
    """
    own = tuple(solution.log_likelihood for solution in baseline.solutions[:count])

    def failed(note: str) -> OwnLikelihood:
        return OwnLikelihood(condition, own, None, rival.method, note)

    if not own or not rival.solutions:
        return failed("one of the methods found nothing")
    try:
        query = recompute_query(baseline, skill, cloud)
    except (InputError, JobError) as error:
        return failed(f"the baseline's objective cannot be built: {error}")
    if query is None:
        return failed("the scan or the parameters are not those of the transfer")
    rival_log_j = query.log_likelihood(rival.X_SG)[:count]
    return OwnLikelihood(condition, own, float(rival_log_j.max()), rival.method)
