"""The part of a surface that is visible from above, which every scan shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.upright_box import UprightBox
from drake_aerial.geometry import Array

# Side of the vertical columns, in spacings of the points, and their largest number along an axis.
_SPACINGS, _MOST = 2.5, 120
# Quantiles of the height between which the relief lies; a few points of side faces remain.
_RELIEF = (0.03, 0.998)
# A relief below this share of the size is flat.
FLAT = 0.03


@dataclass(frozen=True, eq=False)
class TopSurface:
    """The upper points of an object, and its measures.

    A view from above shows neither the height of an object nor its sides. Two scans are therefore
    compared by what both show.

    Attributes
    ----------
    points : (N, 3) array
        Points near the top of each vertical column, z up [m].
    box : UprightBox
        Upright box of the whole object.
    top, relief : float
        Largest height of these points, and the range of their heights [m].
    """

    points: Array
    box: UprightBox
    top: float
    relief: float

    @classmethod
    def of_points(cls, points: Array, hull: HorizontalHull) -> TopSurface:
        """Return the top surface of points (N, 3) with the given hull."""
        box = UprightBox.of_points(points, hull)
        spacing = float(np.sqrt(hull.area / len(points)))
        cell = max(_SPACINGS * spacing, box.size / _MOST)
        column = np.floor((points[:, :2] - points[:, :2].min(axis=0)) / cell).astype(int)
        flat = column[:, 0] * (column[:, 1].max() + 1) + column[:, 1]
        _, index = np.unique(flat, return_inverse=True)
        highest = np.full(index.max() + 1, -np.inf)
        np.maximum.at(highest, index, points[:, 2])
        upper = points[points[:, 2] > highest[index] - cell]
        low, top = np.quantile(upper[:, 2], _RELIEF)
        return cls(upper, box, float(top), float(top - low))

    def depth(self, place: Array) -> float:
        """Return how far a place (3,) lies below the top, as a share of the size."""
        return float((self.top - place[2]) / self.box.size)

    def share_above(self, place: Array) -> float:
        """Return the share of the top surface that is clearly higher than a place (3,)."""
        return float(np.mean(self.points[:, 2] > place[2] + FLAT * self.box.size))

    def is_flat(self) -> bool:
        """Whether the top surface is flat, with negligible height differences."""
        return self.relief < FLAT * self.box.size
