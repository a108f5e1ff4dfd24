"""Query density of one gripper: similarity of a new surface to the demonstrated contact."""

import numpy as np

from drake_aerial.density.mixture import systematic_resample
from drake_aerial.density.pose_density import PoseDensity
from drake_aerial.errors import JobError
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array, Pose
from drake_aerial.skill.contact_skill import ContactSkill

# Distance from every contact kernel, in bandwidths, beyond which a descriptor does not resemble the
# contact at all.
_MAX_DISTANCE = 8.0


def draw_candidates(
    skill: ContactSkill,
    gripper: int,
    features: SurfaceFeatures,
    count: int,
    rng: np.random.Generator,
) -> tuple[Pose, Array]:
    """Draw candidate poses L = v_i o u_nk of a gripper, and log-weights log M_n(r_i) O_n(r_i).

    Features i are drawn uniformly over the new cloud's surface, and contact kernels k with
    probability proportional to their likelihood of r_i.

    Parameters
    ----------
    skill : ContactSkill
        The learnt skill, for n grippers.
    gripper : int
        Index of the gripper, 0 to n - 1.
    features : SurfaceFeatures
        Features of the new cloud in its canonical frame N.
    count : int
        Number of candidates.
    rng : numpy.random.Generator
        Random generator.

    Returns
    -------
    candidates : Pose
        X_NG, batch (count,).
    log_weights : (count,) array
        Log-weights of the candidates.

    Raises
    ------
    JobError
        If no feature of the new cloud resembles the demonstrated contact's.
    """
    contact, local = skill.contacts[gripper].density, skill.objects[gripper].density
    drawn = features.take(systematic_resample(np.ones(len(features)), count, rng))
    log_m = contact.log_descriptor_density(drawn.r)
    log_o = local.log_descriptor_density(drawn.r)
    peak = -0.5 * _MAX_DISTANCE**2 + contact.log_descriptor_density(contact.descriptor).max()
    if not log_m.max() > peak:
        raise JobError(
            f"the contact density of gripper {gripper + 1} is zero: no feature of the new cloud is "
            "curved like the demonstrated contact; use a skill demonstrated on a more "
            "similar surface"
        )
    kernel = contact.sample_kernels(drawn.r, rng)
    return drawn.spun(rng) @ contact.pose.take(kernel), log_m + log_o


class NormalisedQuery:
    """Contact density per unit of surface, C_n(L) = Q_M(L) / (D(L) + d0) (docs/method.md).

    Q_M is the KDE over the candidates with their contact weights. D has the same kernels with equal
    weights, and d0 is a fraction of D's median. The quotient does not depend on how densely the
    surface was sampled.

    Parameters
    ----------
    candidates : Pose
        Candidates X_NG, batch (K,).
    log_weights : (K,) array
        Log-weights of the candidates, up to a constant.
    sigma_p, sigma_q : float
        Bandwidths of position [m] and rotation [rad].
    axial : bool
        Whether only the grippers' z axes are compared.
    floor : float
        d0 as a fraction of D's median.

    Attributes
    ----------
    candidates : Pose
        As given.
    log_candidates : (K,) array
        log C at the candidates.
    """

    def __init__(
        self,
        candidates: Pose,
        log_weights: Array,
        sigma_p: float,
        sigma_q: float,
        axial: bool,
        floor: float,
    ):
        self.candidates = candidates
        self._density = PoseDensity(candidates, sigma_p=sigma_p, sigma_q=sigma_q, axial=axial)
        self._coarse = PoseDensity(
            candidates, sigma_p=sigma_p, sigma_q=sigma_q, axial=axial, single=True
        )
        # Weights relative to the best candidate give C the range 0 to 1.
        contact = np.exp(log_weights - log_weights.max()) / len(log_weights)
        self._weights = np.column_stack([contact, self._density.weights])
        self._contact = PoseDensity(
            candidates, contact, sigma_p=sigma_p, sigma_q=sigma_q, axial=axial
        )
        self._log_contact = float(np.log(contact.sum()))
        logs = self._density.log_densities(candidates, self._weights)
        self._log_floor = float(np.log(floor) + np.median(logs[:, 1]))
        self.log_candidates = self._per_surface(logs)

    def log_density(self, X_NG: Pose, coarse: bool = False) -> Array:
        """Return log C (...) at gripper poses (...); `coarse` computes in single precision."""
        return self._per_surface(
            (self._coarse if coarse else self._density).log_densities(X_NG, self._weights)
        )

    def log_density_and_gradient(self, X_NG: Pose) -> tuple[Array, Array, Array]:
        """Return log C (...) and its gradients at gripper poses (...).

        Gradients are by p (..., 3) [1/m] and by the rotation vector w (..., 3) [1/rad] of
        exp(w) R_NG.
        """
        log_m, m_p, m_w = self._contact.log_density_and_gradient(X_NG)
        log_d, d_p, d_w = self._density.log_density_and_gradient(X_NG)
        log_sum = np.logaddexp(log_d, self._log_floor)
        share = np.exp(log_d - log_sum)[..., None]
        return log_m + self._log_contact - log_sum, m_p - share * d_p, m_w - share * d_w

    def _per_surface(self, logs: Array) -> Array:
        """Return log C (...) from the logarithms (..., 2) of Q_M and D."""
        return logs[..., 0] - np.logaddexp(logs[..., 1], self._log_floor)


class ResampledQuery:
    """The paper's query density: the KDE over N_Q candidates resampled by their weights.

    Parameters
    ----------
    candidates : Pose
        Candidates X_NG, batch (K,).
    log_weights : (K,) array
        Log-weights of the candidates, up to a constant.
    count : int
        Number N_Q of kernels.
    sigma_p, sigma_q : float
        Bandwidths of position [m] and rotation [rad].
    axial : bool
        Whether only the grippers' z axes are compared.
    rng : numpy.random.Generator
        Random generator of the resampling.

    Attributes
    ----------
    candidates : Pose
        X_NG of the kernels, batch (N_Q,).
    log_candidates : (N_Q,) array
        log Q there.
    """

    def __init__(
        self,
        candidates: Pose,
        log_weights: Array,
        count: int,
        sigma_p: float,
        sigma_q: float,
        axial: bool,
        rng: np.random.Generator,
    ):
        self.candidates = candidates.take(
            systematic_resample(np.exp(log_weights - log_weights.max()), count, rng)
        )
        self._density = PoseDensity(self.candidates, sigma_p=sigma_p, sigma_q=sigma_q, axial=axial)
        self._coarse = PoseDensity(
            self.candidates, sigma_p=sigma_p, sigma_q=sigma_q, axial=axial, single=True
        )
        self.log_candidates = self._density.log_density(self.candidates)

    def log_density(self, X_NG: Pose, coarse: bool = False) -> Array:
        """Return log Q (...) at gripper poses (...); `coarse` computes in single precision."""
        return (self._coarse if coarse else self._density).log_density(X_NG)

    def log_density_and_gradient(self, X_NG: Pose) -> tuple[Array, Array, Array]:
        """Return log Q (...) and its gradients at gripper poses (...).

        Gradients are by p (..., 3) [1/m] and by the rotation vector w (..., 3) [1/rad] of
        exp(w) R_NG.
        """
        return self._density.log_density_and_gradient(X_NG)


Query = NormalisedQuery | ResampledQuery
