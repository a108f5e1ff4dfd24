"""Smooth model of the visible surface around a point, for differentiable constraints."""

from dataclasses import dataclass

import numpy as np

from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array, axis_of

# Weight exp(_SIDE n.z) of features whose normals n agree with the gripper's axis z. Relative to the
# gripper's own face, the other face of a thin plate has the weight e^-12, a side face e^-6.
_SIDE = 6.0
# Smallest number of features in a model, if fewer are within reach.
_FEWEST = 100


@dataclass(frozen=True, eq=False)
class Footing:
    """Surface below one gripper, with derivatives by the gripper's position p and axis z.

    Attributes
    ----------
    level : float
        Signed distance of the gripper from the surface, outwards positive [m].
    level_by_p, level_by_z : (3,) arrays
    normal : (3,) array
        Outward unit normal.
    normal_by_p, normal_by_z : (3, 3) arrays
    gap : float
        Smooth upper bound of the distance to the nearest feature [m].
    gap_by_p : (3,) array
    """

    level: float
    level_by_p: Array
    level_by_z: Array
    normal: Array
    normal_by_p: Array
    normal_by_z: Array
    gap: float
    gap_by_p: Array


class SmoothSurface:
    """Weighted average of the features' osculating paraboloids.

    By the paraboloid of feature i, a point p is n_i.d + (kappa_1 (k_1.d)^2 + kappa_2 (k_2.d)^2) / 2
    above the surface, with d = p - p_i, the normal n_i and the principal directions k_1 and k_2.
    The weights are Gaussians of d, times a factor for the agreement of n_i with the gripper's axis:
    the two faces of a thin plate stay apart.

    Parameters
    ----------
    features : SurfaceFeatures
        Features of the cloud, in a frame N.
    centre : (3,) array
        Centre of the region that the model represents [m].
    reach : float
        Radius of that region [m].
    spacing : float
        Distance between neighbouring features, the width of the Gaussians [m].
    """

    def __init__(self, features: SurfaceFeatures, centre: Array, reach: float, spacing: float):
        square = np.sum((features.p - centre) ** 2, axis=1)
        near = np.flatnonzero(square <= (reach + 4.0 * spacing) ** 2)
        if len(near) < min(_FEWEST, len(features)):
            near = np.sort(np.argsort(square, kind="stable")[:_FEWEST])
        taken = features.take(near)
        # At a rim, the axes of the feature's frame are not the principal directions.
        kappa = np.where(taken.rim[:, None], 0.0, taken.r / taken.rho)
        self._points, self._normals = taken.p, taken.normal
        k1, k2 = axis_of(taken.q, 0), axis_of(taken.q, 1)
        # Second derivatives of the paraboloids.
        self._hessian = kappa[:, :1, None] * k1[:, :, None] * k1[:, None] + kappa[:, 1:, None] * (
            k2[:, :, None] * k2[:, None]
        )
        self._width = 1.0 / spacing**2
        self._gap_width = 8.0 / spacing**2

    def footing(self, p: Array, z: Array) -> Footing:
        """Return the surface below a gripper at p (3,) [m] with the unit axis z (3,), in N."""
        d = p - self._points
        square = np.sum(d * d, axis=1)
        weight = _softmax(-0.5 * self._width * square + _SIDE * (self._normals @ z))
        curved = np.einsum("nij,nj->ni", self._hessian, d)
        height = np.sum(d * (self._normals + 0.5 * curved), axis=1)
        slope = self._normals + curved

        level, mean_slope = float(weight @ height), weight @ slope
        # Derivatives of weighted means: covariances with the weights' exponents.
        by_p, by_z = (
            self._width * self._points * weight[:, None],
            _SIDE * self._normals * weight[:, None],
        )
        apart, turned = height - level, slope - mean_slope
        level_by_p, level_by_z = mean_slope + apart @ by_p, apart @ by_z
        slope_by_p = np.einsum("n,nij->ij", weight, self._hessian) + turned.T @ by_p
        slope_by_z = turned.T @ by_z
        length = max(float(np.linalg.norm(mean_slope)), 1e-9)
        normal = mean_slope / length
        across = (np.eye(3) - np.outer(normal, normal)) / length

        share = _softmax(-0.5 * self._gap_width * square)
        mean_square = float(share @ square)
        gap = float(np.sqrt(mean_square + 1e-12))
        mean_d = share @ d
        gap_by_square = 2.0 * mean_d - self._gap_width * ((share * (square - mean_square)) @ d)
        return Footing(
            level,
            level_by_p,
            level_by_z,
            normal,
            across @ slope_by_p,
            across @ slope_by_z,
            gap,
            0.5 * gap_by_square / gap,
        )


def _softmax(exponent: Array) -> Array:
    weight = np.exp(exponent - exponent.max())
    return weight / weight.sum()
