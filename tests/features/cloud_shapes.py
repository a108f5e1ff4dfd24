"""Clouds with known geometry."""

import numpy as np


def sphere(radius, count, rng):
    x = rng.standard_normal((count, 3))
    return radius * x / np.linalg.norm(x, axis=1, keepdims=True)


def cylinder(radius, height, count, rng):
    angle, z = rng.uniform(0, 2 * np.pi, count), rng.uniform(-height / 2, height / 2, count)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


def torus(ring, tube, count, rng):
    v = rng.uniform(0, 2 * np.pi, 4 * count)
    v = v[rng.random(4 * count) < (ring + tube * np.cos(v)) / (ring + tube)][:count]
    u = rng.uniform(0, 2 * np.pi, len(v))
    across = ring + tube * np.cos(v)
    return np.stack([across * np.cos(u), across * np.sin(u), tube * np.sin(v)], axis=1)


def plane(size, count, rng):
    xy = rng.uniform(-0.5, 0.5, (count, 2)) * size
    return np.column_stack([xy, np.zeros(count)])


def box(size, count, rng):
    """Points on all six faces, uniform by area."""
    size = np.asarray(size, float)
    areas = np.array([size[1] * size[2], size[2] * size[0], size[0] * size[1]])
    axis = rng.choice(3, count, p=areas / areas.sum())
    points = rng.uniform(-0.5, 0.5, (count, 3)) * size
    points[np.arange(count), axis] = rng.choice([-0.5, 0.5], count) * size[axis]
    return points
