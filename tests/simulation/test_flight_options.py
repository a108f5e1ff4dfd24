"""Options of a flight, and the same as keywords of `fly` and `prepare_flight`."""

import inspect
from dataclasses import MISSING, fields
from typing import get_type_hints

import pytest

from drake_aerial.control.geometric import GeometricController
from drake_aerial.errors import InputError
from drake_aerial.plant.cable import CableParameters
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.simulation.trial import fly, prepare_flight


def test_cable_and_noise_go_into_the_stations_parameters():
    team = StationParameters(cable=CableParameters(length=0.7), noise=0.02)
    assert FlightOptions(parameters=team).station_parameters is team
    asked = FlightOptions(parameters=team, cable="elastic", noise=0.0).station_parameters
    assert (asked.cable.kind, asked.cable.length, asked.noise) == ("elastic", 0.7, 0.0)
    given = FlightOptions(parameters=team, cable=CableParameters(length=0.3)).station_parameters
    assert (given.cable.length, given.noise) == (0.3, 0.02)
    assert FlightOptions().station_parameters == StationParameters()


@pytest.mark.parametrize("function", [fly, prepare_flight])
def test_the_keywords_of_a_flight_are_the_fields_of_its_options(function):
    parameters = inspect.signature(function).parameters
    kinds, given = get_type_hints(FlightOptions), get_type_hints(function)
    assert all(p.kind is not inspect.Parameter.VAR_KEYWORD for p in parameters.values())
    for field in fields(FlightOptions):
        assert field.default is not MISSING
        assert parameters[field.name].default == field.default, field.name
        assert given[field.name] == kinds[field.name], field.name
        assert f"\n{field.name} : " in inspect.getdoc(fly), field.name


@pytest.mark.parametrize("function", [fly, prepare_flight, FlightOptions])
def test_a_misspelt_keyword_is_a_type_error(function):
    with pytest.raises(TypeError, match="unexpected keyword argument 'beleif'"):
        function(
            **{"contacts": "contacts.json"} if function is not FlightOptions else {}, beleif=""
        )


def test_options_are_what_is_flown(hang):
    options = FlightOptions(
        belief="true",
        controller="geometric",
        trajectory=HoverTrajectory(hover_time=1.0),
        noise=0.0,
        mass_ratio=1.2,
        after_drop=1.0,
    )
    flight = Flight(hang(), options)
    assert isinstance(flight.station.controller, GeometricController)
    assert flight.station.parameters.noise == 0.0
    assert flight.model.mass == pytest.approx(1.2 * 0.25 + 0.002)
    told = flight.configuration
    assert (told["belief"], told["controller"], told["after_drop_s"]) == ("true", "geometric", 1.0)


def test_unknown_options_are_refused():
    with pytest.raises(InputError, match="`belief` must be one of below_contact, geometric, true"):
        FlightOptions(belief="blind")
    with pytest.raises(
        InputError, match="`controller` must be one of mpc, geometric_ff, geometric"
    ):
        FlightOptions(controller="pid")
    with pytest.raises(InputError, match="`after_drop` must be >= 0 s, got -1"):
        FlightOptions(after_drop=-1.0)
