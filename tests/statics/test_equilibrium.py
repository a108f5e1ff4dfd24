"""The balance matrix against forces and moments summed one by one."""

import numpy as np
import pytest

from drake_aerial.statics.equilibrium import balance_matrix, level_balance, moment_axes


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
