"""Horizontal outward directions and saliency of features in a frame with z up."""

from __future__ import annotations

import numpy as np

from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array

# Horizontal length of an outward direction from which on it has full weight (docs/method.md).
FULL_HORIZONTAL = 0.3


def outward_direction(features: SurfaceFeatures) -> Array:
    """Return outward directions (N, 3): across the rim at rim features, else the normal."""
    return np.where(features.rim[:, None], features.k1, features.normal)


def horizontal_direction(features: SurfaceFeatures) -> tuple[Array, Array]:
    """Return unit horizontal outward directions (N, 2), and the horizontal lengths (N,).

    Where the length is zero, the direction is arbitrary.
    """
    t = outward_direction(features)[:, :2]
    length = np.linalg.norm(t, axis=1)
    unit = t / np.maximum(length, 1e-12)[:, None]
    return np.where(length[:, None] > 1e-12, unit, [1.0, 0.0]), length


def gravity_saliency(features: SurfaceFeatures) -> Array:
    """Return saliency times min(horizontal length / 0.3, 1), shape (N,)."""
    return features.saliency * np.minimum(horizontal_direction(features)[1] / FULL_HORIZONTAL, 1.0)
