"""The object model O_n(v, r): the surface near the demonstrated gripper n."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drake_aerial.density.surface_density import Bandwidth, SurfaceDensity
from drake_aerial.errors import InputError
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array, Pose


@dataclass(frozen=True, eq=False)
class ObjectModel:
    """KDE over the features in contact with one gripper (the paper's object model; w_i = 1 / N_O).

    Attributes
    ----------
    features : SurfaceFeatures
        The N_O features that were drawn, in the demonstration's canonical frame N, each turned within its own
        ambiguity (a feature may be drawn more than once, turned otherwise).
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
        """Draw `count` features uniformly from those within `radius` [m] of the gripper at p_NG (3,).

        Raises
        ------
        InputError
            If no feature is that near.
        """
        distance = np.linalg.norm(features.p - p_NG, axis=1)
        near = np.flatnonzero(distance <= radius)
        if len(near) == 0:
            raise InputError(
                f"a gripper touches nothing: the nearest surface feature is {distance.min():.3f} m away, "
                f"at most {radius:.3f} m is accepted"
            )
        drawn = features.take(spread(near, count, rng))
        pose = drawn.spun(rng)
        return cls(replace_pose(drawn, pose), bandwidth)


def spread(index: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Draw `count` of `index` uniformly, each as often as any other but for one."""
    repeats, rest = divmod(count, len(index))
    return np.sort(np.concatenate([np.tile(index, repeats), rng.permutation(index)[:rest]]))


def replace_pose(features: SurfaceFeatures, pose: Pose) -> SurfaceFeatures:
    """Return the features with other frames: p (N, 3) [m], q (N, 4)."""
    return replace(features, p=pose.p, q=pose.q)
