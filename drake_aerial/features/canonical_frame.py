"""Canonical frame of a cloud: it moves with the cloud and ignores the order of points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.geometry import (
    Array,
    Pose,
    invert,
    perpendicular,
    quat_about_axis,
    quat_from_xz,
    quat_multiply,
)

# Moments below this fraction of their largest possible value are rounding errors.
_SIGNIFICANT = 1e-7


def canonical_frame(cloud: PointCloud) -> Pose:
    """Return X_SN: N has its origin at the centroid, z up and a yaw computed from the points.

    The yaw is the principal axis of the horizontal second moment; the third moments select its
    sense. If the second moment is isotropic, as for a square, the first higher rotational moment
    that is not isotropic replaces it. Except for rounding, coordinates in N do not depend on the
    position and yaw of the cloud, nor on the order and repetition of its points. A cloud with a
    rotational symmetry about the vertical has several such frames, with equal coordinates.

    Parameters
    ----------
    cloud : PointCloud
        A cloud in its frame S.

    Returns
    -------
    Pose
        X_SN, one pose; `cloud.transformed(invert(X_SN))` is the cloud in N.
    """
    points = _distinct(cloud.points)
    p_SN = points.mean(axis=0)
    x0 = perpendicular(cloud.up)
    q_S0 = quat_from_xz(x0, cloud.up)
    y0 = np.cross(cloud.up, x0)
    # In complex numbers, a yaw a multiplies the k-th moment by exp(i k a).
    plane = (points - p_SN) @ x0 + 1j * ((points - p_SN) @ y0)
    yaw = _principal_yaw(plane)
    q_SN = quat_multiply(q_S0, quat_about_axis(np.array([0.0, 0.0, 1.0]), np.asarray(yaw)))
    return Pose(p_SN, q_SN)


def _distinct(points: Array) -> Array:
    """Return the distinct rows, in lexicographic order."""
    points = points[np.lexsort(points.T[::-1])]
    return points[np.append(True, (np.diff(points, axis=0) != 0.0).any(axis=1))]


def _principal_yaw(plane: NDArray[np.complex128]) -> float:
    radius = np.abs(plane)
    for order in (2, 4, 3, 6, 5, 8, 7):
        moment = np.sum(plane**order)
        if np.abs(moment) > _SIGNIFICANT * np.sum(radius**order):
            candidates = (np.angle(moment) + 2.0 * np.pi * np.arange(order)) / order
            return _break_tie(plane, candidates)
    # Rotationally symmetric to rounding: any yaw is valid.
    return float(np.angle(plane[np.argmax(radius)]))


def _break_tie(plane: NDArray[np.complex128], candidates: Array) -> float:
    """Return the candidate yaw with the largest third moment along x, on ties along y."""
    tolerance = _SIGNIFICANT * np.sum(np.abs(plane) ** 3)
    for part in (np.real, np.imag):
        moments = np.array([np.sum(part(plane * np.exp(-1j * yaw)) ** 3) for yaw in candidates])
        candidates = candidates[moments >= moments.max() - tolerance]
    return float(candidates[0])


def to_canonical(cloud: PointCloud) -> tuple[PointCloud, Pose]:
    """Return the cloud expressed in its canonical frame N, and X_SN."""
    X_SN = canonical_frame(cloud)
    return cloud.transformed(invert(X_SN)), X_SN
