"""Where a scan ends though the object goes on: evidence against the hull, read from the scan itself.

Seen from above, an object ends at a side where some surface looks that way (a side face, a rounding). Where instead
the visible surface just stops, in a scan that elsewhere does show the sides and from where that side could have been
seen, a part is missing: the hull's support there is a lower bound, not a size.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.features.horizontal_direction import outward_direction
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array

_DIRECTIONS = 72
# Depth of the band along the outline that is looked at, as a part of the features' neighbourhood.
_BAND = 0.7
# Cosine above which a surface or a rim looks in a direction.
_TOWARDS = 0.5
# Share of the band's features below which no surface closes the object there, and above which rims end it.
_CLOSED, _ENDED = 0.05, 0.1
# Share of directions that must be closed before an open one says anything: a top view shows no side at all.
_SIDES_SHOWN = 0.25


@dataclass(frozen=True, eq=False)
class Cuts:
    """Horizontal directions in which a scan is cut off.

    Attributes
    ----------
    flags : (72,) bool array
        Whether the scan is cut in each of so many equally spaced directions, the first along x.
    """

    flags: np.ndarray

    @classmethod
    def none(cls) -> Cuts:
        """Return that the scan is complete."""
        return cls(np.zeros(_DIRECTIONS, bool))

    @classmethod
    def find(cls, features: SurfaceFeatures, hull: HorizontalHull, viewpoint: Array | None) -> Cuts:
        """Find the cuts of a scan.

        Parameters
        ----------
        features : SurfaceFeatures
            Features of the scan, in a frame whose z is up.
        hull : HorizontalHull
            Their hull.
        viewpoint : (3,) array or None
            The sensor in that frame [m]; a side that it could not see is no evidence. None: seen from all around.
        """
        angle = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
        t = np.column_stack([np.cos(angle), np.sin(angle)])
        limit = np.max(hull.vertices @ t.T, axis=0)
        band = features.p[:, :2] @ t.T > limit - _BAND * features.rho
        count = np.maximum(band.sum(axis=0), 1)
        faces = (features.normal[:, :2] @ t.T > _TOWARDS) & ~features.rim[:, None]
        ends = (outward_direction(features)[:, :2] @ t.T > _TOWARDS) & features.rim[:, None]
        closing, ending = ((band & part).sum(axis=0) / count for part in (faces, ends))
        visible = np.ones(_DIRECTIONS, bool)
        if viewpoint is not None:
            centre = band.T.astype(float) @ features.p[:, :2] / count[:, None]
            visible = np.sum((viewpoint[:2] - centre) * t, axis=1) > 0.0
        shown = np.mean(closing >= _CLOSED) >= _SIDES_SHOWN
        # Beams that run into a cut show their sides there as well.
        return cls((ending >= _ENDED) & (ending > closing) & visible & shown)

    def __bool__(self) -> bool:
        return bool(self.flags.any())

    def along(self) -> np.ndarray:
        """Return the unit horizontal direction (2,) that the cuts share most, forwards or backwards."""
        angle = 2.0 * np.pi * np.flatnonzero(self.flags) / _DIRECTIONS
        doubled = 0.5 * np.angle(np.sum(np.exp(2.0j * angle)))
        return np.array([np.cos(doubled), np.sin(doubled)])

    def towards(self, t: ArrayLike) -> np.ndarray:
        """Return whether the scan is cut in the unit directions t (..., 2), shape (...)."""
        t = np.asarray(t, float)
        angle = np.arctan2(t[..., 1], t[..., 0])
        return self.flags[np.round(angle * _DIRECTIONS / (2.0 * np.pi)).astype(int) % _DIRECTIONS]
