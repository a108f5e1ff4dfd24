"""Describe the objects of a scene: their points, boxes and boundaries."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from drake_aerial.cloud.boundary import Boundary
from drake_aerial.geometry import Array, perpendicular
from drake_aerial.scene.outline import Outline
from drake_aerial.scene.scene import (
    FIRST_OBJECT,
    NOTHING,
    SUPPORT,
    Box,
    Gravity,
    Scene,
    SceneObject,
    Support,
)
from drake_aerial.scene.scene_image import SceneImage
from drake_aerial.scene.surfaces import Plane, Surfaces

Labels = NDArray[np.int64]
# Points behind the one that a pixel shows have its label if they are this close to it [m].
_SAME_SURFACE = 0.01
# Others belong to the object below whose footprint they are: horizontal distances count fully,
# heights by this factor, up to this distance [m].
_HEIGHT_WEIGHT, _FOOTPRINT = 0.05, 0.03


def point_labels(
    image: SceneImage, surfaces: Surfaces, on_pixels: Labels, supports: list[Plane], up_C: Array
) -> Labels:
    """Return the labels (N,) of the cloud's points for those of the pixels (H, W)."""
    labels = np.full(len(image.cloud), NOTHING, dtype=np.int64)
    shown = image.index >= 0
    labels[image.index[shown]] = on_pixels[shown]
    rest = np.ones(len(image.cloud), dtype=bool)
    rest[image.index[shown]] = False
    rest &= image.pixel[:, 0] >= 0
    if not rest.any():
        return labels
    points = (image.cloud.points - image.origin) @ image.R_SC
    rows, columns = image.pixel[rest].T
    behind = points[rest, 2] - image.points_C[rows, columns, 2]
    labels[rest] = np.where(behind < _SAME_SURFACE, on_pixels[rows, columns], NOTHING)
    hidden = np.flatnonzero(rest)[behind >= _SAME_SURFACE]
    for face in supports:
        near = np.abs(points[hidden] @ face.normal - face.offset) < _SAME_SURFACE
        labels[hidden[near]] = SUPPORT
    hidden = hidden[labels[hidden] != SUPPORT]
    objects = np.flatnonzero(labels >= FIRST_OBJECT)
    if len(hidden) and len(objects):
        x = perpendicular(up_C)
        axes = np.stack([x, np.cross(up_C, x), _HEIGHT_WEIGHT * up_C])
        distance, nearest = cKDTree(points[objects] @ axes.T).query(
            points[hidden] @ axes.T, distance_upper_bound=_FOOTPRINT
        )
        found = np.isfinite(distance)
        labels[hidden[found]] = labels[objects[nearest[found]]]
    return labels


def describe_objects(
    image: SceneImage,
    surfaces: Surfaces,
    labels: Labels,
    outline: Outline,
    up: Array,
    supports: tuple[Support, ...],
) -> tuple[SceneObject, ...]:
    """Return the objects of the points' labels (N,), with up (3,) in S."""
    rim_S = image.origin + surfaces.points.reshape(-1, 3)[outline.pixels] @ image.R_SC.T
    found = []
    for number in range(FIRST_OBJECT, int(labels.max()) + 1):
        indices = np.flatnonzero(labels == number)
        points = image.cloud.points[indices]
        own = outline.labels == number
        box = upright_box(points, up)
        heights = [float(np.percentile(s.height(points), 5)) for s in supports]
        below = [k for k in np.argsort(heights) if heights[k] > -0.02]
        found.append(
            SceneObject(
                number,
                indices,
                box,
                _distance(image, points, box),
                Boundary(rim_S[own], outline.kind[own]),
                bool(outline.at_border[own].any()),
                int(below[0]) if below else None,
            )
        )
    return tuple(found)


def one_object(image: SceneImage, gravity: Gravity) -> Scene:
    """Return the scene of a cloud without a support: one object."""
    points = image.cloud.points
    labels = np.full(len(points), FIRST_OBJECT, dtype=np.int64)
    box = upright_box(points, gravity.up)
    boundary = Boundary(np.zeros((0, 3)), np.zeros(0, dtype=np.int8))
    whole = SceneObject(
        FIRST_OBJECT,
        np.arange(len(points)),
        box,
        _distance(image, points, box),
        boundary,
        touches_border=False,
        support=None,
    )
    return Scene(image, gravity, (), (whole,), labels)


def upright_box(points: Array, up: Array) -> Box:
    """Return the upright box around points (N, 3), with the smallest footprint."""
    import cv2

    x = perpendicular(up)
    frame = np.stack([x, np.cross(up, x), up], axis=1)
    local = points @ frame
    hull = cv2.convexHull(local[:, :2].astype(np.float32))
    _, (width, depth), angle = cv2.minAreaRect(hull)
    turn = np.deg2rad(angle if width >= depth else angle + 90.0)
    along = np.array([np.cos(turn), np.sin(turn), 0.0])
    axes = frame @ np.stack([along, np.cross([0.0, 0.0, 1.0], along), [0.0, 0.0, 1.0]], axis=1)
    inside = points @ axes
    lower, upper = inside.min(axis=0), inside.max(axis=0)
    return Box(axes @ (0.5 * (lower + upper)), axes, upper - lower)


def _distance(image: SceneImage, points: Array, box: Box) -> float:
    if image.viewpoint is None:
        return float(np.linalg.norm(box.center))
    return float(np.linalg.norm(points - image.viewpoint, axis=1).min())
