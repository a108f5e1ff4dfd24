import numpy as np
import pytest

from drake_aerial.control.allocation import Allocation, allocate
from drake_aerial.errors import InputError

ARM = 0.12
CROSS = Allocation(
    ARM * np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]]) / np.sqrt(2),
    6.572e-9,
    6.572e-9 * 0.014 * np.array([1, -1, 1, -1]),
    5500.0,
    16400.0,
)
LOW, HIGH = 5500.0**2, 16400.0**2


def test_inside_the_limits_the_allocation_is_exactly_inverse():
    rng = np.random.default_rng(0)
    squares = rng.uniform(LOW, HIGH, (200, 4))
    for square, (f, mx, my, mz) in zip(squares, CROSS.wrench(squares)):
        got, saturated = allocate(CROSS, f, mx, my, mz)
        np.testing.assert_allclose(got, square, rtol=1e-9)
        assert not saturated


def test_the_wrench_is_that_of_forces_at_the_propellers():
    square = np.array([1.0, 2.0, 3.0, 4.0]) * 1e8 / 2
    force = np.zeros((4, 3))
    force[:, 2] = CROSS.thrust_ratio * square
    moment = np.cross(CROSS.p_QR, force).sum(0) + [0, 0, CROSS.moment_ratio @ square]
    np.testing.assert_allclose(CROSS.wrench(square), [force[:, 2].sum(), *moment], rtol=1e-12)


def test_limits_hold_for_any_demand():
    rng = np.random.default_rng(1)
    for f, mx, my, mz in rng.normal(0.0, [5.0, 0.5, 0.5, 0.2], (500, 4)):
        got, _ = allocate(CROSS, f, mx, my, mz)
        assert min(got) >= LOW
        assert max(got) <= HIGH


def test_yaw_is_given_up_before_thrust_roll_and_pitch():
    demand = np.array([4.5, 0.05, -0.04, 0.5])
    got, saturated = allocate(CROSS, *demand)
    wrench = CROSS.wrench(got)
    assert saturated
    np.testing.assert_allclose(wrench[:3], demand[:3], rtol=1e-9)
    assert 0.0 < wrench[3] < 0.5
    assert max(got) == pytest.approx(HIGH) or min(got) == pytest.approx(LOW)


def test_thrust_makes_room_for_roll_and_pitch():
    got, saturated = allocate(CROSS, 7.0, 0.1, -0.05, 0.0)
    wrench = CROSS.wrench(got)
    assert saturated
    np.testing.assert_allclose(wrench[1:3], [0.1, -0.05], rtol=1e-9)
    assert wrench[0] < 7.0
    got, _ = allocate(
        CROSS, 3.0, 3.0, 3.0, 0.0
    )  # more than the propellers have: same direction, less of it
    wrench = CROSS.wrench(got)
    assert wrench[1] == pytest.approx(wrench[2], rel=1e-9)
    assert 0.05 < wrench[1] < 3.0


def test_bad_propellers_are_refused():
    with pytest.raises(InputError, match="`p_QR` and `moment_ratio` must be"):
        Allocation(np.zeros((3, 3)), 1e-8, np.ones(3), 0.0, 1.0)
    with pytest.raises(InputError, match=r"`min_rpm` must be in \[0, max_rpm\)"):
        Allocation(CROSS.p_QR, 1e-8, CROSS.moment_ratio, 2.0, 1.0)
    with pytest.raises(InputError, match="independently"):
        Allocation(CROSS.p_QR, 1e-8, np.ones(4), 0.0, 1.0)
