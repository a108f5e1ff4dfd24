"""Parameters of finding objects in a scene."""

from __future__ import annotations

from drake_aerial.io.records import Count, Positive, record


@record(frozen=True)
class SceneParameters:
    """Parameters of finding objects in a scene."""

    window_radius: Count = 5
    """Local planes are fitted in windows of 2 radius + 1 pixels."""
    concave_angle: Positive = 12.0
    """Angle [deg] between two surfaces that lean towards each other, from which they are parted."""
    min_pixels: Count = 150
    """Objects of fewer pixels are dropped."""
    min_height: Positive = 0.015
    """Least height [m] of an object above the support."""
    widest_shadow: Count = 24
    """Widest gap [pixels] without depth across which surfaces are neighbours."""
