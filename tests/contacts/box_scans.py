"""Scans of boxes for the tests, sampled in NumPy alone, not by the package's samplers."""

import numpy as np

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.skill.demonstration import Demonstration


def box_points(size, spacing, rng, view="full"):
    """Return jittered points on a box centred on the origin: all faces, or the top one."""
    size = np.asarray(size, float)
    points = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        count = np.maximum(np.round(size[[u, v]] / spacing).astype(int), 1)
        for sign in (-1.0, 1.0):
            if view == "top" and (axis, sign) != (2, 1.0):
                continue
            grid = np.stack(
                np.meshgrid(np.arange(count[0]), np.arange(count[1]), indexing="ij"), -1
            )
            grid = grid.reshape(-1, 2) + rng.random((count.prod(), 2))
            face = np.empty((len(grid), 3))
            face[:, [u, v]] = (grid / count - 0.5) * size[[u, v]]
            face[:, axis] = 0.5 * sign * size[axis]
            points.append(face)
    return np.vstack(points)


def box_cloud(size, seed=0, spacing=0.01, view="full", noise=0.0):
    rng = np.random.default_rng(seed)
    points = box_points(size, spacing, rng, view)
    viewpoint = (0.0, 0.0, 3.0) if view == "top" else None
    return PointCloud.read(points + noise * rng.standard_normal(points.shape), viewpoint=viewpoint)


def box_demonstration(size, site=(0.0, 0.0), view="full", **options):
    """Return a demonstration with one gripper on the top face, `site` in half sizes."""
    position = [0.5 * size[0] * site[0], 0.5 * size[1] * site[1], 0.5 * size[2]]
    return Demonstration.make(
        box_cloud(size, seed=100, view=view), [position], name="box", **options
    )
