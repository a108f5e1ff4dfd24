"""The densities of a transfer: those of its seed, with the same candidates for all methods."""

import numpy as np
import pytest

from drake_aerial.contacts.canonical_scan import CanonicalScan
from drake_aerial.contacts.prepare_query import prepare_query, random_streams
from drake_aerial.contacts.transfer import transfer
from tests.contacts.box_scans import box_cloud
from tests.contacts.formations import FAST, learnt_skill

CLOUD = box_cloud([0.68, 0.68, 0.28], seed=1, noise=0.0005)


def prepared(method, n=1, seed=4):
    skill = learnt_skill(n)
    scan = CanonicalScan.of_cloud(CLOUD, skill.parameters.features)
    return prepare_query(skill, scan, method, FAST, seed)


@pytest.mark.parametrize("n", [1, 3])
@pytest.mark.parametrize("method", ["task", "paper"])
def test_a_transfer_searches_the_densities_of_its_seed(method, n):
    solutions = transfer(learnt_skill(n), CLOUD, method=method, top=3, seed=4, parameters=FAST)
    log_j = [solution.log_likelihood for solution in solutions.solutions]
    again = prepared(method, n).log_likelihood(solutions.X_SG)
    np.testing.assert_allclose(again, log_j, atol=1e-9)
    other = prepared(method, n, seed=5).log_likelihood(solutions.X_SG)
    assert np.abs(other - log_j).min() > 1e-3


def test_methods_that_differ_in_their_votes_draw_the_same_candidates():
    task, control = prepared("task", 3), prepared("control", 3)
    for a, b in zip(task.likelihood.queries, control.likelihood.queries, strict=True):
        np.testing.assert_array_equal(a.candidates.p, b.candidates.p)
        np.testing.assert_array_equal(a.log_candidates, b.log_candidates)
    assert (task.likelihood.votes is None, control.likelihood.votes is None) == (False, True)


def test_streams_of_a_seed_are_three_and_differ():
    draws = [rng.random() for rng in random_streams(7)]
    assert len(set(draws)) == 3
    assert draws == [rng.random() for rng in random_streams(7)]
