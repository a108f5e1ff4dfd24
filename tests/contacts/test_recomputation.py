"""Recomputed densities are those of the transfer, and are refused for other inputs."""

from dataclasses import replace

import numpy as np
import pytest

from drake_aerial.contacts.recomputation import recompute_query
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.contacts.transfer import transfer
from tests.contacts.box_scans import box_cloud
from tests.contacts.formations import FAST, learnt_skill

CLOUD = box_cloud([0.68, 0.68, 0.28], seed=1, noise=0.0005)


@pytest.fixture(scope="module")
def solutions(tmp_path_factory):
    """Return solutions of parameters that are not the default, read from their file."""
    path = tmp_path_factory.mktemp("recomputation") / "contacts.json"
    transfer(learnt_skill(1), CLOUD, top=3, seed=6, parameters=FAST).write(path)
    return ContactSolutions.read(path)


def test_densities_of_a_file_have_its_parameters_and_its_likelihoods(solutions):
    query = recompute_query(solutions, learnt_skill(1), CLOUD)
    log_j = [solution.log_likelihood for solution in solutions.solutions]
    np.testing.assert_allclose(query.log_likelihood(solutions.X_SG), log_j, atol=1e-9)
    assert len(query.likelihood.queries[0].candidates.p) == FAST.candidates
    assert query.chains is None


@pytest.mark.parametrize(
    "other",
    [
        {"parameters": None},
        {"seed": 7},
        {"method": "control"},
        {"method": "centroid"},
        {"method": "unknown"},
        {"solutions": ()},
    ],
    ids=str,
)
def test_solutions_that_say_otherwise_have_no_densities(solutions, other):
    assert recompute_query(replace(solutions, **other), learnt_skill(1), CLOUD) is None


def test_another_scan_or_number_of_grippers_has_no_densities(solutions):
    assert recompute_query(solutions, learnt_skill(1), box_cloud([0.68, 0.68, 0.28])) is None
    assert recompute_query(solutions, learnt_skill(3), CLOUD) is None
