"""The arm that learns nothing: contacts over the middle of what is seen (docs/method.md)."""

from __future__ import annotations

import numpy as np

from drake_aerial.contacts.feasibility.local_surface import LocalSurface
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.geometry import Pose
from drake_aerial.skill.configuration_model import ConfigurationModel


def centroid_contacts(
    configuration: ConfigurationModel, hull: HorizontalHull, surface: LocalSurface
) -> Pose:
    """Return one configuration of grippers X_NG, batch (1, n), its origin over the hull's centroid.

    One gripper is set on the topmost surface there. Several keep the demonstrated layout, at its own size
    and with the new cloud's canonical yaw; each is set on the surface above or below it.
    """
    origin = np.append(hull.centroid, 0.0)
    placed = configuration.demonstrated_at(origin, np.zeros(()))
    X, _ = surface.above(placed.p[..., :2])
    return Pose(X.p[None], X.q[None])
