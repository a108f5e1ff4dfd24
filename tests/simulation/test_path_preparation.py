import numpy as np
import pytest

from drake_aerial import Flight, FlightOptions, JobError, Payload, SuspendedPayload
from drake_aerial.dynamics.path_check import check_path
from drake_aerial.dynamics.path_limits import PathLimits
from drake_aerial.plant.dryden import Dryden
from drake_aerial.plant.wind import WindParameters
from drake_aerial.references.trajectory import (
    HoverTrajectory,
    LineTrajectory,
    TransportTrajectory,
)
from drake_aerial.simulation.path_preparation import carried_payload, prepare_path, winds_of
from drake_aerial.simulation.station_parameters import StationParameters

FAST = LineTrajectory(line_time=1.0, ground_time=0.0, lift_time=0.0, hover_time=0.3)


@pytest.fixture(scope="module")
def held():
    box = Payload.from_box([0.4, 0.4, 0.2], 0.25)
    return SuspendedPayload.from_contacts(box, [[0.0, 0.0, 0.1]], [[0.0, 0.0, 1.0]])


@pytest.fixture(scope="module")
def carried(held):
    return carried_payload(held, StationParameters())


def test_an_impossible_path_is_refused_with_the_limit_and_the_factor(held):
    with pytest.raises(
        JobError,
        match=r"the path needs \d+\.\d\d N at t = 0\.\d\d s, the propellers of quadrotor 1 "
        r"give at most 6\.75 N with the margin; slow it by a factor of 1\.\d\d or use --retime",
    ):
        Flight(held, FlightOptions(trajectory=FAST))


def test_a_path_with_a_velocity_step_is_refused_with_another_advice(carried):
    with pytest.raises(JobError, match=r"velocity step of 1\.05 m/s .* choose the timing smooth"):
        prepare_path(TransportTrajectory(timing="constant"), carried, PathLimits())


def test_a_forced_path_is_recorded_as_impossible(carried):
    forced = prepare_path(FAST, carried, PathLimits(), force=True)
    assert forced.trajectory is FAST
    assert forced.record["feasible"] is False
    assert forced.notes[0].startswith("flown by force, although the path needs")


def test_without_limits_nothing_is_checked(carried):
    unchecked = prepare_path(FAST, carried, None)
    assert (unchecked.trajectory, unchecked.record) == (FAST, None)


def test_a_retimed_flight_completes_near_its_path_and_records_what_was_changed(held):
    options = FlightOptions(belief="true", trajectory=FAST, retime="slower", noise=0.0)
    flight = Flight(held, options)
    record = flight.configuration["path_check"]
    (move,) = record["retimed"]["moves"]
    assert move["asked_s"] == 1.0
    assert 1.3 < move["flown_s"] < 1.7
    result = flight.run(0)
    assert result.outcome == "completed"
    # The thrust is that of the check, within what feedback adds.
    predicted = record["margins"]["thrust"]["value"]
    assert result.metrics["thrust_max_N"] == pytest.approx(predicted, rel=0.06)
    assert result.metrics["position_rmse_m"] < 0.06
    assert flight.path.notes[0].startswith("retimed (slower): line takes 1.")


def test_the_winds_of_the_check_are_the_mean_and_the_gust_with_turbulence():
    wind = WindParameters(
        mean=(3.0, 0.0, 0.0),
        gust=(0.0, 2.0, 0.0),
        turbulence=Dryden((0.5, 0.5, 0.2), (2.0, 2.0, 1.0)),
    )
    np.testing.assert_allclose(winds_of(wind), [[4.0, 0.0, 0.0], [4.0, 2.0, 0.0]])
    assert winds_of(None) == ((0.0, 0.0, 0.0),)


def test_a_wind_that_the_team_cannot_hold_is_refused_with_the_thrust_that_it_takes():
    box = Payload.from_box([0.68, 0.61, 0.28], 0.25)
    held = SuspendedPayload.from_contacts(box, [[0.0, 0.0, 0.14]], [[0.0, 0.0, 1.0]])
    hover = HoverTrajectory(hover_time=1.0)
    for speed, possible in ((2.0, True), (8.0, False)):
        station = StationParameters(wind=WindParameters(mean=(speed, 0.0, 0.0)))
        carried = carried_payload(held, station)
        assert check_path(hover, carried).feasible == possible
    with pytest.raises(JobError, match="it is impossible at any speed: choose other contacts, an"):
        prepare_path(hover, carried, PathLimits())
