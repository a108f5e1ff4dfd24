"""The object model O_n(v, r): the surface near the demonstrated gripper n."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drake_aerial.density.surface_density import Bandwidth, SurfaceDensity
from drake_aerial.errors import InputError
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array


@dataclass(frozen=True, eq=False)
class ObjectModel:
    """KDE over the features in contact with one gripper (the paper's object model; w_i = 1 / N_O).

    Attributes
    ----------
    features : SurfaceFeatures
        N_O features in the demonstration's canonical frame N, turned at random within their
        ambiguity. A feature may occur more than once, with other turns.
    bandwidth : Bandwidth
        Kernel bandwidths.
    """

    features: SurfaceFeatures
    bandwidth: Bandwidth

    @property
    def density(self) -> SurfaceDensity:
        """The density O_n over poses in N and descriptors."""
        return SurfaceDensity(self.features.pose, self.features.r, bandwidth=self.bandwidth)

    @classmethod
    def learn(
        cls,
        features: SurfaceFeatures,
        p_NG: Array,
        *,
        radius: float,
        count: int,
        bandwidth: Bandwidth,
        rng: np.random.Generator,
    ) -> ObjectModel:
        """Draw features uniformly from those near one gripper.

        Parameters
        ----------
        features : SurfaceFeatures
            Features of the demonstration's cloud, in N.
        p_NG : (3,) array
            Position of the gripper [m].
        radius : float
            Largest distance of a feature from the gripper [m].
        count : int
            Number of features drawn, with repeats if there are fewer.
        bandwidth : Bandwidth
            Kernel bandwidths.
        rng : numpy.random.Generator
            Random generator; it draws features and turns.

        Raises
        ------
        InputError
            If no feature is that near.
        """
        distance = np.linalg.norm(features.p - p_NG, axis=1)
        near = np.flatnonzero(distance <= radius)
        if len(near) == 0:
            raise InputError(
                "a gripper touches nothing: its nearest surface feature must be within "
                f"{radius:.3f} m, got {distance.min():.3f} m; move the gripper onto the cloud"
            )
        return cls(with_random_turns(features.take(draw_evenly(near, count, rng)), rng), bandwidth)


def draw_evenly(index: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Draw `count` indices, sorted; the numbers of draws of any two differ by at most one."""
    repeats, rest = divmod(count, len(index))
    return np.sort(np.concatenate([np.tile(index, repeats), rng.permutation(index)[:rest]]))


def with_random_turns(features: SurfaceFeatures, rng: np.random.Generator) -> SurfaceFeatures:
    """Return the features with their frames rotated at random within their ambiguity."""
    pose = features.spun(rng)
    return replace(features, p=pose.p, q=pose.q)
