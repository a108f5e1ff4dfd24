"""The baseline's objective at its own contacts and at another method's."""

from dataclasses import replace

import numpy as np
import pytest

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.transfer import transfer
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn
from drake_aerial.study.analysis.own_likelihood import own_likelihood
from tests.contacts.box_scans import box_cloud

CLOUD = box_cloud([0.6, 0.5, 0.3])
# Not the default ones: the objective must have the parameters of the transfer.
FEW = TransferParameters(paper_candidates=3000, kernels=400, candidates=2000, starts=100, steps=150)


@pytest.fixture(scope="module")
def skill():
    return learn(Demonstration.read("flat"))


@pytest.fixture(scope="module")
def baseline(skill):
    return transfer(skill, CLOUD, method="kopicki", top=3, seed=4, parameters=FEW)


@pytest.fixture(scope="module")
def ours(skill):
    return transfer(skill, CLOUD, method="task", top=3, seed=4, parameters=FEW)


def test_the_objective_is_that_of_the_transfer_with_its_parameters(skill, baseline):
    result = own_likelihood("A", skill, CLOUD, baseline, baseline, 3)
    assert result.note == ""
    assert result.own == tuple(s.log_likelihood for s in baseline.solutions)
    assert result.rival == pytest.approx(max(result.own), abs=1e-6)


def test_only_as_many_solutions_as_wanted_are_compared(skill, baseline, ours):
    result = own_likelihood("A", skill, CLOUD, baseline, ours, 1)
    assert result.own == (baseline[0].log_likelihood,)
    of_all = baseline.query.log_likelihood(ours.X_SG)
    assert result.rival == pytest.approx(of_all[0], abs=1e-9)
    # The baseline's best is what annealing found under this very objective.
    assert result.rival < result.own[0] + 1.0


def test_another_scan_is_noticed(skill, baseline, ours):
    result = own_likelihood("A", skill, PointCloud.read(1.1 * CLOUD.points), baseline, ours, 3)
    assert result.rival is None
    assert "not those of the transfer" in result.note


def test_methods_that_found_nothing_are_said_so(skill, baseline, ours):
    for a, b in ((replace(baseline, solutions=()), ours), (baseline, replace(ours, solutions=()))):
        result = own_likelihood("A", skill, CLOUD, a, b, 3)
        assert (result.rival, result.note) == (None, "one of the methods found nothing")


def test_an_objective_that_cannot_be_built_is_said_so(skill, baseline, ours):
    # A vertical wall has no extent seen from above.
    rng = np.random.default_rng(0)
    wall = rng.uniform(-0.3, 0.3, (5000, 3)) * [1.0, 0.0, 1.0]
    result = own_likelihood("A", skill, PointCloud.read(wall), baseline, ours, 3)
    assert result.rival is None
    assert result.note.startswith("the baseline's objective cannot be built: ")
