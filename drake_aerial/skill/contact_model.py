"""The contact model M_n(u, r): gripper n relative to the surface features at its contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_aerial.density.surface_density import Bandwidth, SurfaceDensity
from drake_aerial.geometry import Array, Pose, invert
from drake_aerial.skill.object_model import ObjectModel


@dataclass(frozen=True, eq=False)
class ContactModel:
    """KDE over u_ni = v_i^-1 o L_n and the descriptor r_i (the paper's section "Contact models").

    Attributes
    ----------
    X_vG : Pose
        Poses u_ni of the gripper in the frames v_i of N_C features, batch (N_C,).
    descriptor : (N_C, 2) array
        The features' descriptors (dimensionless).
    weights : (N_C,) array
        Kernel weights, decaying with the feature's distance from the gripper; they sum to one.
    bandwidth : Bandwidth
        Kernel bandwidths.
    """

    X_vG: Pose
    descriptor: Array
    weights: Array
    bandwidth: Bandwidth

    @property
    def density(self) -> SurfaceDensity:
        """The density M_n over the gripper's pose in a feature's frame and the descriptor."""
        return SurfaceDensity(self.X_vG, self.descriptor, self.weights, bandwidth=self.bandwidth)

    @classmethod
    def learn(
        cls,
        model: ObjectModel,
        X_NG: Pose,
        *,
        radius: float,
        count: int,
        rng: np.random.Generator,
    ) -> ContactModel:
        """Learn from the features of an object model around one gripper.

        Parameters
        ----------
        model : ObjectModel
            Features near the gripper.
        X_NG : Pose
            The gripper, one pose.
        radius : float
            Distance from the gripper at which a feature's weight is 1 % [m]; weights decay as
            exp(-lambda d^2) with the distance d.
        count : int
            Largest number of features.
        rng : numpy.random.Generator
            Random generator; it draws the features if there are more.
        """
        features = model.features
        if count < len(features):
            features = features.take(np.sort(rng.permutation(len(features))[:count]))
        X_vG = invert(features.pose) @ X_NG
        weights = 0.01 ** ((np.linalg.norm(X_vG.p, axis=1) / radius) ** 2)
        return cls(X_vG, features.r, weights / weights.sum(), model.bandwidth)
