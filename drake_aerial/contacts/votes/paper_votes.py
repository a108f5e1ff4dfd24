"""The paper's votes: frames of task features on a new cloud predict gripper poses."""

import numpy as np

from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.density.mixture import systematic_resample
from drake_aerial.density.pose_density import PoseDensity
from drake_aerial.errors import JobError
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Pose, invert
from drake_aerial.skill.contact_skill import ContactSkill


def paper_votes(
    skill: ContactSkill,
    gripper: int,
    features: SurfaceFeatures,
    size_ratio: float,
    parameters: TransferParameters,
    rng: np.random.Generator,
) -> PoseDensity:
    """Return V_n, the density of votes for one gripper's pose in the new cloud's frame N.

    A feature a of the new cloud is drawn with probability proportional to
    |r_1a| sum_j w_j N_2(r_a | r_j), and a task feature j by its share in that sum. The frame of a,
    turned at random within its ambiguity, gives the vote v_a o (v_j^-1 o L_n).

    Parameters
    ----------
    skill : ContactSkill
        The learnt skill, for n grippers.
    gripper : int
        Index of the gripper, 0 to n - 1.
    features : SurfaceFeatures
        Features of the new cloud in N.
    size_ratio : float
        Size of the new object over that of the demonstrated one; used if `paper_scale` is set.
    parameters : TransferParameters
        Bandwidths and the number of votes.
    rng : numpy.random.Generator
        Random generator; it draws features and turns.

    Raises
    ------
    JobError
        If every vote has the weight zero.
    """
    task = skill.task.density
    likelihood = np.exp(task.log_descriptor_density(features.r))
    weight = features.saliency * likelihood
    if not weight.sum() > 1e-12 * len(features):
        raise JobError(
            "the votes are zero: no salient feature of the new cloud has the curvature of a task "
            "feature; use method `kopicki`, which has no votes, or another skill"
        )
    voters = features.take(systematic_resample(weight / weight.sum(), parameters.paper_votes, rng))
    j = task.sample_kernels(voters.r, rng)
    X_jG = invert(skill.task.features.pose.take(j)) @ skill.X_NG.take(gripper)
    if parameters.paper_scale:
        X_jG = Pose(size_ratio * X_jG.p, X_jG.q)
    return PoseDensity(
        voters.spun(rng) @ X_jG,
        sigma_p=parameters.vote_sigma,
        sigma_q=parameters.vote_sigma_rotation,
        axial=skill.parameters.axial,
    )
