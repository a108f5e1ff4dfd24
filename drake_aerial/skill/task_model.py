"""The task model T(v, r): the salient features of the whole visible object, which say where on it a contact
was.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_aerial.density.resampling import systematic_resample
from drake_aerial.density.surface_density import Bandwidth, SurfaceDensity
from drake_aerial.features.horizontal_direction import gravity_saliency
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array
from drake_aerial.skill.object_model import replace_pose


@dataclass(frozen=True, eq=False)
class TaskModel:
    """The task features of one demonstration, in its canonical frame N.

    Attributes
    ----------
    features : SurfaceFeatures
        N_T features sampled uniformly over the visible surface, turned within their own ambiguity: the
        paper's.
    weights : (N_T,) array
        Their weights w_j, proportional to saliency; they sum to one.
    salient : SurfaceFeatures
        N_T features sampled by the saliency that gravity frames use: those that vote in hull coordinates.
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
        """Draw `count` features uniformly, weighted by saliency, and `count` by their gravity saliency."""
        uniform = features.take(
            np.sort(rng.choice(len(features), min(count, len(features)), replace=False))
        )
        # The paper's w_j = r_1j / r is 0 / 0 on a flat cloud; a small floor keeps the weights defined.
        weights = uniform.saliency + 1e-3
        salient = features.take(systematic_resample(gravity_saliency(features), count, rng))
        uniform = replace_pose(uniform, uniform.spun(rng))
        return cls(uniform, weights / weights.sum(), salient, bandwidth)
