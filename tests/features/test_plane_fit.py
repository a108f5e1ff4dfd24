"""Planes fitted to balls, against a singular value decomposition per point."""

import numpy as np
from scipy.spatial import cKDTree

from drake_aerial.features.plane_fit import fit_planes


def test_normals_are_the_directions_of_least_spread():
    rng = np.random.default_rng(0)
    u = rng.uniform(-0.3, 0.3, (3000, 2))
    points = np.column_stack([u, 0.5 * u[:, 0] ** 2 - 0.2 * u[:, 0] * u[:, 1]]) + [20.0, -30.0, 1.0]
    _, normals, _ = fit_planes(points, 0.04, 6)
    for k, near in enumerate(cKDTree(points).query_ball_point(points[:300], 0.04)):
        part = points[near] - points[near].mean(axis=0)
        wanted = np.linalg.svd(part)[2][2]
        assert np.linalg.norm(np.cross(wanted, normals[k])) < 1e-9


def test_points_are_left_out_until_all_have_enough_neighbours():
    # A chain of points hangs on a patch. Each link has two neighbours, the last one has one.
    rng = np.random.default_rng(1)
    patch = np.column_stack([rng.uniform(0.0, 0.2, (2000, 2)), np.zeros(2000)])
    chain = np.column_stack([0.2 + 0.025 * np.arange(1, 12), np.full(11, 0.1), np.zeros(11)])
    balls, normals, kept = fit_planes(np.concatenate([patch, chain]), 0.03, 4)
    assert len(normals) == len(balls.points) <= 2001
    counts = cKDTree(balls.points).query_ball_point(balls.points, 0.03, return_length=True)
    assert counts.min() >= 4
    np.testing.assert_array_equal(balls.points[:2000], patch)
    np.testing.assert_array_equal(balls.points, np.concatenate([patch, chain])[kept])


def test_nothing_is_left_of_a_sparse_cloud():
    assert fit_planes(np.random.default_rng(2).uniform(-1.0, 1.0, (50, 3)), 0.03, 6) is None
    chain = np.column_stack([0.025 * np.arange(40), np.zeros((40, 2))])
    assert fit_planes(chain, 0.03, 4) is None
