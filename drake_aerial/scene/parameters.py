"""Parameters of finding objects in a scene."""

from __future__ import annotations

from drake_aerial.io.records import Count, Positive, record


@record(frozen=True)
class SceneParameters:
    """Parameters of finding objects in a scene."""

    min_pixels: Count = 150
    """Objects of fewer pixels are dropped."""
    min_height: Positive = 0.015
    """Least height [m] of an object's highest points above the support."""
    concave_angle: Positive = 12.0
    """Angle [deg] between the normals of two patches from which a concave edge separates them."""
