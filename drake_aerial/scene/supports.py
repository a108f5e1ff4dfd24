"""The planes that things stand on: a floor, a table; not a wall, nor the top of a parcel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_aerial.geometry import Array, perpendicular
from drake_aerial.scene.gravity import angle_deg
from drake_aerial.scene.regions import connected_regions, find_rims, nearest_labelled
from drake_aerial.scene.surfaces import Plane, Surfaces

Mask = NDArray[np.bool_]
# A support's normal is within this angle [deg] of a given up (a ramp is steeper).
_LEVEL = 15.0
# A support has at least this share of the points of the largest level plane.
_LEAST_SHARE = 0.05
# A plane this far [m] above a lower support is a support too if things stand on it and its rim is
# free: at most this share of it has a wall below, as a box has.
_LEVEL_HEIGHT, _WALLED = 0.15, 0.3
# Things stand on a plane if at least this share of the scene's points are above it, within its
# hull.
_LEAST_ABOVE = 0.001
# Walls are at least this wide [m] and half as high; what is this far [m] beyond them is behind.
_WALL_SIZE, _BEHIND = 0.8, 0.04
# Cells along the longer side of the grid on which hulls are drawn.
_GRID = 500


def find_supports(
    faces: list[Plane], up: Array, surfaces: Surfaces, least_height: float
) -> list[Plane]:
    """Return the planes that things stand on, the one with the most points first.

    The lowest level plane with things above it is one. A level plane above it is one if things
    stand on it and no walls join its rim to the ground; otherwise it is an object's top.

    Parameters
    ----------
    faces : list of Plane
        Planar faces in the image frame.
    up : (3,) array
        Unit vector against gravity in the image frame.
    surfaces : Surfaces
        The scene's surfaces.
    least_height : float
        Least height [m] of things.
    """
    level = [face for face in faces if angle_deg(face.normal, up) < _LEVEL]
    if not level:
        return []
    largest = max(int(face.pixels.sum()) for face in level)
    level = [face for face in level if np.count_nonzero(face.pixels) >= _LEAST_SHARE * largest]
    heights = [float(np.median(surfaces.points[face.pixels] @ up)) for face in level]
    order = np.argsort(heights)
    found: list[Plane] = []
    for k in order:
        face = level[k]
        carries = above(face, surfaces, least_height)
        if carries.sum() < _LEAST_ABOVE * np.count_nonzero(surfaces.seen):
            continue
        below = [heights[j] for j in order if heights[j] < heights[k] - _LEVEL_HEIGHT]
        if found and (heights[k] - heights[order[0]] < _LEVEL_HEIGHT or _has_walls(face, surfaces)):
            continue
        if not found and below and _has_walls(face, surfaces):
            continue
        if not _is_wider(face, carries, surfaces):
            continue
        found.append(face)
    return sorted(found, key=lambda face: -np.count_nonzero(face.pixels))


def find_walls(faces: list[Plane], support: Plane, surfaces: Surfaces) -> Mask:
    """Return the pixels (H, W) of walls: nothing is behind them, and the image's border cuts them.

    A wall is upright, higher than `_WALL_SIZE` above the support and wider than that.
    """
    walls = np.zeros(surfaces.seen.shape, dtype=bool)
    chosen = slice(None, None, 4)
    points, seen = surfaces.points[chosen, chosen], surfaces.seen[chosen, chosen]
    height = points @ support.normal - support.offset
    for face in faces:
        if abs(face.normal @ support.normal) > np.sin(np.deg2rad(_LEVEL)):
            continue
        pixels = face.pixels[chosen, chosen]
        distance = points @ face.normal - face.offset
        behind = seen & (distance < -_BEHIND) & (height > -_BEHIND)
        along = points[pixels] @ np.cross(face.normal, support.normal)
        border = np.concatenate([face.pixels[0], face.pixels[:, 0], face.pixels[:, -1]])
        if (
            np.count_nonzero(behind) < 0.01 * np.count_nonzero(seen)
            and len(along) > 0
            and np.ptp(np.percentile(along, [2, 98])) > _WALL_SIZE
            and np.percentile(height[pixels], 98) > 0.5 * _WALL_SIZE
            and np.count_nonzero(border) > 0
        ):
            tolerance = _BEHIND + surfaces.tolerance(face.normal)
            near = np.abs(surfaces.points @ face.normal - face.offset) < tolerance
            walls |= near & (surfaces.points @ support.normal - support.offset > 0.0)
    return walls


def above(face: Plane, surfaces: Surfaces, least_height: float) -> Mask:
    """Return the pixels (H, W) that are above a plane, over the hull of its points."""
    height = surfaces.points @ face.normal - face.offset
    high = surfaces.seen & (height > np.maximum(least_height, surfaces.tolerance(face.normal)))
    return high & over(face, surfaces)


def over(face: Plane, surfaces: Surfaces, margin: float = 0.0) -> Mask:
    """Return the pixels (H, W) whose points are over the hull of a plane's points.

    The hull is widened by `margin` [m]. It is drawn on a grid, from which the pixels are read.
    """
    import cv2

    hull, frame = footprint_hull(face, surfaces)
    lower, size = hull.min(axis=0) - max(margin, 0.0), np.ptp(hull, axis=0) + 2.0 * max(margin, 0.0)
    scale = _GRID / float(size.max())
    grid = np.zeros((_GRID + 3, _GRID + 3), dtype=np.uint8)
    cv2.fillConvexPoly(grid, np.rint((hull - lower) * scale + 1.0).astype(np.int32), 1)
    if margin:
        edge = cv2.distanceTransform(1 - grid if margin > 0.0 else grid, cv2.DIST_L2, 5)
        grid = (edge <= margin * scale if margin > 0.0 else edge > -margin * scale).astype(np.uint8)
    cell = (surfaces.points @ frame.T - lower) * scale + 1.0
    inside = ((cell >= 0.0) & (cell <= _GRID + 2.0)).all(axis=-1)
    column, row = np.moveaxis(np.where(inside[..., None], cell, 0.0).astype(np.int64), -1, 0)
    return inside & (grid[row, column] > 0)


def footprint_hull(face: Plane, surfaces: Surfaces) -> tuple[Array, Array]:
    """Return the convex hull (K, 2) [m] of a plane's points, and the axes (2, 3) in the plane."""
    import cv2

    x = perpendicular(face.normal)
    frame = np.stack([x, np.cross(face.normal, x)])
    points = surfaces.points[face.pixels]
    flat = (points[:: max(1, len(points) // 30000)] @ frame.T).astype(np.float32)
    return np.asarray(cv2.convexHull(flat), dtype=np.float64)[:, 0], frame


def _has_walls(face: Plane, surfaces: Surfaces) -> bool:
    """Return whether walls hang down from a level plane's rim, as on a box, not a table."""
    height = surfaces.points @ face.normal - face.offset
    tolerance = surfaces.tolerance(face.normal)
    wall = surfaces.seen & (height < -tolerance) & (surfaces.planes.normal @ face.normal < 0.5)
    beyond = surfaces.seen & ~face.pixels & ~wall & (height < -tolerance)
    labels = np.where(face.pixels, 1, np.where(wall, 2, np.where(beyond, 3, 0)))
    rims = find_rims(labels, nearest_labelled(labels), 8.0)
    other = np.maximum(labels.ravel()[rims.first], labels.ravel()[rims.second])
    own = np.minimum(labels.ravel()[rims.first], labels.ravel()[rims.second])
    # Only walls that begin at the rim, not what is seen beside it.
    depth = height.ravel()
    lower = np.minimum(depth[rims.first], depth[rims.second])
    walls = np.count_nonzero((own == 1) & (other == 2) & (lower > -0.05))
    free = np.count_nonzero((own == 1) & ((other == 3) | ((other == 2) & (lower <= -0.05))))
    return bool(walls > _WALLED * (walls + free))


def _is_wider(face: Plane, carries: Mask, surfaces: Surfaces) -> bool:
    """Return whether a plane goes on around at least one of the things on it.

    The floor of a tray, the lower step of a box and the seat of a chair do not: what is above them
    stands at their rim.
    """
    hull, _ = footprint_hull(face, surfaces)
    size = np.asarray(np.ptp(hull, axis=0))
    extent = float(np.sqrt(size[0] * size[1]))
    margin = 0.02 * extent
    inner = over(face, surfaces, -margin)
    things = connected_regions(carries, 30)
    count = np.bincount(things.ravel())
    within = np.bincount(things.ravel(), weights=inner.ravel())
    at_border = np.zeros(len(count), dtype=bool)
    if surfaces.has_border and _border(face.pixels).any():
        # The image's border cuts the plane and these things alike.
        at_border[_border(things)] = True
    least = np.where(at_border, 0.5, 0.98)
    return bool((within[1:] > least[1:] * count[1:]).any())


def _border(image: NDArray) -> NDArray:
    """Return the values of an image (H, W) along its border."""
    return np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
