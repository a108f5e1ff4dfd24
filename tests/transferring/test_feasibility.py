"""Reasons against a contact, and statics against hand calculation."""

import numpy as np
import pytest
from box_scans import box_cloud

from drake_aerial.geometry import Pose, quat_from_two_vectors
from drake_aerial.perception.surface_features import compute_features
from drake_aerial.transferring.feasibility import load_shares, reasons_against
from drake_aerial.transferring.local_surface import LocalSurface
from drake_aerial.transferring.parameters import TransferParameters

UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def surface():
    return LocalSurface(compute_features(box_cloud([0.6, 0.4, 0.3])))


def reasons(surface, positions, axes=None, centre=(0.0, 0.0), distance=None, cable=(0.0, 0.0, 0.5)):
    p = np.atleast_2d(np.asarray(positions, float))
    z = np.tile(UP, (len(p), 1)) if axes is None else np.atleast_2d(np.asarray(axes, float))
    X_NG = Pose(p, quat_from_two_vectors(UP, z))
    X_NQ = Pose(p + cable, np.tile([1.0, 0, 0, 0], (len(p), 1)))
    distance = np.zeros(len(p)) if distance is None else np.asarray(distance)
    return reasons_against(X_NG, X_NQ, distance, np.asarray(centre), surface, TransferParameters())


def test_top_of_a_box_is_feasible(surface):
    assert reasons(surface, [0.1, 0.05, 0.15]) == ()


def test_upside_down(surface):
    assert "upside down" in reasons(surface, [0, 0, -0.15], axes=[0, 0, -1])[0]
    # The middle of a side face.
    assert "upside down" in reasons(surface, [0.3, 0, 0], axes=[1, 0, 0])[0]


def test_cable_through_the_payload(surface):
    assert reasons(surface, [0, 0, -0.15]) == ("cable through the payload",)
    leaning = reasons(surface, [0.2, 0, 0.15], cable=(-0.4, 0.0, -0.2))
    assert leaning == ("cable through the payload",)


def test_off_the_surface(surface):
    found = reasons(surface, [0, 0, 0.2], distance=[0.05])
    assert found == ("off the surface (nearest point 5.0 cm away)",)


def test_quadrotors_too_close(surface):
    found = reasons(surface, [[-0.1, 0, 0.15], [0.1, 0, 0.15]])
    assert found == ("quadrotors 1 and 2 too close (0.20 m, at least 0.35 m)",)


def test_no_taut_equilibrium(surface):
    line = [[-0.25, 0, 0.15], [0.15, 0, 0.15]]
    assert reasons(surface, line) == ()
    assert "no positive-tension equilibrium" in reasons(surface, line, centre=(0.2, 0.0))[0]


def test_load_shares_of_two_cables_follow_the_lever_rule():
    p = np.array([[-0.1, 0, 0], [0.3, 0, 0.0]])
    np.testing.assert_allclose(load_shares(p, p + UP, np.zeros(2)), [0.75, 0.25], atol=1e-9)
    # Beside the line the payload swings below it.
    np.testing.assert_allclose(load_shares(p, p + UP, np.array([0.0, 0.05])), [0.75, 0.25], atol=1e-9)
    assert load_shares(p, p + UP, np.array([0.4, 0.0])) is None


def test_load_shares_of_three_cables_are_barycentric():
    p = np.array([[0.3, 0, 0.1], [-0.2, 0.3, 0.1], [-0.1, -0.3, 0.15]])
    share = np.array([0.5, 0.2, 0.3])
    np.testing.assert_allclose(load_shares(p, p + UP, (share @ p)[:2]), share, atol=1e-6)
    assert load_shares(p, p + UP, np.array([-0.4, 0.0])) is None


def test_redundant_cables_share_the_load():
    angle = np.arange(6) * np.pi / 3.0
    p = np.stack([0.4 * np.cos(angle), 0.4 * np.sin(angle), np.zeros(6)], axis=1)
    np.testing.assert_allclose(load_shares(p, p + UP, np.zeros(2)), 1.0 / 6.0, atol=1e-9)
    # Three on a line, the centre beside the middle one.
    bar = np.array([[-0.3, 0, 0], [0.0, 0, 0], [0.3, 0, 0]])
    share = load_shares(bar, bar + UP, np.array([0.06, 0.0]))
    assert share.min() > 0.2
    assert share @ bar[:, 0] == pytest.approx(0.06)
    # Far off the middle: the smallest tensions in norm would be negative, yet all can be taut.
    share = load_shares(p, p + UP, np.array([0.3, 0.0]))
    assert share.min() > 0.01
    np.testing.assert_allclose(share @ p, [0.3, 0.0, 0.0], atol=1e-9)
    assert load_shares(p, p + UP, np.array([0.45, 0.0])) is None


def test_one_cable_carries_everything():
    np.testing.assert_array_equal(load_shares(np.zeros((1, 3)), UP[None], np.array([0.2, 0.0])), [1.0])
