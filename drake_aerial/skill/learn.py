"""Learn a contact skill from one demonstration (the paper's section "Learning contacts")."""

from collections.abc import Sequence

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.features.canonical_frame import to_canonical
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.surface_features import SurfaceFeatures, compute_features
from drake_aerial.geometry import Array, Pose, invert
from drake_aerial.parallel import one_blas_thread
from drake_aerial.skill.configuration_model import ConfigurationModel
from drake_aerial.skill.contact_model import ContactModel
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.object_model import ObjectModel
from drake_aerial.skill.parameters import LearningParameters
from drake_aerial.skill.task_model import TaskModel

TOUCH = 0.02
"""Largest distance of a demonstrated gripper from the cloud [m].

A gripper's origin is on the surface, and scans have some millimetres between their points.
"""


@one_blas_thread
def learn(
    demonstration: Demonstration, *, parameters: LearningParameters | None = None, seed: int = 0
) -> ContactSkill:
    """Learn object, contact, task and configuration models from one demonstration.

    The models are learnt in the cloud's canonical frame N. The skill therefore does not depend on
    position or heading of the demonstration.

    Parameters
    ----------
    demonstration : Demonstration
        A cloud [m] and the poses of n >= 1 grippers and quadrotors, in the cloud's frame S.
    parameters : LearningParameters, optional
        Bandwidths, radii and sample counts.
    seed : int
        Random seed. The same inputs and seed give the same skill, byte for byte.

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
    *local_rngs, task_rng = np.random.default_rng(seed).spawn(2 * len(X_NG.p) + 1)
    objects, contacts = _learn_local_models(features, X_NG, parameters, local_rngs)
    return ContactSkill(
        label=demonstration.label,
        description=demonstration.description,
        parameters=parameters,
        X_SN=X_SN,
        points=features.p,
        X_NG=X_NG,
        X_NQ=X_NQ,
        hull=HorizontalHull.of_points(features.p),
        objects=objects,
        contacts=contacts,
        task=TaskModel.learn(
            features,
            count=parameters.task_features,
            bandwidth=parameters.bandwidth,
            rng=task_rng,
        ),
        configuration=ConfigurationModel.learn(
            X_NG,
            X_NQ,
            demonstration.cable_length,
            sigma_p=parameters.configuration_sigma,
            sigma_q=parameters.bandwidth.rotation,
            axial=parameters.axial,
        ),
    )


def _learn_local_models(
    features: SurfaceFeatures,
    X_NG: Pose,
    parameters: LearningParameters,
    rngs: Sequence[np.random.Generator],
) -> tuple[tuple[ObjectModel, ...], tuple[ContactModel, ...]]:
    """Return object and contact models of grippers X_NG (n,), each of two random streams."""
    objects, contacts = [], []
    for n, (object_rng, contact_rng) in enumerate(zip(rngs[::2], rngs[1::2])):
        objects.append(
            ObjectModel.learn(
                features,
                X_NG.p[n],
                radius=parameters.contact_radius,
                count=parameters.object_features,
                bandwidth=parameters.bandwidth,
                rng=object_rng,
            )
        )
        contacts.append(
            ContactModel.learn(
                objects[n],
                X_NG.take(n),
                radius=parameters.contact_radius,
                count=parameters.contact_kernels,
                rng=contact_rng,
            )
        )
    return tuple(objects), tuple(contacts)


def _check_contacts(points: Array, p_NG: Array, radius: float) -> None:
    """Raise InputError if a gripper is off the cloud (both in N [m])."""
    most = min(TOUCH, radius)
    for n, p in enumerate(p_NG):
        distance = float(np.linalg.norm(points - p, axis=1).min())
        if distance > most:
            raise InputError(
                f"gripper {n + 1} of the demonstration touches nothing: its nearest point of the "
                f"cloud must be within {most:.3f} m, got {distance:.3f} m; move it onto the cloud"
            )
