"""The trust of real transfers: right and wrong skills, frames, and files without trust."""

import json

import numpy as np
import pytest

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.canonical_scan import CanonicalScan
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.contacts.trust.evidence import gather_evidence
from drake_aerial.geometry import Pose, invert, quat_about_axis, transform
from drake_aerial.skill.learn import learn
from tests.contacts.box_scans import box_cloud, box_demonstration

TAUGHT, ASKED = (0.6, 0.42, 0.25), (0.75, 0.5, 0.3)


@pytest.fixture(scope="module")
def skill():
    return learn(box_demonstration(TAUGHT, (0.5, 0.0)))


def evidence_at(skill, cloud, places):
    """Return the evidence of contacts at places (K, 3) in the cloud's frame, upright grippers."""
    scan = CanonicalScan.of_cloud(cloud, skill.parameters.features)
    p = np.asarray(places, float)[:, None]
    X_SG = Pose(p, np.tile([1.0, 0.0, 0.0, 0.0], (len(p), 1, 1)))
    return gather_evidence(
        skill, scan, invert(scan.X_SN) @ X_SG, np.zeros(len(p)), TransferParameters()
    )


def test_evidence_prefers_the_demonstrated_place(skill):
    right, mirrored, wrong = evidence_at(
        skill, box_cloud(ASKED), [[0.1875, 0, 0.15], [-0.1875, 0, 0.15], [0.0, 0.15, 0.15]]
    )
    for good in (right, mirrored):
        assert good.box_distance < 0.03
        assert good.whole < 0.02
        assert good.counterparts > 0.6
    assert wrong.box_distance > 0.2
    assert wrong.whole > right.whole + 0.003
    assert wrong.better_elsewhere > 0.0 > right.better_elsewhere - 0.003


def test_evidence_follows_the_scan_under_yaw_and_translation(skill):
    place = np.array([[0.1, 0.05, 0.15]])
    cloud = box_cloud(ASKED, seed=3)
    X = Pose(np.array([2.0, -1.0, 0.5]), quat_about_axis(np.array([0.0, 0.0, 1.0]), 1.1))
    moved = PointCloud.read(transform(X, cloud.points))
    first, again = (
        evidence_at(skill, c, p)[0].to_dict()
        for c, p in ((cloud, place), (moved, transform(X, place)))
    )
    assert again == pytest.approx(first, abs=1e-3)


def test_a_view_from_above_is_compared_by_what_it_shows(skill):
    (evidence,) = evidence_at(skill, box_cloud(ASKED, view="top"), [[0.1875, 0.0, 0.15]])
    assert evidence.whole < 0.02
    assert evidence.box_distance < 0.03
    assert abs(evidence.height) < 0.02


def test_solutions_of_earlier_files_have_no_trust_and_are_not_refused(tmp_path):
    solution = {
        "rank": 1, "log_likelihood": 1.0, "feasible": True, "reasons": [],
        "grippers": [{"position": [0, 0, 0], "quaternion_wxyz": [1, 0, 0, 0],
                      "normal": [0, 0, 1]}],
        "quadrotors": [{"position": [0, 0, 1], "quaternion_wxyz": [1, 0, 0, 0]}],
    }  # fmt: skip
    document = {
        "schema": "drake_aerial/contacts", "version": 1, "method": "task", "seed": 0,
        "skill": "flat", "cloud": {}, "timing": {}, "solutions": [solution],
    }  # fmt: skip
    path = tmp_path / "contacts.json"
    path.write_text(json.dumps(document))
    contacts = ContactSolutions.read(path)
    assert contacts[0].trust is None
    assert contacts.is_trusted
    solution["trust"] = {"probability": 0.3, "for": [], "against": ["so far away"]}
    path.write_text(json.dumps(document))
    contacts = ContactSolutions.read(path)
    assert contacts[0].trust.speaks_against == ("so far away",)
    assert not contacts.is_trusted
