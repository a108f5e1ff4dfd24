"""The task model T(v, r): salient features of the whole visible object, to locate the contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_aerial.density.mixture import systematic_resample
from drake_aerial.density.surface_density import Bandwidth, SurfaceDensity
from drake_aerial.features.horizontal_direction import gravity_saliency
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array
from drake_aerial.skill.object_model import with_random_turns


@dataclass(frozen=True, eq=False)
class TaskModel:
    """The task features of one demonstration, in its canonical frame N.

    Attributes
    ----------
    features : SurfaceFeatures
        The paper's task features: N_T features drawn uniformly over the visible surface, turned
        at random within their ambiguity.
    weights : (N_T,) array
        Their weights w_j, proportional to saliency; they sum to one.
    salient : SurfaceFeatures
        N_T features drawn by gravity saliency; they vote in hull coordinates.
    bandwidth : Bandwidth
        Kernel bandwidths.
    """

    features: SurfaceFeatures
    weights: Array
    salient: SurfaceFeatures
    bandwidth: Bandwidth

    @property
    def density(self) -> SurfaceDensity:
        """The density T over poses in N and descriptors."""
        return SurfaceDensity(
            self.features.pose, self.features.r, self.weights, bandwidth=self.bandwidth
        )

    @classmethod
    def learn(
        cls,
        features: SurfaceFeatures,
        *,
        count: int,
        bandwidth: Bandwidth,
        rng: np.random.Generator,
    ) -> TaskModel:
        """Draw `count` features uniformly, and `count` by their gravity saliency."""
        uniform = features.take(
            np.sort(rng.choice(len(features), min(count, len(features)), replace=False))
        )
        # The paper's w_j = r_1j / r is 0 / 0 on a flat cloud; a floor keeps the weights defined.
        weights = uniform.saliency + 1e-3
        salient = features.take(systematic_resample(gravity_saliency(features), count, rng))
        return cls(with_random_turns(uniform, rng), weights / weights.sum(), salient, bandwidth)
