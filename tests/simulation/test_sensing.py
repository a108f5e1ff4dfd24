import pytest
from pydrake.systems.framework import LeafSystem

from drake_aerial import (
    Flight,
    FlightOptions,
    InputError,
    Payload,
    SensorParameters,
    StationParameters,
    SuspendedPayload,
    make_transport_station,
)
from drake_aerial.references.trajectory import HoverTrajectory


@pytest.fixture(scope="module")
def held():
    box = Payload.from_box([0.4, 0.4, 0.2], 0.25)
    return SuspendedPayload.from_contacts(box, [[0.0, 0.0, 0.1]], [[0.0, 0.0, 1.0]])


def options(level, **more):
    station = StationParameters(sensors=SensorParameters(level=level))
    trajectory = HoverTrajectory(hover_time=1.0)
    return FlightOptions(belief="true", parameters=station, trajectory=trajectory, **more)


@pytest.mark.parametrize("level", ["payload", "cables"])
def test_a_payload_hovers_with_realistic_sensors(held, level):
    result = Flight(held, options(level)).run(0)
    assert result.outcome == "completed"
    assert result.metrics["position_rmse_m"] < 0.02


def test_the_level_vehicles_is_refused_with_a_controller_that_needs_the_payload(held):
    with pytest.raises(InputError, match=r"`sensors\.level` must be payload or cables for a contr"):
        Flight(held, options("vehicles"))


def test_the_level_cables_has_no_payload_state_for_a_controller_of_another_kind(held):
    with pytest.raises(InputError, match=r"`sensors\.level` must be payload for a controller that"):
        Flight(held, options("cables", controller=lambda model: Foreign()))


class Foreign(LeafSystem):
    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("payload_state", 13)
        self.DeclareVectorOutputPort("thrust_vectors", 3, lambda context, output: None)


def test_a_station_without_a_controller_exports_what_is_measured():
    box = Payload.from_box([0.4, 0.4, 0.2], mass=0.25)
    parameters = StationParameters(sensors=SensorParameters(level="vehicles"))
    station = make_transport_station(box, [[0.0, 0.0, 0.1]], parameters=parameters)
    assert station.GetOutputPort("perception.imu").size() == 6
    assert station.GetOutputPort("perception.rotor_speeds").size() == 4
    assert not station.HasOutputPort("perception.payload_state")


def test_a_noise_of_the_position_beside_sensors_is_refused(held):
    with pytest.raises(InputError, match="`noise` must be None with `sensors`"):
        Flight(held, options("payload", noise=0.01))
