"""A payload with its contacts and scan, expressed in the tracked frame L."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial import geometry
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, Pose
from drake_aerial.plant.part_checks import check_contact_distances
from drake_aerial.plant.payload import TABLE_MASS, Payload


@dataclass(frozen=True, eq=False)
class SuspendedPayload:
    """Payload, contacts and scan in the tracked frame L.

    L has its origin at the scan's centroid and the world's axes at the start of a flight.

    Attributes
    ----------
    payload : Payload
        In L.
    p_LC, normal_L : (n, 3) arrays
        Contacts [m] and outward unit normals.
    scan_L : (N, 3) array or None
        The scan's points [m]; None if only the payload's model is known.
    moved : (n,) array
        Distance by which each contact was moved to the payload's surface [m].

    Examples
    --------
    >>> from drake_aerial import Payload, SuspendedPayload
    >>> box = Payload.from_box([0.4, 0.4, 0.2], 0.25)
    >>> held = SuspendedPayload.from_contacts(box, [[0.0, 0.0, 0.11]], [[0.0, 0.0, 1.0]])
    >>> held.p_LC.round(3).tolist(), held.moved.round(3).tolist()
    ([[0.0, 0.0, 0.1]], [0.01])
    """

    payload: Payload
    p_LC: Array
    normal_L: Array
    scan_L: Array | None
    moved: Array

    @classmethod
    def from_contacts(
        cls,
        payload: Payload | None,
        p_SC: ArrayLike,
        normal_S: ArrayLike,
        *,
        scan: PointCloud | ArrayLike | None = None,
        mass: float | None = None,
        centroid: ArrayLike | None = None,
        up: ArrayLike | None = None,
    ) -> SuspendedPayload:
        """Suspend a payload from contacts that are given in the scan's frame S.

        Contacts are moved to the closest point of the payload's surface. If only the scan is
        known they stay where they are.

        Parameters
        ----------
        payload : Payload or None
            None: the scan's closed hull, of uniform density.
        p_SC, normal_S : (n, 3)
            Contacts [m] and outward normals.
        scan : PointCloud or (N, 3), optional
            The scan [m]; by default the payload's vertices stand for it.
        mass : float, optional
            Mass of a payload that is known by its scan alone [kg]; 0.25 by default.
        centroid : (3,), optional
            L's origin in S [m]; by default the mean of the scan's points.
        up : (3,), optional
            Direction against gravity, in S; by default the scan's, or z.

        Raises
        ------
        InputError
            If a contact is more than 2 cm from the surface, if neither payload nor scan is given,
            or if a mass is given with a payload.
        """
        points = None if scan is None else np.asarray(getattr(scan, "points", scan), dtype=float)
        on_surface = payload is not None
        if payload is None:
            if scan is None or points is None:
                raise InputError("`payload` or `scan` must be given, got neither")
            payload = Payload.from_cloud(scan, TABLE_MASS if mass is None else mass)
        elif mass is not None:
            raise InputError(
                "`mass` must not be given with `payload`: it is for a payload that is known only "
                "by its scan"
            )
        visible = geometry.transform(payload.X_SP, payload.vertices) if points is None else points
        p_SL = visible.mean(axis=0) if centroid is None else np.asarray(centroid, dtype=float)
        up = np.asarray(getattr(scan, "up", (0.0, 0.0, 1.0)) if up is None else up, dtype=float)
        q_SL = geometry.quat_from_two_vectors([0.0, 0.0, 1.0], up / np.linalg.norm(up))
        X_LS = geometry.invert(Pose(p_SL, q_SL))
        payload = payload.in_tracked_frame(p_SL, q_SL)
        scan_L = None if points is None else geometry.transform(X_LS, points)
        p_LC = geometry.transform(X_LS, np.asarray(p_SC, dtype=float).reshape(-1, 3))
        normal_L = geometry.rotate(X_LS.q, np.asarray(normal_S, dtype=float).reshape(-1, 3))
        moved = np.zeros(len(p_LC))
        if on_surface:
            p_LC, normal_L, moved = _closest_contacts(payload, p_LC, normal_L)
        else:
            assert scan_L is not None
            check_contact_distances(_distances_from_scan(p_LC, scan_L), payload.name)
        return cls(payload, p_LC, normal_L, scan_L, moved)


def _closest_contacts(payload: Payload, p_LC: Array, normal_L: Array) -> tuple[Array, Array, Array]:
    """Return the closest surface points (n, 3), their normals (n, 3) and the distances (n,) [m].

    Each normal is on the same side as the given one.
    """
    points, normals, distances = payload.closest_point(p_LC)
    check_contact_distances(distances, payload.name)
    normals[np.sum(normals * normal_L, axis=1) < 0.0] *= -1.0
    return points, normals, distances


def _distances_from_scan(p_LC: Array, scan_L: Array) -> Array:
    """Return the distances (n,) of contacts from a scan [m], less the scan's mean point spacing."""
    gaps = np.linalg.norm(p_LC[:, None, :] - scan_L[None], axis=2)
    spacing = np.sqrt(np.prod(np.sort(np.ptp(scan_L, axis=0))[1:]) / len(scan_L))
    return np.maximum(0.0, gaps.min(axis=1) - spacing)
