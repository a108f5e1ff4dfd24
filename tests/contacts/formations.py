"""Skills with one to three grippers and their transfers to boxes, for tests of refinement."""

from functools import cache

import numpy as np

from drake_aerial.contacts.feasibility.contact_checker import ContactChecker
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.transfer import transfer
from drake_aerial.geometry import invert
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn
from drake_aerial.skill.parameters import LearningParameters
from tests.contacts.box_scans import box_cloud

SIZE = (0.68, 0.61, 0.28)
FAST = TransferParameters(
    candidates=1500,
    starts=100,
    chains=40,
    steps=120,
    paper_candidates=1500,
    paper_votes=1500,
    kernels=300,
)
CORNERS = {
    1: [[0.0, 0.0, 0.14]],
    2: [[0.2, 0.0, 0.14], [-0.25, 0.0, 0.14]],
    3: [[0.2, 0.0, 0.14], [-0.1, 0.22, 0.14], [-0.1, -0.22, 0.14]],
}
# Cables that lean apart, so that quadrotors move with the formation's yaw.
CABLES = {
    1: [[0.2, 0.1, 1.0]],
    2: [[0.3, 0.1, 1.0], [-0.3, 0.0, 1.0]],
    3: [[0.3, 0, 1], [-0.1, 0.3, 1], [-0.2, -0.3, 1]],
}


@cache
def learnt_skill(n, axial=True, leaning=False):
    cloud = box_cloud(SIZE, seed=100)
    options = {"cable_directions": np.array(CABLES[n], float)} if leaning else {}
    demonstration = Demonstration.make(cloud, np.array(CORNERS[n]), name=f"{n} grippers", **options)
    return learn(demonstration, parameters=LearningParameters(axial=axial))


@cache
def transferred(n, method="task", axial=True, leaning=False):
    cloud = box_cloud([0.68, 0.68, 0.28], seed=1, noise=0.0005)
    return transfer(learnt_skill(n, axial, leaning), cloud, method=method, top=3, parameters=FAST)


def examined(n, X_SG):
    """Return the solution with grippers X_SG on the box, with its likelihood and reasons."""
    checker = ContactChecker(transferred(n).query, TransferParameters())
    return checker.solution(invert(checker.X_SN) @ X_SG)


def kinds(solution):
    """Return the kinds of reasons against a solution."""
    return {reason.kind for reason in solution.reasons}
