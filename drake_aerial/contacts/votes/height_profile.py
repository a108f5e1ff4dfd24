"""How high and low an object's upper side goes: what says how far apart in height grippers of one formation may stand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.geometry import Array

# Parts of the upper side at which its height is compared.
_PARTS = np.linspace(0.02, 0.98, 49)
# Least side of a column, in distances to the nearest point: some ten points of every level it goes through. In a smaller
# one a sparse scan shows the bottom by chance.
_SPACINGS = 6.5


@dataclass(frozen=True, eq=False)
class Relief:
    """Heights of an object's upper side, seen from above, whatever lies where.

    Attributes
    ----------
    height : (49,) array
        Heights below which equal steps of the visible area lie, less their mean [m].
    """

    height: Array

    @classmethod
    def of_points(cls, points: ArrayLike, cell: float) -> Relief:
        """Return the relief of a surface's points (N, 3) in a frame whose z is up, the topmost of every `cell` [m], or of
        larger ones where the scan is sparse.
        """
        from scipy.spatial import cKDTree

        points = np.asarray(points, float)
        apart, _ = cKDTree(points).query(points, k=2)
        cell = max(cell, _SPACINGS * float(np.median(apart[:, 1])))
        column = np.floor((points[:, :2] - points[:, :2].min(axis=0)) / cell).astype(int)
        flat = column[:, 0] * (column[:, 1].max() + 1) + column[:, 1]
        _, index = np.unique(flat, return_inverse=True)
        top = np.full(index.max() + 1, -np.inf)
        np.maximum.at(top, index, points[:, 2])
        height = np.quantile(top, _PARTS)
        return cls(height - height.mean())

    def stretch_and_spread(self, taught: Relief, scale: float, sigma: float) -> tuple[float, float]:
        """Return the factor from a taught object's heights to these, and the RMS of what it leaves unexplained [m].

        Parameters
        ----------
        taught : Relief
            Of the object with the demonstration.
        scale : float
            The factor where the taught object is flat: the horizontal one.
        sigma : float
            Relief up to which an object counts as flat [m].
        """
        flat = sigma**2
        stretch = (np.mean(self.height * taught.height) + flat * scale) / (
            np.mean(taught.height**2) + flat
        )
        left = self.height - stretch * taught.height
        return float(stretch), float(np.sqrt(np.mean(left**2)))
