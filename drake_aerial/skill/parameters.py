"""Parameters of learning (docs/method.md)."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

import numpy as np

from drake_aerial.density.surface_density import Bandwidth
from drake_aerial.errors import InputError
from drake_aerial.features.surface_features import FeatureParameters


@dataclass(frozen=True)
class LearningParameters:
    """Parameters of `learn`; a skill stores them.

    Attributes
    ----------
    features : FeatureParameters
        Surface features; the new cloud's are computed with the same.
    bandwidth : Bandwidth
        Kernel bandwidths of object, task and contact model.
    contact_radius : float
        Features within this distance of a gripper belong to its contact (the paper's delta) [m].
    object_features, contact_kernels, task_features : int
        The paper's N_O, N_C and N_T.
    configuration_sigma : float
        Bandwidth of gripper positions in the formation frame [m].
    axial : bool
        Whether grippers are symmetric about their z axis, so that only it is compared.
    """

    features: FeatureParameters = field(default_factory=FeatureParameters)
    bandwidth: Bandwidth = field(default_factory=Bandwidth)
    contact_radius: float = 0.05
    object_features: int = 500
    contact_kernels: int = 500
    task_features: int = 50
    configuration_sigma: float = 0.03
    axial: bool = True

    def __post_init__(self) -> None:
        for name in ("contact_radius", "configuration_sigma"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise InputError(f"{name} should be a positive length in metres, got {value}")
        for name in ("object_features", "contact_kernels", "task_features"):
            if not getattr(self, name) >= 1:
                raise InputError(f"{name} should be at least 1, got {getattr(self, name)}")

    def to_dict(self) -> dict:
        """Return the parameters as nested dictionaries of plain values."""
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, values: dict) -> LearningParameters:
        """Return the parameters that `to_dict` gave, or those of a skill file with `alpha`."""
        values = {name: value for name, value in values.items() if name != "alpha"}
        features = FeatureParameters(**values.pop("features"))
        return cls(features=features, bandwidth=Bandwidth(**values.pop("bandwidth")), **values)
