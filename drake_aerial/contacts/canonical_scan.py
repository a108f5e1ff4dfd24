"""The canonical scan: frame, features, hull and surface of a new cloud, for every method."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from drake_aerial.cloud.boundary import Boundary
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.feasibility.local_surface import LocalSurface
from drake_aerial.features.canonical_frame import to_canonical
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.surface_features import (
    FeatureParameters,
    SurfaceFeatures,
    compute_features,
)
from drake_aerial.features.upright_box import UprightBox
from drake_aerial.geometry import Array, Pose


@dataclass(frozen=True, eq=False)
class CanonicalScan:
    """The scan of a new payload in its canonical frame N (z up, origin at the centroid).

    Attributes
    ----------
    X_SN : Pose
        N in the cloud's frame S.
    features : SurfaceFeatures
        Surface features of the cloud, in N.
    hull : HorizontalHull
        Convex hull of the features seen from above, in N.
    viewpoint : (3,) array or None
        Position of the sensor in N [m]; None if it is not known.
    boundary : Boundary or None
        The object's boundary in the view, in N; None if it is not known.
    """

    X_SN: Pose
    features: SurfaceFeatures
    hull: HorizontalHull
    viewpoint: Array | None
    boundary: Boundary | None = None

    @classmethod
    def of_cloud(cls, cloud: PointCloud, parameters: FeatureParameters) -> CanonicalScan:
        """Compute the canonical frame, surface features and hull of a cloud given in S.

        Raises
        ------
        InputError
            If the cloud's `up` is not known, it has no surface features, or its projection along
            gravity has no area.
        """
        cloud.require_up()
        cloud_N, X_SN = to_canonical(cloud)
        features = compute_features(cloud_N, parameters)
        hull = HorizontalHull.of_points(features.p)
        return cls(X_SN, features, hull, cloud_N.viewpoint, cloud_N.boundary)

    @property
    def features_S(self) -> SurfaceFeatures:
        """The features in the cloud's frame S."""
        return self.features.transformed(self.X_SN)

    @cached_property
    def box(self) -> UprightBox:
        """The upright box around the features in N."""
        return UprightBox.of_points(self.features.p, self.hull)

    @cached_property
    def surface(self) -> LocalSurface:
        """The visible surface in N, onto which grippers are projected."""
        return LocalSurface(self.features)
