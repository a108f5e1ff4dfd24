"""Horizontal outward directions of surface features, and the saliency that they give.

The features are in a frame whose z is up.
"""

from __future__ import annotations

import numpy as np

from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array

# From this horizontal part of a feature's outward direction on, it counts in full (docs/method.md).
FULL_HORIZONTAL = 0.3


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
