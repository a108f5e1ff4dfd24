"""The task model T(v, r): the salient features of the whole visible object, which say where on it a contact
was.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_aerial.density.surface_density import Bandwidth, SurfaceDensity
from drake_aerial.geometry import Array
from drake_aerial.learning.object_model import replace_pose
from drake_aerial.perception.surface_features import SurfaceFeatures

# Horizontal part of a feature's outward direction from which on it counts in full (docs/method.md).
FULL_HORIZONTAL = 0.3


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
        return SurfaceDensity(self.features.pose, self.features.r, self.weights, bandwidth=self.bandwidth)

    @classmethod
    def learn(
        cls, features: SurfaceFeatures, *, count: int, bandwidth: Bandwidth, rng: np.random.Generator
    ) -> TaskModel:
        """Draw `count` features uniformly, weighted by saliency, and `count` by their gravity saliency."""
        uniform = features.take(np.sort(rng.choice(len(features), min(count, len(features)), replace=False)))
        # The paper's w_j = r_1j / r is 0 / 0 on a flat cloud; a small floor keeps the weights defined.
        weights = uniform.saliency + 1e-3
        salient = features.take(draw_by(gravity_saliency(features), count, rng))
        uniform = replace_pose(uniform, uniform.spun(rng))
        return cls(uniform, weights / weights.sum(), salient, bandwidth)


def outward_direction(features: SurfaceFeatures) -> Array:
    """Return each feature's outward direction (N, 3): across its rim where it is one, else its normal."""
    return np.where(features.rim[:, None], features.k1, features.normal)


def horizontal_direction(features: SurfaceFeatures) -> tuple[Array, Array]:
    """Return the unit horizontal outward directions t (N, 2) and the length of that horizontal part (N,).

    The features are in a frame whose z is up. Where the part vanishes, t is arbitrary and saliency is zero.
    """
    t = outward_direction(features)[:, :2]
    length = np.linalg.norm(t, axis=1)
    unit = t / np.maximum(length, 1e-12)[:, None]
    return np.where(length[:, None] > 1e-12, unit, [1.0, 0.0]), length


def gravity_saliency(features: SurfaceFeatures) -> Array:
    """Return saliency times min(horizontal part / 0.3, 1), shape (N,): what says where, seen from above."""
    return features.saliency * np.minimum(horizontal_direction(features)[1] / FULL_HORIZONTAL, 1.0)


def draw_by(weight: Array, count: int, rng: np.random.Generator) -> np.ndarray:
    """Draw `count` indices, sorted and with repeats, with probability proportional to `weight` (N,).

    Systematic draws spread evenly along the features' canonical order, so that no side is left out by chance.
    """
    total = np.cumsum(weight + 1e-12)
    at = (np.arange(count) + rng.random(count)) / count * total[-1]
    return np.minimum(np.searchsorted(total, at), len(weight) - 1)
