"""Saliency of a scan around a contact, compared with the rest of the scan."""

import numpy as np

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.features.canonical_frame import to_canonical
from drake_aerial.features.surface_features import FeatureParameters, compute_features
from drake_aerial.geometry import Array, transform

SURROUNDINGS = 0.05
"""Radius of a contact's surroundings [m]: that of a contact model's features (docs/method.md)."""


class SalientSurface:
    """Mean saliency around each feature of a scan.

    Parameters
    ----------
    cloud : PointCloud
        The scan, in its frame S.
    parameters : FeatureParameters, optional
        Parameters of the surface features; those of the skill.

    Attributes
    ----------
    points : (N, 3) array
        Positions of the features in S [m].
    saliency : (N,) array
        |kappa_1 rho| of each feature; that of an edge at a rim.
    surroundings : (N,) array
        Mean saliency within `SURROUNDINGS` of each.
    """

    def __init__(self, cloud: PointCloud, parameters: FeatureParameters | None = None):
        from scipy.spatial import cKDTree

        cloud_N, X_SN = to_canonical(cloud)
        features = compute_features(cloud_N, parameters)
        self.points: Array = transform(X_SN, features.p)
        self.saliency: Array = features.saliency
        self._tree = cKDTree(self.points)
        self.surroundings = self._mean(self.points)

    def percentile(self, positions: Array) -> Array:
        """Return the fraction (n,) of the scan that is less salient than around positions (n, 3).

        Positions are in S [m]; ties count one half.
        """
        value = self._mean(np.asarray(positions, float))[:, None]
        ties = np.isclose(self.surroundings, value, rtol=1e-9, atol=1e-12)
        return np.mean(np.where(ties, 0.5, self.surroundings < value), axis=1)

    def _mean(self, positions: Array) -> Array:
        """Return the mean saliency around positions, or that of the nearest feature."""
        near = self._tree.query_ball_point(positions, SURROUNDINGS)
        nearest = self._tree.query(positions)[1]
        return np.array(
            [
                self.saliency[rows].mean() if rows else self.saliency[k]
                for rows, k in zip(near, nearest)
            ]
        )
