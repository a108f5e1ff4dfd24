"""Lift of quadrotors against the balance of thrust, tension and weight."""

import numpy as np
import pytest

from drake_aerial.errors import InputError
from drake_aerial.statics.lift import Lift, smallest_overload


def test_largest_tension_along_a_leaning_cable():
    d = np.array([[np.sin(0.6), 0.0, np.cos(0.6)], [0.0, 0.0, 1.0]])
    lift = Lift(1.0, (12.0, 2.0), (0.4, 0.4))
    tension = lift.largest_tension(d)
    assert np.linalg.norm(tension[0] * d[0] + [0, 0, 0.4 * 9.81]) == pytest.approx(12.0)
    # The second does not lift itself.
    assert tension[1] == 0.0


@pytest.mark.parametrize(
    "values", [(0.0, (1.0,), (1.0,)), (1.0, (1.0, 2.0), (1.0,)), (1.0, (np.inf,), (1.0,))]
)
def test_refuses_bad_lifts(values):
    with pytest.raises(InputError, match="must"):
        Lift(*values)


def test_the_smallest_overload_is_found_by_trying_tensions():
    # Four cables at the corners: T = (a, b, a, b) with a + b half of the weight, 10 N.
    p = np.array([[0.3, 0.3, 0.0], [-0.3, 0.3, 0.0], [-0.3, -0.3, 0.0], [0.3, -0.3, 0.0]])
    spare = np.array([2.0, 9.0, 3.0, 9.0])
    a = np.linspace(0.0, 5.0, 5001)
    worst = np.maximum(a - spare[[0, 2]].min(), 5.0 - a - 9.0)
    overload, tension = smallest_overload(p, 10.0, spare)
    assert overload == pytest.approx(worst.min(), abs=1e-3)
    assert tension.sum() == pytest.approx(10.0)
    np.testing.assert_allclose(tension @ p[:, :2], 0.0, atol=1e-9)
    assert smallest_overload(p[:2], 10.0, np.array([4.0, 6.0]))[0] == pytest.approx(1.0)


def test_contacts_that_cannot_hold_the_payload_level_have_no_overload():
    p = np.array([[0.1, 0.0, 0.0], [0.3, 0.1, 0.0], [0.3, -0.1, 0.0]])
    assert smallest_overload(p, 10.0, np.full(3, 5.0)) is None
