"""Annealing finds the maximum of a known function, from many starts, reproducibly."""

import numpy as np

from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.search.annealing import anneal
from drake_aerial.geometry import Pose, axis_of, identity, quat_exp

FEW = TransferParameters(starts=200, chains=50, steps=400)


def two_hills(X):
    """A broad hill at x = 0.3 and a higher one at x = -0.3, both best with the axis up."""
    x = X.p[:, 0] - np.array([[0.3, 0, 0]])
    y = X.p[:, 0] - np.array([[-0.3, 0, 0]])
    hills = np.logaddexp(-np.sum(x**2, -1) / 0.02, 1.0 - np.sum(y**2, -1) / 0.02)
    return hills + 10.0 * (axis_of(X.q[:, 0], 2)[:, 2] - 1.0)


def starts(rng, n=200):
    return Pose(rng.uniform(-0.5, 0.5, (n, 1, 3)), quat_exp(0.5 * rng.standard_normal((n, 1, 3))))


def test_finds_the_higher_hill():
    best, value = anneal(two_hills, starts(np.random.default_rng(0)), FEW, np.random.default_rng(1))
    assert len(value) == 50
    assert np.all(np.diff(value) <= 0.0)
    np.testing.assert_allclose(best.p[0, 0], [-0.3, 0.0, 0.0], atol=0.015)
    assert axis_of(best.q[0, 0], 2)[2] > 0.999
    assert value[0] == two_hills(best)[0]


def test_never_returns_worse_than_its_starts():
    begin = starts(np.random.default_rng(2), n=10)
    _, value = anneal(two_hills, begin, FEW, np.random.default_rng(3))
    assert value.min() >= two_hills(begin).min()
    assert value.max() >= two_hills(begin).max()


def test_same_generator_same_result():
    runs = [
        anneal(two_hills, starts(np.random.default_rng(4)), FEW, np.random.default_rng(5))
        for _ in "ab"
    ]
    np.testing.assert_array_equal(runs[0][0].p, runs[1][0].p)
    np.testing.assert_allclose(np.linalg.norm(runs[0][0].q, axis=-1), 1.0, atol=1e-12)


def test_moves_formations_and_their_grippers():
    # The maximum is a triangle around (0.5, 0, 0); the chains start at a larger one elsewhere.
    corners = 0.2 * np.array([[1, 0, 0], [-0.5, 0.866, 0], [-0.5, -0.866, 0]])

    def likelihood(X):
        return -np.sum((X.p - corners - [0.5, 0, 0]) ** 2, axis=(-1, -2)) / 0.001

    begin = identity(40, 3)
    begin = Pose(begin.p + 1.2 * corners + [0.2, 0.1, 0.0], begin.q)
    best, _ = anneal(likelihood, begin, FEW, np.random.default_rng(6))
    np.testing.assert_allclose(best.p[0], corners + [0.5, 0, 0], atol=0.01)
