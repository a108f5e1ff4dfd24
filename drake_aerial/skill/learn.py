"""Learn a contact skill from one demonstration (the paper's section "Learning contacts")."""

from __future__ import annotations

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.features.canonical_frame import to_canonical
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.surface_features import compute_features
from drake_aerial.geometry import invert
from drake_aerial.parallel import one_blas_thread
from drake_aerial.skill.configuration_model import ConfigurationModel
from drake_aerial.skill.contact_model import ContactModel
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.object_model import ObjectModel
from drake_aerial.skill.parameters import LearningParameters
from drake_aerial.skill.task_model import TaskModel


@one_blas_thread
def learn(
    demonstration: Demonstration, *, parameters: LearningParameters | None = None, seed: int = 0
) -> ContactSkill:
    """Learn object, contact, task and configuration models from a demonstration with n >= 1 grippers.

    Everything is learnt in the cloud's canonical frame N, so that the skill does not depend on where the
    demonstration stood or which way it faced.

    Parameters
    ----------
    demonstration : Demonstration
        A cloud [m], and where the grippers and quadrotors were, in the cloud's frame.
    parameters : LearningParameters, optional
        Bandwidths, radii and sample counts.
    seed : int
        Seed of the features' random draws; the same seed gives the same skill, byte for byte.

    Returns
    -------
    ContactSkill

    Raises
    ------
    InputError
        If a gripper touches nothing, or the cloud has no surface features.

    Examples
    --------
    >>> from drake_aerial import Demonstration, learn
    >>> skill = learn(Demonstration.read("edge"))
    >>> skill.label, len(skill)
    ('edge', 1)
    """
    parameters = parameters or LearningParameters()
    demonstration.cloud.require_up()
    cloud_N, X_SN = to_canonical(demonstration.cloud)
    features = compute_features(cloud_N, parameters.features)
    X_NS = invert(X_SN)
    X_NG, X_NQ = X_NS @ demonstration.grippers, X_NS @ demonstration.quadrotors
    _check_contacts(cloud_N.points, X_NG.p, parameters.contact_radius)

    # One stream per model: a change of one count leaves the other models as they are.
    streams = np.random.default_rng(seed).spawn(2 * len(X_NG.p) + 1)
    radius, bandwidth = parameters.contact_radius, parameters.bandwidth
    objects, contacts = [], []
    for n in range(len(X_NG.p)):
        objects.append(
            ObjectModel.learn(
                features,
                X_NG.p[n],
                radius=radius,
                count=parameters.object_features,
                bandwidth=bandwidth,
                rng=streams[2 * n],
            )
        )
        contacts.append(
            ContactModel.learn(
                objects[n],
                X_NG.take(n),
                radius=radius,
                count=parameters.contact_kernels,
                rng=streams[2 * n + 1],
            )
        )
    task = TaskModel.learn(
        features, count=parameters.task_features, bandwidth=bandwidth, rng=streams[-1]
    )
    configuration = ConfigurationModel.learn(
        X_NG,
        X_NQ,
        demonstration.cable_length,
        sigma_p=parameters.configuration_sigma,
        sigma_q=bandwidth.rotation,
        alpha=parameters.alpha,
        axial=parameters.axial,
    )
    return ContactSkill(
        label=demonstration.label,
        description=demonstration.description,
        parameters=parameters,
        X_SN=X_SN,
        points=features.p,
        X_NG=X_NG,
        X_NQ=X_NQ,
        hull=HorizontalHull.of_points(features.p),
        objects=tuple(objects),
        contacts=tuple(contacts),
        task=task,
        configuration=configuration,
    )


# A gripper's origin sits on the surface; scans are sampled some millimetres apart.
TOUCH = 0.02


def _check_contacts(points: np.ndarray, p_NG: np.ndarray, radius: float) -> None:
    for n, p in enumerate(p_NG):
        distance = float(np.linalg.norm(points - p, axis=1).min())
        if distance > min(TOUCH, radius):
            raise InputError(
                f"gripper {n + 1} of the demonstration touches nothing: its nearest point of the cloud is "
                f"{distance:.3f} m away, at most {min(TOUCH, radius):.3f} m is accepted"
            )
