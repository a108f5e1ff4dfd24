"""The smooth surface against a sphere and a thin plate."""

import numpy as np
import pytest

from drake_aerial.contacts.refinement.smooth_surface import SmoothSurface
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import (
    axis_of,
    perpendicular,
    quat_from_xz,
)


def sphere_features(radius, count=4000):
    """Exact features of a sphere about the origin, points on a spiral."""
    k = np.arange(count) + 0.5
    z, azimuth = 1.0 - 2.0 * k / count, np.pi * (1.0 + 5.0**0.5) * k
    normal = np.stack(
        [np.cos(azimuth) * np.sqrt(1 - z**2), np.sin(azimuth) * np.sqrt(1 - z**2), z], axis=1
    )
    rho = 0.03
    r = np.full((count, 2), rho / radius)
    frames = quat_from_xz(perpendicular(normal), normal)
    return SurfaceFeatures(radius * normal, frames, r, np.zeros(count), np.zeros(count, bool), rho)


@pytest.mark.parametrize("radius", [0.05, 0.2])
def test_smooth_surface_of_a_sphere(radius):
    features, rng = sphere_features(radius), np.random.default_rng(5)
    spacing = radius * np.sqrt(4.0 * np.pi / 4000)
    for _ in range(20):
        u = rng.standard_normal(3)
        u /= np.linalg.norm(u)
        surface = SmoothSurface(features, radius * u, 0.05, spacing)
        for height in (-0.2 * radius, 0.0, 0.2 * radius):
            foot = surface.footing((radius + height) * u, u)
            assert foot.level == pytest.approx(height, abs=0.02 * spacing + 0.01 * abs(height))
            assert foot.normal @ u > np.cos(0.02)
            np.testing.assert_allclose(foot.level_by_p, u, atol=0.06)
            nearest = np.linalg.norm(features.p - (radius + height) * u, axis=1).min()
            assert nearest <= foot.gap <= nearest + 0.5 * spacing


def test_a_thin_plate_has_two_faces():
    grid = (
        np.stack(np.meshgrid(np.arange(-9, 10), np.arange(-9, 10)), axis=-1).reshape(-1, 2) * 0.008
    )
    top = np.column_stack([grid, np.full(len(grid), 0.002)])
    up, down = np.tile([1.0, 0, 0, 0], (len(grid), 1)), np.tile([0.0, 1, 0, 0], (len(grid), 1))
    n = 2 * len(grid)
    plate = SurfaceFeatures(
        np.vstack([top, top * [1, 1, -1]]),
        np.vstack([up, down]),
        np.zeros((n, 2)),
        np.zeros(n),
        np.zeros(n, bool),
        0.03,
    )
    surface = SmoothSurface(plate, np.zeros(3), 0.05, 0.012)
    z = axis_of(up[0], 2)
    for side in (1.0, -1.0):
        foot = surface.footing(np.array([0.003, 0.001, 0.0]), side * z)
        assert foot.level == pytest.approx(-0.002, abs=5e-5)
        assert foot.normal @ (side * z) > 0.999
