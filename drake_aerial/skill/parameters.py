"""Parameters of learning; docs/method.md explains the defaults."""

from dataclasses import field
from typing import ClassVar

from drake_aerial.density.surface_density import Bandwidth
from drake_aerial.features.surface_features import FeatureParameters
from drake_aerial.io.records import Count, Flag, Positive, record


@record(frozen=True)
class LearningParameters:
    """Parameters of `learn`; a skill stores them.

    Examples
    --------
    >>> from drake_aerial import Demonstration, LearningParameters, learn
    >>> skill = learn(Demonstration.read("flat"), parameters=LearningParameters(task_features=20))
    >>> len(skill.task.salient)
    20
    """

    RETIRED: ClassVar = ("alpha",)

    features: FeatureParameters = field(default_factory=FeatureParameters)
    """Surface features of the demonstration and of new clouds."""
    bandwidth: Bandwidth = field(default_factory=Bandwidth)
    """Kernel bandwidths of the object, task and contact models."""
    contact_radius: Positive = 0.05
    """Distance from a gripper within which features belong to its contact, delta in the paper
    [m]."""
    object_features: Count = 500
    """Features of an object model, N_O in the paper."""
    contact_kernels: Count = 500
    """Kernels of a contact model, N_C in the paper."""
    task_features: Count = 50
    """Features of the task model, N_T in the paper."""
    configuration_sigma: Positive = 0.03
    """Bandwidth of gripper positions in the formation frame [m]."""
    axial: Flag = True
    """True if grippers are symmetric about their z axis, so that only this axis is compared."""
