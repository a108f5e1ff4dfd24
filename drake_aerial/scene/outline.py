"""The outlines of objects in an image: seen, hidden by another thing, or cut."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_aerial.cloud.boundary import BoundaryKind
from drake_aerial.geometry import Array
from drake_aerial.scene.creases import JUMP_DEVIATIONS
from drake_aerial.scene.regions import connected_regions, find_rims, nearest_labelled
from drake_aerial.scene.scene import FIRST_OBJECT, NOTHING, SUPPORT
from drake_aerial.scene.surfaces import Surfaces

Labels = NDArray[np.int64]
# Shadows of objects are gaps without depth of up to this many pixels; beyond, nothing is known.
_WIDEST_SHADOW = 60.0
# Smaller regions that belong to no object are stray pixels: what is behind them counts.
_STRAY = 30
# Surfaces touch if their points are as close as their pixels, within this length [m].
_TOUCH = 0.015
# Facing up: cosine of the angle to the vertical.
_UP = 0.5


@dataclass(frozen=True, eq=False)
class Outline:
    """The rim pixels of all objects of an image.

    Attributes
    ----------
    pixels : (K,) int array
        Flat indices of the rim pixels, on the objects' side.
    labels : (K,) int array
        The object of each.
    kind : (K,) int8 array
        Its `BoundaryKind`.
    at_border : (K,) bool array
        Whether the image ends beside it.
    """

    pixels: Labels
    labels: Labels
    kind: NDArray[np.int8]
    at_border: NDArray[np.bool_]


def find_outline(labels: Labels, surfaces: Surfaces, up: Array) -> Outline:
    """Return the rims of the objects in the label image (H, W), with gravity up (3,) in C.

    What is beside a rim tells its nature. A nearer surface hides what lies beyond, also one that
    touches the object in a concave edge, unless the object stands on it. A farther one, or the
    support, shows that the object ends. At the image's border and at wide gaps without depth the
    view ends.
    """
    beyond = int(labels.max()) + 1
    border, blank = beyond + 1, beyond + 2
    other = connected_regions(surfaces.seen & (labels == NOTHING), _STRAY) > 0
    regions = np.pad(np.where(other, beyond, labels), 1, constant_values=border)
    nearest = nearest_labelled(regions)
    far = nearest.distance > 0.5 * _WIDEST_SHADOW
    # Beyond the shadows there is nothing: the pixels beside them are rims to nowhere.
    edge_of_far = far & (nearest.distance <= 0.5 * _WIDEST_SHADOW + 1.5)
    rims = find_rims(regions, nearest, _WIDEST_SHADOW)
    width = regions.shape[1]
    own = np.concatenate([rims.first, rims.second, nearest.pixel[edge_of_far]])
    across = np.concatenate([rims.second, rims.first, np.zeros(np.count_nonzero(edge_of_far), int)])
    code = regions.ravel()[across]
    code[len(rims.first) * 2 :] = blank
    of = regions.ravel()[own]
    is_object = (of >= FIRST_OBJECT) & (of < beyond)
    own, across, code, of = own[is_object], across[is_object], code[is_object], of[is_object]
    at_border = code == border
    known = code < border
    kind = np.full(len(own), BoundaryKind.CUT, dtype=np.int8)
    kind[known] = _kinds(
        _unpadded(own[known], width), _unpadded(across[known], width), code[known], surfaces, up
    )
    pixels = _unpadded(own, width)
    # One entry a pixel: what hides or cuts it counts.
    order = np.lexsort((kind, pixels))
    last = np.append(np.diff(pixels[order]) != 0, True) if len(order) else np.zeros(0, bool)
    chosen = order[last]
    return Outline(pixels[chosen], of[chosen], kind[chosen], at_border[chosen])


def _unpadded(pixels: Labels, width: int) -> Labels:
    """Return the flat indices in the image of those in the image with a frame of one pixel."""
    rows, columns = np.divmod(pixels, width)
    return (rows - 1) * (width - 2) + columns - 1


def _kinds(
    own: Labels, across: Labels, code: Labels, surfaces: Surfaces, up: Array
) -> NDArray[np.int8]:
    """Return the kinds of rims between known surfaces."""
    planes, points = surfaces.planes, surfaces.points.reshape(-1, 3)
    normals = planes.normal.reshape(-1, 3)
    coefficients, rays = planes.coefficients.reshape(-1, 3), planes.rays.reshape(-1, 2)
    value = planes.value.ravel()
    p, q = points[own], points[across]
    # The lateral distance of the pixels at the nearer depth.
    lateral = np.linalg.norm(rays[own] - rays[across], axis=1)
    if planes.perspective:
        lateral *= np.minimum(p[:, 2], q[:, 2])
    noise = surfaces.depth_noise.ravel()[across]
    touch = np.linalg.norm(p - q, axis=1) < 3.0 * lateral + _TOUCH + 3.0 * noise
    nearer = q[:, 2] < p[:, 2]
    expected = (coefficients[own, :2] * rays[across]).sum(axis=1) + coefficients[own, 2]
    lead = (value[across] - expected) * (1.0 if planes.perspective else -1.0)
    in_front = lead > JUMP_DEVIATIONS * planes.noise
    rests = (normals[own] @ up < _UP) & (normals[across] @ up > _UP)
    hidden = np.where(touch, in_front & ~rests & (code != SUPPORT), nearer)
    return np.where(hidden, BoundaryKind.OCCLUDED, BoundaryKind.SEEN).astype(np.int8)
