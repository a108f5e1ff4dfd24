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
# Faces that are looked for, and points through which a plane is fitted.
_MOST_FACES, _FITTED = 30, 20000
# Angle of a pixel [rad] of a usual depth camera of 640 x 480 pixels, and allowed radii [pixels].
_PIXEL, _RADII = 1.0 / 525.0, (3, 8)
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
    has_border : bool
        Whether the image ends at a camera's border, not with the cloud.
    """

    points: Array
    planes: LocalPlanes
    creases: Creases
    has_border: bool

    @classmethod
    def of_image(cls, image: SceneImage, parameters: SceneParameters) -> Surfaces:
        """Return the surfaces of an image."""
        perspective = image.viewpoint is not None
        radius = _radius(image, parameters.window_radius)
        planes = fit_local_planes(image.points_C, perspective=perspective, radius=radius)
        value = planes.at((0, 0))
        z = 1.0 / value if perspective else value
        flat = planes.rays * z[..., None] if perspective else planes.rays
        creases = find_creases(planes, np.dstack([flat, z]), parameters.concave_angle)
        return cls(image.points_C, planes, creases, image.camera is not None)

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
        regions = connected_regions(smooth, least).ravel()
        order = np.argsort(regions, kind="stable")
        order = order[np.searchsorted(regions[order], 1) :]
        found: list[Plane] = []
        for region in np.split(order, np.flatnonzero(np.diff(regions[order])) + 1)[:_MOST_FACES]:
            if len(region) == 0 or any(p.pixels.ravel()[region].mean() > 0.5 for p in found):
                continue
            normal, offset, share = self.fit(region)
            if share < _PLANAR:
                continue
            wider = np.flatnonzero(self.on_plane(normal, offset))
            normal, offset, _ = self.fit(wider if len(wider) else region)
            found.append(Plane(normal, offset, self.on_plane(normal, offset)))
        return sorted(found, key=lambda plane: -np.count_nonzero(plane.pixels))

    def fit(self, pixels: NDArray[np.int64]) -> tuple[Array, float, float]:
        """Return the plane through most points of flat pixels (N,): normal, offset, their share."""
        chosen = pixels[:: max(1, len(pixels) // _FITTED)]
        points = self.points.reshape(-1, 3)[chosen]
        noise = self.depth_noise.ravel()[chosen]
        known = np.isfinite(points[:, 0])
        points, noise = points[known], noise[known]
        inside = np.ones(len(points), dtype=bool)
        normal, offset, share = np.array([0.0, 0.0, -1.0]), 0.0, 0.0
        for _ in range(3):
            if np.count_nonzero(inside) < 10:
                return normal, offset, 0.0
            normal, offset = _least_squares(points[inside], noise[inside])
            if offset > 0.0 if self.planes.perspective else normal[2] > 0.0:
                normal, offset = -normal, -offset
            ray = points / points[:, 2:] if self.planes.perspective else np.array([0.0, 0.0, 1.0])
            limit = _BOW + _DEVIATIONS * noise * np.abs(ray @ normal)
            inside = np.abs(points @ normal - offset) < limit
            share = float(inside.mean())
        return normal, offset, share

    def on_plane(self, normal: Array, offset: float) -> Mask:
        """Return whether points lie on a plane and have its normal, (H, W)."""
        height = np.abs(self.points @ normal - offset)
        tolerance = self.tolerance(normal)
        aligned = ~(self.planes.normal @ normal < np.cos(np.deg2rad(_FACE_ANGLE)))
        # Close to the plane, a single normal may be wrong.
        return self.seen & (height < tolerance) & (aligned | (height < 0.3 * tolerance))


def _radius(image: SceneImage, at_640: int) -> int:
    """Return the windows' radius [pixels], for the angle that it is in a 640 pixel wide image."""
    if image.viewpoint is None:
        return _RADII[0]
    x = image.points_C[..., 0] / image.points_C[..., 2]
    step = float(np.nanmedian(np.diff(x[:: max(1, len(x) // 20)], axis=1)))
    return int(np.clip(round(at_640 * _PIXEL / max(step, 1e-9)), *_RADII))


def _least_squares(points: Array, noise: Array) -> tuple[Array, float]:
    """Return the normal and offset of the plane through points (N, 3), weighted by their noise."""
    weight = 1.0 / np.maximum(noise, 1e-9) ** 2
    weight /= weight.sum()
    mean = weight @ points
    spread = (points - mean) * np.sqrt(weight)[:, None]
    normal = np.linalg.eigh(spread.T @ spread)[1][:, 0]
    return normal, float(normal @ mean)
