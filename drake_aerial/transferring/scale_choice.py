"""Which scale mode the votes use, chosen from evidence in the scan."""

from __future__ import annotations

from drake_aerial.learning.hull import HorizontalHull
from drake_aerial.learning.skill import ContactSkill
from drake_aerial.perception.surface_features import SurfaceFeatures
from drake_aerial.transferring.parameters import TransferParameters


def choose_scale(
    skill: ContactSkill, features: SurfaceFeatures, hull: HorizontalHull, parameters: TransferParameters
) -> str:
    """Return `support`, `area` or `rigid`."""
    return "support"
