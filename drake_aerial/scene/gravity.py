"""The direction against gravity: given, by an IMU, or by the plane that things stand on."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.scene.surfaces import Plane, Surfaces

# A camera is taken to stand upright up to this roll [deg], and to look down by at least this
# angle [deg], when no direction of gravity is known. Planes that would contradict count less.
_ROLL, _LEAST_PITCH, _CONTRADICTION = 30.0, 5.0, 0.02
# Planes of one direction agree within this angle [deg].
_PARALLEL = 8.0
# Points this far [m] below a plane are below it, whatever the noise.
_BELOW = 0.05
# Systematic part of a plane's direction [deg]: the bow of depth images over the field of view.
_SYSTEMATIC_DEG = 0.3


def unit_vector(values: ArrayLike, name: str) -> Array:
    """Return a direction (3,) of length 1.

    Raises
    ------
    InputError
        If it has not three finite numbers, or its length is 0.
    """
    vector = np.asarray(values, dtype=np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all() or np.linalg.norm(vector) < 1e-9:
        raise InputError(f"`{name}` must be a direction of positive length, got {values!r}")
    return vector / np.linalg.norm(vector)


def upright(normal: Array) -> float:
    """Return how likely (0 to 1) a normal (3,) in the image frame is up, for a usual camera.

    Cameras are held upright and look down: walls and the fronts of boxes that face the camera have
    normals that point down in the image.
    """
    down = -normal[2]
    roll = np.rad2deg(np.arctan2(abs(normal[0]), max(-normal[1], 1e-9)))
    # Seen from straight above, the roll has no meaning.
    roll *= np.hypot(normal[0], normal[1])
    fits = down > np.sin(np.deg2rad(_LEAST_PITCH)) and normal[1] < 0.1 and roll < _ROLL
    return 1.0 if fits else _CONTRADICTION


def up_from_planes(faces: list[Plane], surfaces: Surfaces) -> Array:
    """Return the direction (3,) in the image frame in which most horizontal area faces.

    Raises
    ------
    InputError
        If there is no plane.
    """
    if not faces:
        raise InputError(
            "no plane that things stand on is seen and the direction of gravity is unknown; "
            "give --up X Y Z, or take the image with more of the floor or table"
        )
    best, best_score = faces[0], -1.0
    for face in faces:
        parallel = [other for other in faces if angle_deg(other.normal, face.normal) < _PARALLEL]
        area = sum(np.count_nonzero(other.pixels) for other in parallel)
        # Of parallel planes the lowest carries the others.
        score = area * upright(face.normal) * standing(face, surfaces)
        if score > best_score:
            best, best_score = face, score
    return best.normal


def standing(face: Plane, surfaces: Surfaces) -> float:
    """Return the share of the scene's points that are not below a plane."""
    chosen = slice(None, None, 4)
    height = surfaces.points[chosen, chosen] @ face.normal - face.offset
    height = height[surfaces.seen[chosen, chosen]]
    return float(np.mean(height > -_BELOW))


def direction_uncertainty_deg(face: Plane, surfaces: Surfaces) -> float:
    """Return the standard deviation [deg] of a plane's normal.

    The statistical part counts one independent depth in each fitting window. The systematic part
    is how the normals of the plane's four quarters differ.
    """
    pixels = face.pixels
    rows, columns = np.nonzero(pixels)
    flat = np.flatnonzero(pixels)
    points = surfaces.points[pixels]
    noise = float(
        np.median(surfaces.depth_noise[pixels] * np.abs(surfaces.slant(face.normal)[pixels]))
    )
    spread = np.sqrt(np.linalg.eigvalsh(np.cov(points.T))[1:])
    independent = max(1.0, len(points) / 25.0)
    statistical = (
        noise / np.sqrt(independent) * np.sqrt(np.sum(1.0 / np.maximum(spread, 1e-6) ** 2))
    )
    quarters = []
    for above in (True, False):
        for left in (True, False):
            inside = ((rows < np.median(rows)) == above) & ((columns < np.median(columns)) == left)
            normal, _, share = surfaces.fit(flat[inside])
            if share > 0.0:
                quarters.append(angle_deg(normal, face.normal))
    # Each quarter is half as wide as the whole: its direction errs at least twice as much.
    systematic = 0.5 * float(np.sqrt(np.mean(np.square(quarters)))) if quarters else 1.0
    return float(np.sqrt(np.rad2deg(statistical) ** 2 + systematic**2 + _SYSTEMATIC_DEG**2))


def angle_deg(first: Array, second: Array) -> float:
    """Return the angle [deg] between two unit vectors (3,)."""
    across = np.linalg.norm(np.cross(first, second))
    return float(np.rad2deg(np.arctan2(across, first @ second)))
