"""The quadrotor accelerates as its allocation says, and its propellers stay within their limits."""

import numpy as np
import pytest

from drake_aerial.errors import InputError
from drake_aerial.io import model_files
from drake_aerial.plant.quadrotor import QuadrotorParameters

P = QuadrotorParameters()


def test_thrust_limits_are_the_published_ones():
    assert P.thrust_limits == pytest.approx((0.795, 7.07), abs=0.005)


@pytest.mark.parametrize("seed", range(3))
def test_accelerations_agree_with_the_allocation(rig, seed):
    commands = np.random.default_rng(seed).uniform(*P.command_limits, 4)
    r = rig("elastic", commands=commands)
    r.place([0, 0, 5], [0, 0, 5.3])
    r.simulator.AdvanceTo(0.002)
    wrench = P.allocation @ commands
    state = r.state("quadrotor")
    assert state[12] / 0.002 == pytest.approx(wrench[0] / P.mass - 9.81, rel=1e-6)
    assert state[7:10] / 0.002 == pytest.approx(wrench[1:] / P.inertia, rel=1e-6)


@pytest.mark.parametrize(
    ("command", "speed"), [(0.0, P.min_rpm), (-1.0, P.min_rpm), (1e12, P.max_rpm)]
)
def test_each_propeller_keeps_its_limits(rig, command, speed):
    hover = P.mass * 9.81 / 4 / P.thrust_coefficient
    r = rig("elastic", commands=[command, hover, hover, hover])
    r.place([0, 0, 5], [0, 0, 5.3])
    r.simulator.AdvanceTo(0.002)
    thrust = P.thrust_coefficient * (speed**2 + 3 * hover)
    assert r.state("quadrotor")[12] / 0.002 == pytest.approx(thrust / P.mass - 9.81, rel=1e-6)


def test_the_shipped_file_says_what_the_defaults_are():
    assert QuadrotorParameters.read(model_files.models_dir() / "quadrotor" / "dragonfly.yaml") == P


def test_reading(tmp_path):
    path = tmp_path / "quadrotor.yaml"
    path.write_text("mass: 0.5\ninertia: [0.001, 0.001, 0.0015]\n")
    read = QuadrotorParameters.read(path)
    assert (read.mass, read.inertia, read.max_rpm) == (0.5, (0.001, 0.001, 0.0015), P.max_rpm)
    path.write_text("thrust_coeficient: 1e-9\n")
    with pytest.raises(InputError, match="did you mean 'thrust_coefficient'"):
        QuadrotorParameters.read(path)
    path.write_text("min_rpm: 20000\n")
    with pytest.raises(InputError, match="`min_rpm` must be < max_rpm = 16400, got 20000"):
        QuadrotorParameters.read(path)
