"""Lift of a team from its parameters."""

import pytest

from drake_aerial.errors import InputError
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.quadrotor import QuadrotorParameters
from drake_aerial.plant.team_lift import default_lift, own_masses, team_lift
from drake_aerial.simulation.station_parameters import StationParameters


def test_the_default_teams_lift_is_that_of_the_default_station():
    parameters, quadrotor = StationParameters(), QuadrotorParameters()
    lift = default_lift(0.25, 3)
    assert lift.payload_mass == pytest.approx(0.25 + 3 * parameters.gripper.mass)
    assert lift.max_thrust == (quadrotor.thrust_limits[1],) * 3
    expected = team_lift(lift.payload_mass, parameters.quadrotors(3), parameters.cables(3))
    assert lift == expected


def test_a_payload_without_mass_is_refused():
    with pytest.raises(InputError, match=r"mass must be positive, got -1\.0 kg"):
        default_lift(-1.0, 1)


def test_a_quadrotor_lifts_the_link_of_an_inextensible_cable():
    quadrotors = (QuadrotorParameters(), QuadrotorParameters(mass=0.4))
    cables = (CableParameters(link_mass=0.01), CableParameters("elastic", link_mass=0.01))
    assert own_masses(quadrotors, cables).tolist() == pytest.approx([0.26, 0.4])
