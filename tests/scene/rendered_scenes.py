"""Scenes of boxes, cylinders and planes, cast ray by ray, with the true label of each pixel.

World W: z up. The camera frame C has x right, y down, z forward.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from drake_aerial import DepthCamera, PointCloud, read_depth_image

NOTHING, SUPPORT, FIRST = 0, 1, 2
CAMERA = DepthCamera(320, 240, fx=262.5, fy=262.5, cx=159.5, cy=119.5)


@dataclass(frozen=True)
class Solid:
    """A box or an upright cylinder: `R` (3, 3) and `center` (3,) place it, `size` (3,) is whole."""

    kind: str
    label: int
    center: np.ndarray
    R: np.ndarray
    size: np.ndarray

    def depth(self, origin: np.ndarray, rays: np.ndarray) -> np.ndarray:
        """Return the ray parameter of the first hit, infinite where the ray misses."""
        o = self.R.T @ (origin - self.center)
        d = rays @ self.R
        half = 0.5 * self.size
        with np.errstate(divide="ignore", invalid="ignore"):
            slabs = [
                np.sort([(-half[k] - o[k]) / d[..., k], (half[k] - o[k]) / d[..., k]], axis=0)
                for k in range(3)
            ]
            if self.kind == "cylinder":
                a = (d[..., :2] ** 2).sum(-1)
                b = d[..., :2] @ o[:2]
                c = o[:2] @ o[:2] - half[0] ** 2
                root = np.sqrt(np.where(b * b >= a * c, b * b - a * c, np.nan))
                slabs = [np.array([(-b - root) / a, (-b + root) / a]), slabs[2]]
            enter = np.max([slab[0] for slab in slabs], axis=0)
            leave = np.min([slab[1] for slab in slabs], axis=0)
        hit = (enter < leave) & (enter > 1e-6)
        return np.where(hit, enter, np.inf)


def turned(yaw: float, tilt: float = 0.0) -> np.ndarray:
    """Return the rotation by a yaw, after a tilt about x [rad]."""
    c, s, ct, st = np.cos(yaw), np.sin(yaw), np.cos(tilt), np.sin(tilt)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]) @ np.array(
        [[1.0, 0, 0], [0, ct, -st], [0, st, ct]]
    )


def box(label, at, size, yaw=0.0, bottom=0.0, tilt=0.0) -> Solid:
    """Return a box with its bottom's centre over `at` (2,)."""
    size = np.asarray(size, float)
    return Solid("box", label, np.array([*at, bottom + 0.5 * size[2]]), turned(yaw, tilt), size)


def cylinder(label, at, diameter, height, bottom=0.0) -> Solid:
    """Return an upright cylinder with its bottom's centre over `at` (2,)."""
    size = np.array([diameter, diameter, height])
    return Solid("cylinder", label, np.array([*at, bottom + 0.5 * height]), np.eye(3), size)


def tray(label, at, size, wall=0.01, yaw=0.0, bottom=0.0) -> list[Solid]:
    """Return an open tray: a floor and four walls."""
    x, y, z = size
    R = turned(yaw)
    parts = [([0, 0], [x, y, wall])]
    parts += [([s * (x - wall) / 2, 0], [wall, y, z]) for s in (-1, 1)]
    parts += [([0, s * (y - wall) / 2], [x, wall, z]) for s in (-1, 1)]
    return [box(label, np.asarray(at) + (R @ [*p, 0.0])[:2], q, yaw, bottom) for p, q in parts]


def floor(size=6.0, height=0.0, at=(0.0, 0.0), label=SUPPORT) -> Solid:
    """Return the floor, or a table top of 3 cm, with its surface at a height [m]."""
    size = (size, size) if np.isscalar(size) else size
    return box(label, at, [*size, 0.03], bottom=height - 0.03)


def wall(at, yaw=0.0, width=6.0, height=3.0) -> Solid:
    """Return a wall across x."""
    return box(NOTHING, at, [0.05, width, height], yaw=yaw)


def camera_pose(target, distance, pitch_deg, azimuth=0.0, roll_deg=0.0):
    """Return R_WC and p_WC of a camera that looks at a target from above."""
    pitch = np.deg2rad(pitch_deg)
    forward = np.array(
        [np.cos(azimuth) * np.cos(pitch), np.sin(azimuth) * np.cos(pitch), -np.sin(pitch)]
    )
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
    down = np.cross(forward, right)
    roll = np.deg2rad(roll_deg)
    right, down = (
        np.cos(roll) * right + np.sin(roll) * down,
        np.cos(roll) * down - np.sin(roll) * right,
    )
    return np.stack([right, down, forward], axis=1), np.asarray(target, float) - distance * forward


class RenderedScene:
    """One depth image of solids: `depth` (H, W) [m], `labels` (H, W), `up_C` (3,)."""

    def __init__(self, solids, R_WC, p_WC, camera=CAMERA, farthest=6.0):
        self.camera, self.R_WC, self.p_WC = camera, R_WC, p_WC
        rays_C = np.dstack([camera.rays(), np.ones((camera.height, camera.width))])
        rays = rays_C @ R_WC.T
        self.depth = np.full(rays.shape[:2], np.inf)
        self.labels = np.zeros(rays.shape[:2], int)
        for solid in solids:
            found = solid.depth(p_WC, rays)
            nearer = found < self.depth
            self.depth[nearer], self.labels[nearer] = found[nearer], solid.label
        self.labels[self.depth > farthest] = NOTHING
        self.depth[self.depth > farthest] = 0.0
        self.up_C = R_WC.T @ [0.0, 0.0, 1.0]

    def noisy(self, rng, inverse_sigma=0.0015, quantum=0.00285, dropout=0.01):
        """Return the depth image of a camera whose noise grows with the square of depth."""
        seen = self.depth > 0.0
        white = gaussian_filter(rng.standard_normal(self.depth.shape), 1.0)
        inverse = 1.0 / np.where(seen, self.depth, 1.0) + inverse_sigma * white / white.std()
        inverse = quantum * np.round(inverse / quantum) if quantum else inverse
        lost = ~seen | (rng.random(seen.shape) < dropout)
        return np.where(lost, 0.0, 1.0 / inverse)

    def cloud(self, rng=None, up=None) -> PointCloud:
        """Return the cloud of the depth image, with noise if `rng` is given."""
        depth = self.depth if rng is None else self.noisy(rng)
        return read_depth_image(depth, self.camera, up=up)

    def overlap(self, found, label: int) -> float:
        """Return the largest intersection over union of a found object with a true one."""
        true = self.labels == label
        numbers = [n for n in np.unique(found[true]) if n >= FIRST]
        return max(
            (np.sum((found == n) & true) / np.sum((found == n) | true) for n in numbers),
            default=0.0,
        )
