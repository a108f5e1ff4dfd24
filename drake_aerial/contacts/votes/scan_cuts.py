"""Directions in which a scan ends although the object continues.

Seen from above, an object ends where some surface looks outward: a side face or a rounding. A part
is missing where the visible surface merely stops, in a scan that shows sides elsewhere and on a
side that the sensor could see. The hull's support is then a lower bound of the object's size.
Where the view's boundary is known, as for an object of a scene, nothing has to be guessed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.cloud.boundary import Boundary
from drake_aerial.contacts.votes.known_outline import KnownOutline
from drake_aerial.features.horizontal_direction import horizontal_direction, outward_direction
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array

_DIRECTIONS = 72
# Depth of the band of features along the outline, in radii of the features' neighbourhood.
_BAND = 0.7
# Cosine above which a surface or a rim faces a direction.
_MIN_COSINE = 0.5
# Share of the band's features that face outward, from which on a side counts as shown.
_MIN_FACES = 0.05
# Share of the band's features that are rims, from which on a side may be cut.
_MIN_RIMS = 0.1
# Share of directions whose sides must be shown; a top view shows none and has no cuts.
_MIN_SIDES_SHOWN = 0.25


@dataclass(frozen=True, eq=False)
class ScanCuts:
    """Horizontal directions in which a scan ends although the object continues.

    Attributes
    ----------
    flags : (72,) bool array
        Whether the scan is cut in each of 72 equally spaced directions, the first along x.
    outline : KnownOutline or None
        The outline, if the boundary of the view is known; it then has the same flags.
    """

    flags: np.ndarray
    outline: KnownOutline | None = None

    @classmethod
    def none(cls) -> ScanCuts:
        """Return no cuts, for a complete scan."""
        return cls(np.zeros(_DIRECTIONS, bool))

    @classmethod
    def find(
        cls, features: SurfaceFeatures, hull: HorizontalHull, viewpoint: Array | None
    ) -> ScanCuts:
        """Find the cuts of a scan.

        Parameters
        ----------
        features : SurfaceFeatures
            Features of the scan, in a frame whose z is up.
        hull : HorizontalHull
            Their hull.
        viewpoint : (3,) array or None
            Position of the sensor in that frame [m]. Sides that it could not see are not cuts.
            None if the scan was taken from all around.
        """
        angle = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
        t = np.column_stack([np.cos(angle), np.sin(angle)])
        limit = np.max(hull.vertices @ t.T, axis=0)
        band = features.p[:, :2] @ t.T > limit - _BAND * features.rho
        count = np.maximum(band.sum(axis=0), 1)
        faces = (features.normal[:, :2] @ t.T > _MIN_COSINE) & ~features.rim[:, None]
        rims = (outward_direction(features)[:, :2] @ t.T > _MIN_COSINE) & features.rim[:, None]
        faces_share, rims_share = ((band & part).sum(axis=0) / count for part in (faces, rims))
        visible = np.ones(_DIRECTIONS, bool)
        if viewpoint is not None:
            centre = band.T.astype(float) @ features.p[:, :2] / count[:, None]
            visible = np.sum((viewpoint[:2] - centre) * t, axis=1) > 0.0
        sides_shown = np.mean(faces_share >= _MIN_FACES) >= _MIN_SIDES_SHOWN
        # Beams that run into a cut show their sides there as well, hence the comparison.
        cut = (rims_share >= _MIN_RIMS) & (rims_share > faces_share)
        return cls(cut & visible & sides_shown)

    @classmethod
    def known(cls, features: SurfaceFeatures, hull: HorizontalHull, boundary: Boundary) -> ScanCuts:
        """Return the cuts of an object whose boundary in the view is known.

        Parameters
        ----------
        features : SurfaceFeatures
            Features of the object, in a frame whose z is up.
        hull : HorizontalHull
            Their hull.
        boundary : Boundary
            The object's boundary, in that frame.
        """
        outline = KnownOutline.find(features, hull, boundary, _DIRECTIONS)
        return cls(outline.open, outline)

    def completed(self, hull: HorizontalHull) -> HorizontalHull:
        """Return the hull with hidden corners completed, if the boundary of the view is known."""
        return hull if self.outline is None else self.outline.hull

    def voting(self, features: SurfaceFeatures) -> np.ndarray:
        """Return which features may vote, (N,): all but rims at cut or hidden sides."""
        made = features.rim & self.towards(horizontal_direction(features)[0])
        return ~made if self.outline is None else ~(made | self.outline.hidden)

    def __bool__(self) -> bool:
        return bool(self.flags.any())

    def axis(self) -> np.ndarray:
        """Return the mean horizontal axis (2,) of the cuts, a unit vector of either sign."""
        angle = 2.0 * np.pi * np.flatnonzero(self.flags) / _DIRECTIONS
        doubled = 0.5 * np.angle(np.sum(np.exp(2.0j * angle)))
        return np.array([np.cos(doubled), np.sin(doubled)])

    def towards(self, t: ArrayLike) -> np.ndarray:
        """Return whether the scan is cut in the unit directions t (..., 2), shape (...)."""
        t = np.asarray(t, float)
        angle = np.arctan2(t[..., 1], t[..., 0])
        return self.flags[np.round(angle * _DIRECTIONS / (2.0 * np.pi)).astype(int) % _DIRECTIONS]
