"""Ball neighbourhoods against a k-d tree and plain sums."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from drake_aerial.features import neighbourhoods
from drake_aerial.features.neighbourhoods import BallNeighbourhoods

RADIUS = 0.03


def flat(rng):
    return np.column_stack([rng.uniform(0.0, 0.4, (4000, 2)), np.zeros(4000)])


def scattered(rng):
    return np.concatenate([flat(rng), rng.uniform(-1.0, 1.0, (300, 3))])


def crowded(rng):
    return np.concatenate([rng.normal(0.0, 0.004, (900, 3)), [[0.3, 0.0, 0.0], [0.0, -30.0, 7.0]]])


def line(rng):
    return np.column_stack([np.linspace(0.0, 3.0, 500), np.zeros((500, 2))])


CLOUDS = {"flat": flat, "scattered": scattered, "crowded": crowded, "line": line}


def pairs(points, radius):
    """Return the pairs (i, j) that are neighbours, sorted, and whether each point came up once."""
    found, seen = [], np.zeros(len(points), int)

    def collect(batch):
        np.add.at(seen, batch.points, 1)
        for tile, row in np.argwhere(batch.used):
            near = batch.candidates[tile][batch.inside[tile, row]]
            found.append(np.column_stack([np.full(len(near), batch.rows[tile, row]), near]))

    BallNeighbourhoods(points, radius).for_each(collect)
    table = np.concatenate(found)
    return table[np.lexsort(table.T[::-1])], seen


@pytest.mark.parametrize("cloud", CLOUDS)
def test_neighbours_are_those_of_a_tree(cloud):
    points = CLOUDS[cloud](np.random.default_rng(0))
    found, seen = pairs(points, RADIUS)
    np.testing.assert_array_equal(seen, 1)
    half = cKDTree(points).query_pairs(RADIUS, output_type="ndarray")
    itself = np.arange(len(points))
    wanted = np.concatenate([half, half[:, ::-1], np.column_stack([itself, itself])])
    np.testing.assert_array_equal(found, wanted[np.lexsort(wanted.T[::-1])])


@pytest.mark.parametrize("radius", [1e-4, 10.0])
def test_a_radius_of_another_order_than_the_cloud(radius):
    points = flat(np.random.default_rng(1))[:600]
    found, seen = pairs(points, radius)
    np.testing.assert_array_equal(seen, 1)
    assert len(found) == cKDTree(points).query_ball_point(points, radius, return_length=True).sum()


def test_far_from_the_origin_and_of_repeated_points():
    rng = np.random.default_rng(2)
    points = np.repeat(flat(rng)[:500], 3, axis=0) + [40.0, -40.0, 3.0]
    found, _ = pairs(points, RADIUS)
    assert len(found) == cKDTree(points).query_ball_point(points, RADIUS, return_length=True).sum()


def test_sums_are_those_over_the_neighbours():
    rng = np.random.default_rng(3)
    points, values = scattered(rng), rng.standard_normal((2, 4300))
    sums = np.full((len(points), 2), np.nan)
    balls = BallNeighbourhoods(points, RADIUS)

    def add(batch):
        sums[batch.points] = batch.sums(values[:, batch.candidates])

    balls.for_each(add)
    wanted = [
        values[:, near].sum(axis=1) for near in cKDTree(points).query_ball_point(points, RADIUS)
    ]
    np.testing.assert_allclose(sums, wanted, rtol=0.0, atol=1e-12)


def test_positions_are_those_of_the_points_from_one_origin():
    points = scattered(np.random.default_rng(4))

    def check(batch):
        origin = points[batch.rows[:, 0]]
        np.testing.assert_allclose(
            batch.p_row, (points[batch.rows] - origin[:, None]).transpose(2, 0, 1), atol=1e-15
        )
        wanted = (points[batch.candidates] - origin[:, None]).transpose(2, 0, 1)
        np.testing.assert_allclose(batch.p_candidate, wanted, atol=1e-15)

    BallNeighbourhoods(points, RADIUS).for_each(check)


def test_a_batch_s_memory_is_bounded(monkeypatch):
    monkeypatch.setattr(neighbourhoods, "_PAIRS", 2000)
    sizes = []
    # A cube of which everything is everybody's neighbour.
    points = np.random.default_rng(5).uniform(0.0, 0.01, (1500, 3))
    BallNeighbourhoods(points, RADIUS).for_each(lambda batch: sizes.append(batch.inside.size))
    assert max(sizes) <= 8 * 1500  # the fewest rows of a tile
