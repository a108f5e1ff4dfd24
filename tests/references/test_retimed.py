import numpy as np
import pytest

from drake_aerial.errors import InputError
from drake_aerial.references.retimed import RetimedTrajectory
from drake_aerial.references.spline_law import SplineLaw
from drake_aerial.references.trajectory import LineTrajectory, TransportTrajectory
from drake_aerial.references.trajectory_files import trajectory_from_dict, trajectory_to_dict

LAW = SplineLaw(0.2, tuple(np.linspace(0.0, 1.0, 20)))


@pytest.fixture
def retimed():
    return RetimedTrajectory(base=TransportTrajectory(), laws=(1.0, 1.3, LAW))


def test_each_derivative_is_the_derivative_of_the_one_before(retimed):
    step = 1e-5
    t = np.random.default_rng(0).uniform(2.0, retimed.duration, 300)
    before, here, after = (retimed.sample(x) for x in (t - step, t, t + step))
    for k in range(4):
        numeric = (after[k] - before[k]) / (2 * step)
        scale = max(1.0, np.abs(here[k + 1]).max())
        np.testing.assert_allclose(here[k + 1], numeric, atol=1e-6 * scale)


def test_a_law_starts_and_ends_at_rest_up_to_snap():
    assert LAW.duration == pytest.approx(23 * 0.2)
    ends = LAW.derivatives(np.array([0.0, LAW.duration]))
    np.testing.assert_allclose(ends[0], [0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(ends[1:], 0.0, atol=1e-9)
    progress = LAW.derivatives(np.linspace(0.0, LAW.duration, 400))[0]
    assert (np.diff(progress) >= 0.0).all()
    assert LAW.derivatives(np.array([LAW.time_of(0.3)]))[0, 0] == pytest.approx(0.3)


def test_a_factor_slows_a_move_and_its_derivatives(retimed):
    own = TransportTrajectory().phase("approach")
    slow = retimed.phase("approach")
    assert slow.end - slow.start == pytest.approx(1.3 * (own.end - own.start))
    a = TransportTrajectory().sample(own.start + 1.0)
    b = retimed.sample(slow.start + 1.3)
    np.testing.assert_allclose(b.p, a.p, atol=1e-12)
    np.testing.assert_allclose(b.snap * 1.3**4, a.snap, atol=1e-9)


def test_a_retimed_trajectory_is_the_same_after_writing_and_reading(retimed):
    again = trajectory_from_dict(trajectory_to_dict(retimed))
    assert again == retimed
    t = np.linspace(0.0, retimed.duration, 100)
    np.testing.assert_array_equal(again.sample(t).p, retimed.sample(t).p)


def test_a_retimed_trajectory_moves_with_its_start(retimed):
    moved = retimed.starting_at([1.0, 2.0, 3.0])
    np.testing.assert_allclose(moved.sample(7.0).p, retimed.sample(7.0).p + [1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    ("laws", "message"),
    [
        ((1.0,), "`laws` must have 2 entries, as many as moves of `base`, got 1"),
        ((1.0, {"spacing": 0.1}), "`laws` must be numbers, or mappings"),
        ((1.0, {"spacing": -1.0, "points": [0, 1]}), "`laws` must be numbers, or mappings"),
        ((0.0, 1.0), r"`laws` must be in \[0.001, inf\)"),
    ],
)
def test_bad_laws_are_refused(laws, message):
    with pytest.raises(InputError, match=message):
        RetimedTrajectory(base=LineTrajectory(), laws=laws)
