"""Three grippers 0.4 m apart and a centre of mass near an edge of their triangle."""

from itertools import combinations

import numpy as np
import pytest

from drake_aerial.plant.air import AirParameters
from drake_aerial.plant.payload import Payload
from drake_aerial.references.trajectory import TransportTrajectory
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.simulation.suspended_payload import SuspendedPayload

AZIMUTH = 0.3 + 2.0 * np.pi / 3.0 * np.arange(3)
CONTACTS = np.stack([np.cos(AZIMUTH), np.sin(AZIMUTH), np.zeros(3)], axis=1) * 0.4 / np.sqrt(3.0)


@pytest.mark.slow
def test_quadrotors_keep_apart_when_one_bears_little_weight():
    # The first cable bears a tenth of the weight.
    com = -0.08 * np.array([np.cos(0.3), np.sin(0.3), 0.0])
    box = Payload.from_box([0.6, 0.6, 0.2], 0.25, com=com)
    held = SuspendedPayload.from_contacts(
        box, CONTACTS + [0.0, 0.0, 0.1], np.tile([0.0, 0.0, 1.0], (3, 1))
    )
    options = FlightOptions(
        belief="true",
        trajectory=TransportTrajectory(circle_time=6.0, turns=1.0, hover_time=1.0),
        parameters=StationParameters(air=AirParameters()),
        path_limits=None,
    )
    result = Flight(held, options).run(1)
    assert result.metrics["outcome"] == "completed"
    p = result.series["quadrotor_position"]
    gaps = [np.linalg.norm(p[:, i] - p[:, j], axis=1).min() for i, j in combinations(range(3), 2)]
    # Guards touch at 0.24 m; the MPC keeps 0.32 m, softly.
    assert min(gaps) > 0.29
