"""Where a depth image's surface jumps or bends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_aerial.geometry import Array
from drake_aerial.scene.local_planes import LocalPlanes, shifted

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
    shape = planes.value.shape
    jump, concave, convex = (np.zeros(shape, dtype=bool) for _ in range(3))
    here = planes.at((0, 0))
    least_cos = np.cos(np.deg2rad(angle))
    for rows, columns in ((0, 1), (1, 0)):
        ahead, behind = planes.at((rows, columns)), planes.at((-rows, -columns))
        limit = JUMP_DEVIATIONS * planes.noise
        first = np.abs(ahead - shifted(planes.value, -rows, -columns)) - np.abs(ahead - here)
        second = np.abs(behind - shifted(planes.value, rows, columns)) - np.abs(behind - here)
        second = shifted(second, -rows, -columns)
        parted = ~(np.minimum(first, second) <= limit)
        jump |= parted
        jump |= shifted(parted, rows, columns, fill=False)
        down, right = _REACH * rows, _REACH * columns
        normal_1, normal_2 = (shifted(planes.normal, s * down, s * right) for s in (1, -1))
        point_1, point_2 = (shifted(smooth_C, s * down, s * right) for s in (1, -1))
        bent = (normal_1 * normal_2).sum(axis=-1) < least_cos
        lean = ((normal_1 - normal_2) * (point_1 - point_2)).sum(axis=-1)
        concave |= bent & (lean < 0.0)
        convex |= bent & (lean >= 0.0)
    jump &= np.isfinite(planes.value)
    return Creases(jump, concave, convex)
