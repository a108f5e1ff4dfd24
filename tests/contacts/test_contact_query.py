"""The densities of several grippers at the features of a scan, as pictures show them."""

import numpy as np
import pytest

from drake_aerial import read_scan, read_skill, transfer
from drake_aerial.contacts.parameters import TransferParameters


@pytest.fixture(scope="module")
def formation():
    few = TransferParameters(candidates=1500, starts=100, chains=20, steps=120)
    return transfer(read_skill("formation"), read_scan("hollow_triangle"), top=1, parameters=few)


def test_the_heat_of_a_formations_gripper_is_where_it_was_shown(formation):
    # By the triangle's symmetry any corner suits any gripper. Corners are 0.32 m from the middle,
    # at 0, 120 and 240 degrees.
    angle = np.deg2rad([0.0, 120.0, 240.0])
    corners = 0.32 * np.column_stack([np.cos(angle), np.sin(angle)])
    query = formation.query
    for gripper in range(3):
        hottest = query.scan.features_S.p[np.argmax(query.log_surface(gripper))]
        assert np.linalg.norm(corners - hottest[:2], axis=1).min() < 0.05


def test_votes_without_a_gripper_are_for_the_formations_origin(formation):
    # The origin lies in the hole. The nearest surface is the inner side of a beam, 0.11 m away.
    query = formation.query
    hottest = query.scan.features_S.p[np.argmax(query.log_votes())]
    assert np.linalg.norm(hottest[:2]) < 0.16
