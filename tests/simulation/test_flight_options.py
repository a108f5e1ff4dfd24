"""Options of a flight: one value, or its fields as keywords; both say the same."""

import pytest

from drake_aerial.errors import InputError
from drake_aerial.plant.cable import CableParameters
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.station_parameters import StationParameters


def test_cable_and_noise_go_into_the_stations_parameters():
    team = StationParameters(cable=CableParameters(length=0.7), noise=0.02)
    assert FlightOptions(parameters=team).station_parameters is team
    asked = FlightOptions(parameters=team, cable="elastic", noise=0.0).station_parameters
    assert (asked.cable.kind, asked.cable.length, asked.noise) == ("elastic", 0.7, 0.0)
    given = FlightOptions(parameters=team, cable=CableParameters(length=0.3)).station_parameters
    assert (given.cable.length, given.noise) == (0.3, 0.02)
    assert FlightOptions().station_parameters == StationParameters()


def test_options_and_keywords_are_the_same_flight(hang):
    trajectory = HoverTrajectory(hover_time=1.0)
    options = FlightOptions(belief="true", controller="geometric", trajectory=trajectory, noise=0.0)
    keywords = {"belief": "true", "controller": "geometric", "trajectory": trajectory, "noise": 0.0}
    assert (
        Flight(hang(), options).configuration
        == Flight(hang(), FlightOptions(**keywords)).configuration
    )
    changed = Flight(hang(), options, controller="geometric_ff")
    assert changed.configuration["controller"] == "geometric_ff"
    assert changed.options.belief == "true"


def test_unknown_options_are_refused(hang):
    with pytest.raises(InputError, match="below_contact, geometric, true"):
        FlightOptions(belief="blind")
    with pytest.raises(InputError, match="mpc, geometric_ff, geometric"):
        FlightOptions(controller="pid")
    with pytest.raises(TypeError, match="wings"):
        Flight(hang(), FlightOptions(wings=2))
