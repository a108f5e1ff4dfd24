"""The surfaces of a scene's image: points, local planes, creases, and planar faces."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from drake_aerial.geometry import Array
from drake_aerial.scene.creases import Creases, find_creases
from drake_aerial.scene.local_planes import LocalPlanes, fit_local_planes
from drake_aerial.scene.parameters import SceneParameters
from drake_aerial.scene.regions import connected_regions
from drake_aerial.scene.scene_image import SceneImage

Mask = NDArray[np.bool_]
# Points are on a plane within this multiple of the noise and this systematic part [m].
_DEVIATIONS, _BOW = 4.0, 0.003
# A face's points have normals within this angle [deg] of its normal.
_FACE_ANGLE = 20.0
# Regions are planar if this share of their points are on one plane.
_PLANAR = 0.7


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane in the image frame: the points p with normal . p = offset.

    Attributes
    ----------
    normal : (3,) array
        Unit normal, towards the viewer.
    offset : float
        Signed distance from the origin [m].
    pixels : (H, W) bool array
        The pixels on it.
    """

    normal: Array
    offset: float
    pixels: Mask


@dataclass(frozen=True, eq=False)
class Surfaces:
    """A scene's image with the planes and creases of its surfaces, in the image frame C.

    Attributes
    ----------
    points : (H, W, 3) array
        Points [m]; NaN where there is none.
    planes : LocalPlanes
        The plane around each pixel.
    creases : Creases
        Jumps and edges.
    """

    points: Array
    planes: LocalPlanes
    creases: Creases

    @classmethod
    def of_image(cls, image: SceneImage, parameters: SceneParameters) -> Surfaces:
        """Return the surfaces of an image."""
        perspective = image.viewpoint is not None
        planes = fit_local_planes(
            image.points_C, perspective=perspective, radius=parameters.window_radius
        )
        value = planes.at((0, 0))
        z = 1.0 / value if perspective else value
        flat = planes.rays * z[..., None] if perspective else planes.rays
        creases = find_creases(planes, np.dstack([flat, z]), parameters.concave_angle)
        return cls(image.points_C, planes, creases)

    @cached_property
    def seen(self) -> Mask:
        """Whether there is a point, (H, W)."""
        return np.isfinite(self.planes.value)

    @cached_property
    def pixel_area(self) -> float:
        """Area of a pixel at depth 1 m [m^2], or anywhere in a parallel view."""
        steps = [
            np.nanmedian(np.abs(np.diff(self.planes.rays[..., k], axis=1 - k))) for k in range(2)
        ]
        return float(steps[0] * steps[1])

    @cached_property
    def depth_noise(self) -> Array:
        """Standard deviation of the depths [m], (H, W)."""
        if not self.planes.perspective:
            return np.full(self.seen.shape, self.planes.noise)
        return self.planes.noise * self.points[..., 2] ** 2

    def tolerance(self, normal: Array) -> Array:
        """Return the distance [m] within which points are on a plane of this normal, (H, W)."""
        return _BOW + _DEVIATIONS * self.depth_noise * np.abs(self.slant(normal))

    def slant(self, normal: Array) -> Array:
        """Return normal . ray for each pixel, (H, W)."""
        if not self.planes.perspective:
            return np.full(self.seen.shape, normal[2])
        return self.planes.rays @ normal[:2] + normal[2]

    def faces(self, least_share: float) -> list[Plane]:
        """Return the planar faces of at least this share of the points, the largest first."""
        creases = self.creases
        smooth = self.seen & ~creases.jump & ~creases.concave & ~creases.convex
        least = max(50, int(least_share * np.count_nonzero(self.seen)))
        regions = connected_regions(smooth, least)
        found: list[Plane] = []
        for number in range(1, int(regions.max(initial=0)) + 1):
            region = regions == number
            if any(np.mean(plane.pixels[region]) > 0.5 for plane in found):
                continue
            plane = self.fit(region)
            if plane is None or np.mean(plane.pixels[region]) < _PLANAR:
                continue
            wider = self.fit(plane.pixels)
            found.append(wider or plane)
        return sorted(found, key=lambda plane: -np.count_nonzero(plane.pixels))

    def fit(self, region: Mask) -> Plane | None:
        """Return the plane through most points of a region (H, W), None if there is none."""
        pixels = region & self.seen
        plane = None
        for _ in range(3):
            if np.count_nonzero(pixels) < 20:
                return None
            normal, offset = _least_squares(self.points[pixels], self.depth_noise[pixels])
            if normal[2] > 0.0 if not self.planes.perspective else offset > 0.0:
                normal, offset = -normal, -offset
            plane = Plane(normal, offset, self.on_plane(normal, offset))
            pixels = plane.pixels & region
        return plane

    def on_plane(self, normal: Array, offset: float) -> Mask:
        """Return whether points lie on a plane and have its normal, (H, W)."""
        height = np.abs(self.points @ normal - offset)
        tolerance = self.tolerance(normal)
        aligned = ~(self.planes.normal @ normal < np.cos(np.deg2rad(_FACE_ANGLE)))
        # Close to the plane, a single normal may be wrong.
        return self.seen & (height < tolerance) & (aligned | (height < 0.3 * tolerance))


def _least_squares(points: Array, noise: Array) -> tuple[Array, float]:
    """Return the normal and offset of the plane through points (N, 3), weighted by their noise."""
    weight = 1.0 / np.maximum(noise, 1e-9) ** 2
    weight /= weight.sum()
    mean = weight @ points
    spread = (points - mean) * np.sqrt(weight)[:, None]
    normal = np.linalg.eigh(spread.T @ spread)[1][:, 0]
    return normal, float(normal @ mean)
