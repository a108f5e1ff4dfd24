"""Tensions and load shares against hand calculation."""

import numpy as np
import pytest

from drake_aerial.statics.tensions import (
    balance_matrix,
    level_balance,
    level_tensions,
    load_shares,
    moment_axes,
    one_sided,
    tensions,
)

UP = np.array([0.0, 0.0, 1.0])


def test_load_shares_of_two_cables_follow_the_lever_rule():
    p = np.array([[-0.1, 0, 0], [0.3, 0, 0.0]])
    np.testing.assert_allclose(load_shares(p, p + UP, np.zeros(2)), [0.75, 0.25], atol=1e-9)
    # Beside the line the payload swings below it.
    np.testing.assert_allclose(
        load_shares(p, p + UP, np.array([0.0, 0.05])), [0.75, 0.25], atol=1e-9
    )
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
    np.testing.assert_array_equal(
        load_shares(np.zeros((1, 3)), UP[None], np.array([0.2, 0.0])), [1.0]
    )


def test_four_vertical_cables_share_as_evenly_as_balance_allows():
    p = np.array([[0.3, 0.3, 0], [-0.3, 0.3, 0], [-0.3, -0.3, 0], [0.3, -0.3, 0.0]])
    np.testing.assert_allclose(load_shares(p, p + UP, np.zeros(2)), np.full(4, 0.25), atol=1e-9)
    # By hand: the right pair carries (0.3 + 0.1) / 0.6 of the weight, each pair in halves.
    np.testing.assert_allclose(
        load_shares(p, p + UP, np.array([0.1, 0.0])), [1 / 3, 1 / 6, 1 / 6, 1 / 3], atol=1e-9
    )
    assert load_shares(p, p + UP, np.array([0.35, 0.0])) is None


def test_leaning_cables_pull_more_than_the_weight():
    p = np.array([[0.3, 0, 0], [-0.3, 0, 0.0]])
    lean = np.array([[np.tan(0.5), 0, 1], [-np.tan(0.5), 0, 1]])
    np.testing.assert_allclose(
        tensions(p, p + lean, np.zeros(2)), np.full(2, 0.5 / np.cos(0.5)), atol=1e-9
    )
    np.testing.assert_allclose(load_shares(p, p + lean, np.zeros(2)), [0.5, 0.5], atol=1e-9)


def test_level_tensions_balance_force_and_moment_and_none_pushes():
    rng = np.random.default_rng(3)
    for n in (1, 2, 3, 4, 6):
        for _ in range(20):
            p = rng.uniform(-0.4, 0.4, (n, 3))
            # The centre of mass is inside the contacts, seen from above.
            p -= [*(rng.dirichlet(np.ones(n)) @ p)[:2], 0.0]
            tension = level_tensions(p, 7.0)
            assert tension.min() >= 0.0
            A, b = level_balance(p, 7.0)
            if np.all(np.linalg.pinv(A) @ b > 0.0):
                assert tension.sum() == pytest.approx(7.0)
                # Cables hold the weight with no moment about the centre of mass.
                np.testing.assert_allclose(tension @ p[:, :2], 0.0, atol=1e-9)


def test_one_sided_contacts_have_a_line_that_separates_them_from_the_centre():
    rng = np.random.default_rng(1)
    angles = np.linspace(0.0, 2.0 * np.pi, 721)
    sides = np.stack([np.cos(angles), np.sin(angles)])
    for n in (3, 4, 5):
        for _ in range(100):
            p = np.column_stack([rng.uniform(-0.4, 0.4, (n, 2)), np.zeros(n)])
            margin = ((p[:, :2] - 0.1) @ sides).min(axis=0).max()
            if abs(margin) > 0.005 and len(moment_axes(p)) == 3:
                assert one_sided(p, np.full(2, 0.1)) == (margin > 0.0)
    pair = np.array([[0.1, 0.0, 0.0], [0.3, 0.0, 0.0]])
    # The centre's distance from the line does not matter.
    assert one_sided(pair, np.array([0.05, 1.0]))
    assert not one_sided(pair, np.array([0.2, 1.0]))


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_the_balance_matrix_sums_forces_and_moments(n):
    rng = np.random.default_rng(n)
    arm, direction = rng.standard_normal((2, n, 3))
    tension, axis = rng.uniform(0.0, 1.0, n), rng.standard_normal(3)
    force, moment = np.zeros(3), np.zeros(3)
    for a, d, t in zip(arm, direction, tension, strict=True):
        force += t * d
        moment += np.cross(a, t * d)
    np.testing.assert_allclose(balance_matrix(arm, direction) @ tension, [*force, *moment])
    about_one = balance_matrix(arm, direction, axis[None]) @ tension
    np.testing.assert_allclose(about_one, [*force, moment @ axis])


def test_collinear_contacts_exert_no_moment_about_their_line():
    line = np.array([2.0, 1.0, 0.5]) / np.linalg.norm([2.0, 1.0, 0.5])
    for n in (2, 3, 5):
        p = np.outer(np.linspace(-0.3, 0.4, n), line) + [0.1, 0.0, 0.2]
        axes = moment_axes(p)
        assert axes.shape == (2, 3)
        np.testing.assert_allclose(axes @ line, 0.0, atol=1e-12)
    # A triangle that is flatter than 5 % of its size counts as a line; a taller one does not.
    for height, count in ((0.005, 2), (0.2, 3)):
        p = np.array([[-0.3, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, height, 0.0]])
        assert len(moment_axes(p)) == count


def test_level_balance_has_the_same_solutions_as_the_balance_matrix():
    rng = np.random.default_rng(0)
    for n in (2, 3, 4):
        p = rng.uniform(-0.4, 0.4, (n, 3))
        tension = rng.uniform(0.0, 2.0, n)
        p -= [*(tension @ p / tension.sum())[:2], 0.0]
        A, b = level_balance(p, tension.sum())
        np.testing.assert_allclose(A @ tension, b, atol=1e-12)
        up = np.tile([0.0, 0.0, 1.0], (n, 1))
        full = balance_matrix(p, up) @ tension
        np.testing.assert_allclose(full, [0.0, 0.0, tension.sum(), 0.0, 0.0, 0.0], atol=1e-12)
        # Neither admits tensions that the other refuses.
        assert np.linalg.matrix_rank(A) == np.linalg.matrix_rank(balance_matrix(p, up))
