"""A payload as it is going to be flown: in its tracked frame L, with its contacts and with what was seen of it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial import geometry
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, Pose
from drake_aerial.plant.payload import TABLE_MASS, Payload

if TYPE_CHECKING:
    from drake_aerial.cloud.point_cloud import PointCloud

REACH = 0.02
"""A contact further than this from the payload's surface is refused [m]."""


@dataclass(frozen=True, eq=False)
class Suspension:
    """Payload, contacts and scan in the tracked frame L: origin at the scan's centroid, axes of the world at the start.

    Attributes
    ----------
    payload : Payload
        In L.
    p_LC, normal_L : (n, 3) arrays
        Contacts [m] and outward unit normals.
    scan_L : (N, 3) array or None
        What was seen [m]; None if nothing but the payload's model is known.
    moved : (n,) array
        How far each contact was moved to the payload's surface [m].
    """

    payload: Payload
    p_LC: Array
    normal_L: Array
    scan_L: Array | None
    moved: Array

    @classmethod
    def hang(
        cls,
        payload: Payload | None,
        p_SC: ArrayLike,
        normal_S: ArrayLike,
        *,
        scan: PointCloud | ArrayLike | None = None,
        mass: float | None = None,
        centroid: ArrayLike | None = None,
        up: ArrayLike | None = None,
    ) -> Suspension:
        """Hang a payload by contacts that are given in the scan's frame S.

        Parameters
        ----------
        payload : Payload or None
            None: the scan's closed hull of uniform density; its contacts stay where the scan has them.
        p_SC, normal_S : (n, 3)
            Contacts [m] and outward normals.
        scan : PointCloud or (N, 3), optional
            What was seen [m]; the payload's own vertices by default.
        mass : float, optional
            Of a payload known by its scan alone [kg]; 0.25 by default.
        centroid : (3,), optional
            L's origin in S [m]; the mean of the scan's points by default.
        up : (3,), optional
            Against gravity, in S; the scan's, or z.

        Raises
        ------
        InputError
            If a contact is more than 2 cm off the surface, or there is neither a payload nor a scan.
        """
        points = None if scan is None else np.asarray(getattr(scan, "points", scan), dtype=float)
        if payload is None:
            if scan is None or points is None:
                raise InputError("neither a payload nor a scan is known; one of the two is needed")
            payload = Payload.from_cloud(scan, TABLE_MASS if mass is None else mass)
            on_hull = False
        elif mass is not None:
            raise InputError(
                "a payload and a mass were given; a mass is accepted only for a payload known by its scan alone"
            )
        else:
            on_hull = True
        vertices_S = geometry.transform(payload.X_SP, payload.vertices)
        seen = vertices_S if points is None else points
        p_SL = seen.mean(axis=0) if centroid is None else np.asarray(centroid, dtype=float)
        up = np.asarray(getattr(scan, "up", (0.0, 0.0, 1.0)) if up is None else up, dtype=float)
        q_SL = geometry.quat_from_two_vectors([0.0, 0.0, 1.0], up / np.linalg.norm(up))
        X_LS = geometry.invert(Pose(p_SL, q_SL))
        payload = payload.in_tracked_frame(p_SL, q_SL)
        scan_L = None if points is None else geometry.transform(X_LS, points)
        p_LC = geometry.transform(X_LS, np.asarray(p_SC, dtype=float).reshape(-1, 3))
        normal_L = geometry.rotate(X_LS.q, np.asarray(normal_S, dtype=float).reshape(-1, 3))
        p_LC, normal_L, moved = _touch(payload, p_LC, normal_L, scan_L if not on_hull else None)
        return cls(payload, p_LC, normal_L, scan_L, moved)


def _touch(
    payload: Payload, p_LC: Array, normal_L: Array, scan_L: Array | None
) -> tuple[Array, Array, Array]:
    """Put contacts on the payload's surface, or, where the scan alone is known, check that they are on the scan."""
    if scan_L is None:
        points, normals, distance = payload.closest_point(p_LC)
        against = np.sum(normals * normal_L, axis=1) < 0.0
        normals[against] *= -1.0
    else:
        gaps = np.linalg.norm(p_LC[:, None, :] - scan_L[None], axis=2)
        # A scan is sparse: its own spacing does not count.
        spacing = np.sqrt(np.prod(np.sort(np.ptp(scan_L, axis=0))[1:]) / len(scan_L))
        distance = np.maximum(0.0, gaps.min(axis=1) - spacing)
        points, normals = p_LC, normal_L
    for i, d in enumerate(distance):
        if d > REACH:
            raise InputError(
                f"contact {i + 1} of {len(distance)} is {100 * d:.1f} cm off the surface of payload {payload.name!r}; "
                f"at most {100 * REACH:g} cm accepted"
            )
    return points, normals, distance if scan_L is None else np.zeros(len(p_LC))


def read_scan(cloud: dict[str, Any], beside: Path | None, *, needed: bool) -> PointCloud | None:
    """Return the cloud that a contacts.json names, or None if it is gone and not needed.

    Parameters
    ----------
    cloud : dict
        `path`, `sha256` and, optionally, `up` of the cloud.
    beside : Path or None
        The folder that a relative path may refer to, apart from the current one.
    needed : bool
        Whether a missing cloud is an error.

    Raises
    ------
    InputError
        If the cloud is needed and cannot be read, or is not the one the contacts were found on.
    """
    from drake_aerial.scene.recorded_scan import read_recorded_scan

    path = cloud.get("path")
    candidates = [] if not path else [Path(path)] + ([] if beside is None else [beside / path])
    found = next((candidate for candidate in candidates if os.path.isfile(candidate)), None)
    if found is None:
        if needed:
            where = (
                f"the scan {path} that the contacts were found on is not there"
                if path
                else "the contacts name no scan"
            )
            raise InputError(f"{where}: give the scan as cloud, or a payload")
        return None
    try:
        return read_recorded_scan(cloud, found)
    except InputError:
        if needed:
            raise
        return None
