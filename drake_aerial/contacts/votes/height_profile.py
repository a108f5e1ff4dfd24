"""The height profile of an object's top surface, which bounds height differences in a formation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.geometry import Array

# Fractions of the visible area at which heights are compared.
_QUANTILES = np.linspace(0.02, 0.98, 49)
# Smallest side of a column, in distances between neighbouring points. In a narrower column of a
# sparse scan the bottom may be the only surface that was sampled.
_COLUMN_SPACINGS = 6.5


@dataclass(frozen=True, eq=False)
class HeightProfile:
    """Quantiles of the height of an object's top surface, seen from above.

    Attributes
    ----------
    height : (49,) array
        Heights at equally spaced quantiles of the visible area, less their mean [m].
    """

    height: Array

    @classmethod
    def of_points(cls, points: ArrayLike, cell: float) -> HeightProfile:
        """Return the profile of the topmost points of vertical columns.

        Parameters
        ----------
        points : (N, 3) array
            Points of the surface in a frame whose z is up [m].
        cell : float
            Side of the columns [m]; larger columns are used where the scan is sparse.
        """
        from scipy.spatial import cKDTree

        points = np.asarray(points, float)
        spacing, _ = cKDTree(points).query(points, k=2)
        cell = max(cell, _COLUMN_SPACINGS * float(np.median(spacing[:, 1])))
        column = np.floor((points[:, :2] - points[:, :2].min(axis=0)) / cell).astype(int)
        flat = column[:, 0] * (column[:, 1].max() + 1) + column[:, 1]
        _, index = np.unique(flat, return_inverse=True)
        top = np.full(index.max() + 1, -np.inf)
        np.maximum.at(top, index, points[:, 2])
        height = np.quantile(top, _QUANTILES)
        return cls(height - height.mean())

    def stretch_from(
        self, demonstrated: HeightProfile, scale: float, sigma: float
    ) -> tuple[float, float]:
        """Fit the factor that maps a demonstrated object's heights to these heights.

        Parameters
        ----------
        demonstrated : HeightProfile
            Profile of the object with the demonstration.
        scale : float
            Factor for a flat demonstrated object: the horizontal one.
        sigma : float
            RMS height up to which the demonstrated object counts as flat [m].

        Returns
        -------
        stretch : float
            The factor.
        residual : float
            RMS of the heights that the factor leaves unexplained [m].
        """
        flat = sigma**2
        stretch = (np.mean(self.height * demonstrated.height) + flat * scale) / (
            np.mean(demonstrated.height**2) + flat
        )
        residual = self.height - stretch * demonstrated.height
        return float(stretch), float(np.sqrt(np.mean(residual**2)))
