"""Where a depth image's surface jumps or bends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_aerial.geometry import Array
from drake_aerial.scene.local_planes import LocalPlanes

Mask = NDArray[np.bool_]
# Jumps are deviations from the neighbour's plane of more than this many standard deviations of the
# noise, beyond what a shift by one pixel explains.
JUMP_DEVIATIONS = 5.0
# Normals are compared at this distance [pixels] on both sides.
_REACH = 2


@dataclass(frozen=True, eq=False)
class Creases:
    """Pixels (H, W) beside a depth jump, in a concave edge, and in a convex edge."""

    jump: Mask
    concave: Mask
    convex: Mask


def find_creases(planes: LocalPlanes, smooth_C: Array, angle: float) -> Creases:
    """Return where the surface jumps, and where it bends by more than `angle` [deg].

    Two surfaces meet in a concave edge if their normals lean towards each other (Stein et al.,
    "Object partitioning using local convexity", 2014).

    Parameters
    ----------
    planes : LocalPlanes
        The planes around the pixels.
    smooth_C : (H, W, 3) array
        The pixels' points on these planes.
    angle : float
        Least angle of an edge [deg].
    """
    value = planes.value.astype(np.float32)
    x, y = (planes.rays[..., k].astype(np.float32) for k in range(2))
    a, b, c = (planes.coefficients[..., k].astype(np.float32) for k in range(3))
    normals = [planes.normal[..., k].astype(np.float32) for k in range(3)]
    points = [smooth_C[..., k].astype(np.float32) for k in range(3)]
    jump, concave, convex = (np.zeros(value.shape, dtype=bool) for _ in range(3))
    here = a * x + b * y + c
    most_cosine = np.cos(planes.least_angle(angle)).astype(np.float32)
    for axis in (0, 1):
        (x1, x2), (y1, y2), (value1, value2), (here1, here2) = (
            _pair(image, axis, 1) for image in (x, y, value, here)
        )
        (a1, a2), (b1, b2), (c1, c2) = (_pair(image, axis, 1) for image in (a, b, c))
        ahead, behind = a1 * x2 + b1 * y2 + c1, a2 * x1 + b2 * y1 + c2
        first = np.abs(ahead - value2) - np.abs(ahead - here1)
        second = np.abs(behind - value1) - np.abs(behind - here2)
        parted = ~(np.minimum(first, second) <= JUMP_DEVIATIONS * planes.noise)
        for side in _pair(jump, axis, 1):
            side |= parted
        cosine = sum(np.multiply(*_pair(normal, axis, 2 * _REACH)) for normal in normals)
        lean = sum(
            np.subtract(*_pair(normal, axis, 2 * _REACH))
            * np.subtract(*_pair(point, axis, 2 * _REACH))
            for normal, point in zip(normals, points, strict=True)
        )
        bent = cosine < _middle(most_cosine, axis)
        _middle(concave, axis)[...] |= bent & (lean < 0.0)
        _middle(convex, axis)[...] |= bent & (lean >= 0.0)
    jump &= np.isfinite(planes.value)
    return Creases(jump, concave, convex)


def _pair(image: NDArray, axis: int, reach: int) -> tuple[NDArray, NDArray]:
    """Return the views of an image (H, W) whose pixels are `reach` apart along an axis."""
    if axis == 0:
        return image[:-reach], image[reach:]
    return image[:, :-reach], image[:, reach:]


def _middle(image: NDArray, axis: int) -> NDArray:
    """Return the view of the pixels halfway between those of `_pair` at twice the reach."""
    return image[_REACH:-_REACH] if axis == 0 else image[:, _REACH:-_REACH]
