"""The plane around each pixel, from the one of several windows that fits best.

Planes are linear in inverse depth: n . p = h for points p = z (x, y, 1) on the rays (x, y, 1) gives
1 / z = (n / h) . (x, y, 1). Inverse depth of stereo and structured light cameras has the same noise
everywhere. Least squares over windows are box filters (as integral images: Holzer et al., 2012). Of
the windows that contain a pixel, the one with the least residual is taken (as Kuwahara's filter
does), so that planes do not bend over edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_aerial.geometry import Array

# A window must have depths in this share of its pixels.
_MIN_FILLED = 0.4
# Windows off the pixel must fit better than the one around it by this factor of the variance.
_CENTRE_FAVOUR = 0.6
# Least noise, as a share of the value.
_LEAST_NOISE = 2e-4
# Pixels that share their noise, and the deviations from which a bend is not noise.
_CORRELATED, _ANGLE_DEVIATIONS = 5.0, 2.5


@dataclass(frozen=True, eq=False)
class LocalPlanes:
    """The plane around each pixel of an image.

    Attributes
    ----------
    rays : (H, W, 2) array
        x and y of the pixels' rays (x, y, 1), or coordinates [m] in a parallel view.
    value : (H, W) array
        Inverse depths [1/m], or depths [m] in a parallel view; NaN where there is none.
    coefficients : (H, W, 3) array
        (a, b, c) of the plane value = a x + b y + c; NaN where there is none.
    normal : (H, W, 3) array
        Unit normals in the image frame, towards the viewer.
    noise : float
        Standard deviation of `value`.
    perspective : bool
        Whether `value` is an inverse depth.
    angle_noise : float
        Standard deviation of the angle between two normals [rad], in perspective at depth 1 m.
    """

    rays: Array
    value: Array
    coefficients: Array
    normal: Array
    noise: float
    perspective: bool
    angle_noise: float

    def least_angle(self, angle_deg: float) -> Array:
        """Return the least angle [rad] between two normals that is an edge, (H, W).

        Far away, where normals are noisy, it is larger than `angle_deg`.
        """
        noise = np.full(self.value.shape, self.angle_noise)
        if self.perspective:
            noise = noise / np.where(np.isfinite(self.value), self.value, 1.0)
        return np.sqrt(np.deg2rad(angle_deg) ** 2 + (_ANGLE_DEVIATIONS * noise) ** 2)

    def at(self, offset: tuple[int, int]) -> Array:
        """Return the value (H, W) of each pixel's plane at the pixel that is `offset` away."""
        rows, columns = offset
        moved = shifted(self.rays, -rows, -columns)
        return (self.coefficients[..., :2] * moved).sum(axis=-1) + self.coefficients[..., 2]


def shifted(image: NDArray, rows: int, columns: int, fill: float = np.nan) -> NDArray:
    """Return an image whose pixel (v, u) is that at (v - rows, u - columns) of the given one."""
    moved = np.full_like(image, fill)
    height, width = image.shape[:2]
    into = (
        slice(max(rows, 0), height + min(rows, 0)),
        slice(max(columns, 0), width + min(columns, 0)),
    )
    of = (
        slice(max(-rows, 0), height + min(-rows, 0)),
        slice(max(-columns, 0), width + min(-columns, 0)),
    )
    moved[into] = image[of]
    return moved


def fit_local_planes(points_C: Array, *, perspective: bool, radius: int) -> LocalPlanes:
    """Fit a plane around each pixel.

    Parameters
    ----------
    points_C : (H, W, 3) array
        Points in the image frame [m], NaN where there is none.
    perspective : bool
        Whether the rays meet in the origin; else they are parallel to z.
    radius : int
        The windows are 2 radius + 1 pixels wide.
    """
    x, y, z = np.moveaxis(points_C, -1, 0)
    rays, value = (
        (np.stack([x, y], axis=-1) / z[..., None], 1.0 / z)
        if perspective
        else (points_C[..., :2], z)
    )
    coefficients, variance = _fits(rays, value, radius)
    best = np.where(np.isfinite(variance), _CENTRE_FAVOUR * variance, np.inf)
    height, width = value.shape
    pixel = np.arange(height * width).reshape(height, width)
    window = pixel.copy()
    step = max(1, radius - 1)
    for rows in (-step, 0, step):
        for columns in (-step, 0, step):
            other = shifted(variance, rows, columns)
            better = other < best
            best[better] = other[better]
            window[better] = pixel[better] - rows * width - columns
    chosen = coefficients.reshape(-1, 3)[window]
    chosen[~np.isfinite(best) | ~np.isfinite(value)] = np.nan
    normal = chosen.copy() if perspective else np.dstack([chosen[..., :2], -np.ones_like(z)])
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    # The viewer is on the side of negative n . ray.
    toward = (
        (normal[..., :2] * rays).sum(axis=-1) + normal[..., 2] if perspective else normal[..., 2]
    )
    normal *= -np.sign(toward)[..., None]
    finite = best[np.isfinite(best)]
    noise = float(np.sqrt(np.median(finite))) if len(finite) else np.inf
    # Rendered images without noise still have rounding.
    noise = max(noise, _LEAST_NOISE * float(np.nanmedian(value)))
    pitch = float(np.nanmedian(np.abs(np.diff(rays[..., 0], axis=1))))
    across = 2 * radius + 1
    # The noise of neighbouring depths is not independent.
    independent = max(across**2 / _CORRELATED, 1.0)
    slope = noise / (np.sqrt(independent) * max(pitch, 1e-9) * across / np.sqrt(12.0))
    return LocalPlanes(rays, value, chosen, normal, noise, perspective, np.sqrt(2.0) * slope)


def _fits(rays: Array, value: Array, radius: int) -> tuple[Array, Array]:
    """Return the coefficients (H, W, 3) of the windows' planes and the variances (H, W) of fits."""
    import cv2

    seen = np.isfinite(value) & np.isfinite(rays).all(axis=-1)
    width = 2 * radius + 1

    def window_sum(image: Array) -> Array:
        size = (width, width)
        border = cv2.BORDER_CONSTANT
        total = cv2.boxFilter(image, cv2.CV_64F, size, normalize=False, borderType=border)
        return np.asarray(total, dtype=np.float64)

    weight = seen.astype(np.float64)
    x, y = (np.where(seen, rays[..., k], 0.0) for k in range(2))
    w = np.where(seen, value, 0.0)
    count = window_sum(weight)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean_x, mean_y, mean_w = (window_sum(values) / count for values in (x, y, w))
        xx, xy, yy, xw, yw, ww = (
            window_sum(first * second) / count - mean_first * mean_second
            for first, second, mean_first, mean_second in (
                (x, x, mean_x, mean_x),
                (x, y, mean_x, mean_y),
                (y, y, mean_y, mean_y),
                (x, w, mean_x, mean_w),
                (y, w, mean_y, mean_w),
                (w, w, mean_w, mean_w),
            )
        )
        determinant = xx * yy - xy * xy
        a = (yy * xw - xy * yw) / determinant
        b = (xx * yw - xy * xw) / determinant
        variance = np.maximum(ww - a * xw - b * yw, 0.0)
    poor = (count < _MIN_FILLED * width**2) | ~(determinant > 1e-3 * xx * yy)
    coefficients = np.stack([a, b, mean_w - a * mean_x - b * mean_y], axis=-1)
    coefficients[poor] = np.nan
    variance[poor] = np.nan
    return coefficients, variance
