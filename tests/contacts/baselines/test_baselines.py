"""Baselines carry a demonstrated place by proportion, or by registration."""

import sys

import numpy as np
import pytest

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.transfer import transfer
from drake_aerial.errors import InputError
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn
from tests.contacts.box_scans import box_cloud

SIZE = np.array([0.6, 0.4, 0.25])
SITE = np.array([0.2, 0.1, 0.125])


@pytest.fixture(scope="module")
def skill():
    return learn(Demonstration.make(box_cloud(SIZE, seed=1), [SITE], name="box"))


def nearest_image(p, site):
    """Return the distance of p from a place or one of its mirror images."""
    images = site * np.array([[a, b, 1] for a in (-1, 1) for b in (-1, 1)])
    return np.linalg.norm(images - p, axis=1).min()


@pytest.mark.parametrize("method", ["obb", "registration"])
def test_a_box_of_other_proportions_gets_the_same_proportion(skill, method):
    size = np.array([0.9, 0.5, 0.2])
    contacts = transfer(skill, box_cloud(size, seed=2), method=method)
    limit = 0.005 if method == "obb" else 0.045
    assert nearest_image(contacts[0].X_SG.p[0], SITE * size / SIZE) < limit
    assert contacts.query is None
    assert contacts[0].feasible


@pytest.mark.parametrize("method", ["obb", "registration"])
def test_every_gripper_of_a_formation_is_carried(method):
    corners = np.array([[0.2, 0.0, 0.125], [-0.2, 0.1, 0.125], [-0.2, -0.1, 0.125]])
    skill = learn(Demonstration.make(box_cloud(SIZE, seed=1), corners, name="three"))
    size = 1.5 * SIZE
    p = transfer(skill, box_cloud(size, seed=2), method=method)[0].X_SG.p
    ours, shown = (np.linalg.norm(q - np.roll(q, 1, axis=0), axis=1) for q in (p, 1.5 * corners))
    np.testing.assert_allclose(ours, shown, atol=0.005 if method == "obb" else 0.06)


def test_the_quarter_turn_that_fits_best_comes_first():
    # An L is carried onto itself, turned by 90 degrees.
    rng = np.random.default_rng(0)
    points = np.vstack(
        [
            rng.uniform([0, 0, 0], [0.6, 0.2, 0.2], (6000, 3)),
            rng.uniform([0, 0, 0], [0.2, 0.45, 0.2], (5000, 3)),
        ]
    )
    top = points * [1, 1, 0] + [0, 0, 0.2]
    skill = learn(Demonstration.make(PointCloud.read(top), [[0.1, 0.4, 0.2]], name="L"))
    turned = PointCloud.read(top[:, [1, 0, 2]] * [-1, 1, 1])
    p = transfer(skill, turned, method="obb")[0].X_SG.p[0]
    np.testing.assert_allclose(p, [-0.4, 0.1, 0.2], atol=0.01)


@pytest.mark.parametrize("method", ["obb", "registration"])
def test_the_same_input_gives_the_same_bytes(skill, method):
    cloud = box_cloud([0.5, 0.4, 0.3], seed=3)
    first, second = (transfer(skill, cloud, method=method) for _ in "ab")
    assert [s.to_dict() for s in first.solutions] == [s.to_dict() for s in second.solutions]


def test_a_missing_library_is_named(skill, monkeypatch):
    monkeypatch.setitem(sys.modules, "biocpd", None)
    with pytest.raises(InputError, match="pip install biocpd"):
        transfer(skill, box_cloud(SIZE, seed=3), method="registration")
