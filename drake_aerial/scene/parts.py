"""Parts of the things on the supports: locally convex pieces of their visible surface.

Cut at depth jumps and concave edges, as in Stein et al., "Object partitioning using local
convexity" (2014), on pixels in place of supervoxels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_aerial.geometry import Array
from drake_aerial.scene.regions import connected_regions
from drake_aerial.scene.scene import SUPPORT
from drake_aerial.scene.supports import over
from drake_aerial.scene.surfaces import Plane, Surfaces

Mask = NDArray[np.bool_]
Labels = NDArray[np.int64]
# Smaller regions are left to their neighbours.
_LEAST_PIXELS = 15
# Things may stick out over a support's hull by this length [m].
_OVERHANG = 0.05
# Points of steeper surfaces [cosine] beside a support belong to what stands on it.
_STEEP = 0.75
# Points of a part that are kept for its geometry.
_SAMPLES = 1500


@dataclass(frozen=True, eq=False)
class Part:
    """A piece of surface, in axes with z up.

    Attributes
    ----------
    pixels : (M,) int array
        Flat indices of its pixels.
    points : (n, 3) array
        A sample of its points [m], in axes with z up through the viewer.
    normals : (n, 3) array
        Their normals.
    height : (n,) array
        Their heights above the support [m].
    area : (n,) array
        The surface's area [m^2] that each stands for.
    """

    pixels: Labels
    points: Array
    normals: Array
    height: Array
    area: Array


@dataclass(frozen=True, eq=False)
class Ground:
    """Supports and heights above them at each pixel.

    Attributes
    ----------
    support : (H, W) bool array
        The pixels of the supports.
    height : (H, W) array
        Height [m] above the support below the pixel.
    candidates : (H, W) bool array
        Pixels of what may stand on a support.
    over : (H, W) bool array
        Pixels over a support.
    """

    support: Mask
    height: Array
    candidates: Mask
    over: Mask


def find_ground(supports: list[Plane], walls: Mask, surfaces: Surfaces) -> Ground:
    """Return the pixels of the supports and the heights above them, without those of walls."""
    shape = surfaces.seen.shape
    on, above, under = (np.zeros(shape, dtype=bool) for _ in range(3))
    low_to_high = sorted(
        supports,
        key=lambda face: float(np.median(surfaces.points[face.pixels] @ supports[0].normal)),
    )
    height = surfaces.points @ low_to_high[0].normal - low_to_high[0].offset
    for face in low_to_high:
        over_face = over(face, surfaces, _OVERHANG)
        own = surfaces.points @ face.normal - face.offset
        tolerance = surfaces.tolerance(face.normal)
        higher = over_face & (own > -tolerance)
        height = np.where(higher, own, height)
        steep = surfaces.planes.normal @ face.normal < _STEEP
        on_face = higher & (np.abs(own) < tolerance) & ~(steep & (np.abs(own) > 0.4 * tolerance))
        on |= on_face
        above = (above | over_face) & ~on_face
        # What is below a raised support carries it, or is its side.
        under = (under & ~higher) | (over_face & (own < -tolerance))
    candidates = surfaces.seen & ~on & ~under & ~walls & (height > 0.0)
    return Ground(on, height, candidates, above & ~under)


def find_parts(surfaces: Surfaces, ground: Ground) -> Labels:
    """Return the parts' labels (H, W): 0 nothing, 1 support, 2 and up the parts."""
    creases = surfaces.creases
    whole = ground.candidates & np.isfinite(surfaces.planes.normal[..., 0])
    smooth = whole & ~creases.jump & ~creases.concave & ~creases.convex
    regions = connected_regions(smooth, _LEAST_PIXELS)
    labels = np.where(regions > 0, regions + SUPPORT, 0)
    labels[ground.support] = SUPPORT
    return labels


def part_of(pixels: Labels, surfaces: Surfaces, ground: Ground, R_UC: Array) -> Part:
    """Return the geometry of the part with these pixels (M,); `R_UC` turns z up."""
    chosen = pixels[:: max(1, len(pixels) // _SAMPLES)]
    points_C = surfaces.points.reshape(-1, 3)[chosen]
    normals_C = surfaces.planes.normal.reshape(-1, 3)[chosen]
    known = np.isfinite(normals_C[:, 0])
    if known.any():
        chosen, points_C, normals_C = chosen[known], points_C[known], normals_C[known]
    if surfaces.planes.perspective:
        rays = np.concatenate(
            [points_C[:, :2] / points_C[:, 2:], np.ones((len(chosen), 1))], axis=1
        )
        slant = np.abs((normals_C * rays).sum(axis=1))
        cell = surfaces.pixel_area * points_C[:, 2] ** 2
    else:
        slant, cell = np.abs(normals_C[:, 2]), np.full(len(chosen), surfaces.pixel_area)
    area = cell / np.maximum(slant, 0.05) * len(pixels) / len(chosen)
    return Part(pixels, points_C @ R_UC.T, normals_C @ R_UC.T, ground.height.ravel()[chosen], area)
