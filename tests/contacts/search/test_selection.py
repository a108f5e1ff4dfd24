"""Which solutions are distinct, and which grippers are interchangeable."""

import numpy as np

from drake_aerial.contacts.search.selection import distinct
from drake_aerial.geometry import Pose


def test_distinct_solutions_are_apart_and_ranked():
    p = np.array(
        [[[0, 0, 0]], [[0.001, 0, 0]], [[0.02, 0, 0]], [[0.021, 0, 0]], [[0.5, 0, 0]]], float
    )
    X = Pose(p, np.tile([1.0, 0, 0, 0], (5, 1, 1)))
    log_j = np.array([1.0, 3.0, 2.0, 2.5, 0.0])
    assert distinct(X, log_j, 5, 0.005).tolist() == [1, 3, 4]
    assert distinct(X, log_j, 2, 0.005).tolist() == [1, 3]


def test_equal_grippers_are_interchangeable():
    p = np.array([[[0, 0, 0], [1, 0, 0]], [[1, 0, 0], [0, 0, 0]], [[0, 0, 0], [1.1, 0, 0]]], float)
    X = Pose(p, np.tile([1.0, 0, 0, 0], (3, 2, 1)))
    assert distinct(X, np.array([3.0, 2.0, 1.0]), 5, 0.005).tolist() == [0, 2]


def test_grippers_are_paired_so_that_the_worst_pair_is_near():
    # Pairing nearest first leaves 6 mm for the other pair; crosswise both are 4 mm.
    a = np.array([[0.0, 0.0, 0.0], [0.004, 0.0, 0.0]])
    b = np.array([[0.0, 0.0, 0.0], [-0.0005, np.sqrt(15.75e-6), 0.0]])
    X = Pose(np.stack([a, b]), np.tile([1.0, 0, 0, 0], (2, 2, 1)))
    assert distinct(X, np.array([1.0, 0.0]), 5, 0.005).tolist() == [0]


def test_grippers_on_unequal_cables_are_not_interchangeable():
    p = np.array([[0.3, 0.0, 0.0], [-0.3, 0.0, 0.0]])
    X = Pose(np.stack([p, p[::-1]]), np.tile([1.0, 0, 0, 0], (2, 2, 1)))
    log_j = np.array([1.0, 0.0])
    assert distinct(X, log_j, 5, 0.005, np.array([0.5, 0.5])).tolist() == [0]
    assert distinct(X, log_j, 5, 0.005, np.array([0.5, 0.8])).tolist() == [0, 1]
