"""Lens distortion by the models of ROS and OpenCV, and its inverse."""

from __future__ import annotations

import numpy as np

from drake_aerial.geometry import Array

# Numbers of coefficients by model, with the names that ROS gives them.
MODELS = {"plumb_bob": (4, 5), "rational_polynomial": (8,), "equidistant": (4,)}
_ITERATIONS, _TOLERANCE = 100, 1e-9


def distort(model: str, coefficients: tuple[float, ...], rays: Array) -> Array:
    """Return the distorted x/z and y/z (..., 2) of rays x/z, y/z (..., 2).

    Parameters
    ----------
    model : str
        `plumb_bob` (k1 k2 p1 p2, k3), `rational_polynomial` (also k4 k5 k6) or `equidistant`
        (k1 k2 k3 k4).
    coefficients : tuple of float
        Its coefficients.
    rays : (..., 2) array
        Rays without distortion.
    """
    if model == "equidistant":
        radius = np.linalg.norm(rays, axis=-1, keepdims=True)
        angle = np.arctan(radius)
        square = angle**2
        k1, k2, k3, k4 = coefficients
        bent = angle * (1.0 + square * (k1 + square * (k2 + square * (k3 + square * k4))))
        return rays * np.where(radius > 1e-12, bent / np.maximum(radius, 1e-12), 1.0)
    radial, tangential = _radial_tangential(coefficients, rays)
    return rays * radial + tangential


def undistort(model: str, coefficients: tuple[float, ...], distorted: Array) -> Array:
    """Return the rays x/z, y/z (..., 2) that `distort` maps to `distorted`; NaN if there is none.

    The inverse is found by fixed-point iteration; it exists near the image's centre only.
    """
    with np.errstate(all="ignore"):
        rays = distorted.copy()
        for _ in range(_ITERATIONS):
            if model == "equidistant":
                error = distorted - distort(model, coefficients, rays)
                # In the angle the map is nearly linear, in the radius it is not.
                rays = rays + error * (1.0 + np.sum(rays**2, axis=-1, keepdims=True))
            else:
                radial, tangential = _radial_tangential(coefficients, rays)
                rays = (distorted - tangential) / radial
            error = np.abs(distort(model, coefficients, rays) - distorted).max(axis=-1)
            if not (error > _TOLERANCE).any():
                break
        rays[~(error <= 1e-6)] = np.nan
    return rays


def _radial_tangential(coefficients: tuple[float, ...], rays: Array) -> tuple[Array, Array]:
    """Return the radial factors (..., 1) and tangential offsets (..., 2) of rays (..., 2)."""
    k1, k2, p1, p2, k3, k4, k5, k6 = (*coefficients, 0.0, 0.0, 0.0, 0.0)[:8]
    x, y = rays[..., :1], rays[..., 1:]
    square = x**2 + y**2
    radial = 1.0 + square * (k1 + square * (k2 + square * k3))
    radial = radial / (1.0 + square * (k4 + square * (k5 + square * k6)))
    tangential = np.concatenate(
        [
            2.0 * p1 * x * y + p2 * (square + 2.0 * x**2),
            p1 * (square + 2.0 * y**2) + 2.0 * p2 * x * y,
        ],
        axis=-1,
    )
    return radial, tangential
