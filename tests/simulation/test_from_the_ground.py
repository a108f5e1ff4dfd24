"""Take-off from the ground with slack cables: nothing jumps, and the payload does not drag."""

import numpy as np
import pytest

from drake_aerial.plant.cable import CableParameters
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.simulation.suspended_payload import SuspendedPayload

TRIANGLE = np.array([[-0.154, -0.267, 0.14], [0.308, 0.0, 0.14], [-0.154, 0.267, 0.14]])
PAIR = np.array([[-0.25, 0.0, 0.14], [0.25, 0.0, 0.14]])


@pytest.mark.parametrize("kind", ["inextensible", "elastic"])
@pytest.mark.parametrize("contacts", [PAIR, TRIANGLE], ids=["two", "three"])
def test_a_team_takes_off_without_a_jolt(box, quick, kind, contacts):
    suspension = SuspendedPayload.from_contacts(
        box, contacts, np.tile([0.0, 0.0, 1.0], (len(contacts), 1))
    )
    parameters = StationParameters(cable=CableParameters(kind))
    result = Flight(
        suspension, FlightOptions(belief="true", trajectory=quick, parameters=parameters)
    ).run(2)
    m, s = result.metrics, result.series
    assert m["outcome"] == "completed"
    assert m["slack_fraction"] == 0.0
    assert m["position_rmse_m"] < 0.008
    if len(contacts) == 3:  # two cables leave the payload free to swing about the line through them
        assert m["attitude_rmse_rad"] < np.deg2rad(1.0)
    time, share = s["time"], 0.25 * 9.81 / len(contacts)
    # At first the quadrotors alone move, from rest and straight up; their cables are slack.
    first = time < 0.1
    assert s["tension"][first].max() < 0.05
    assert np.linalg.norm(s["payload_velocity"][first], axis=1).max() < 2e-3
    step = np.diff(s["quadrotor_position"][:6], axis=0)
    assert np.linalg.norm(step, axis=2).max() < 0.01 * 0.05  # after 0.05 s at 1 m/s^2
    assert np.abs(step[:, :, :2]).max() < 1e-5
    # Until the reference rises the payload stays in place; the cables' pull may just lift it off.
    standing = time < quick.ground_time
    moved = np.ptp(s["payload_position"][standing], axis=0)
    assert moved[:2].max() < 2e-3
    assert moved[2] < 0.01
    assert s["tilt"][standing].max() < 5e-3
    # Then it leaves the ground level, and no cable is ever pulled by more than three shares.
    assert s["tilt"][time < quick.ground_time + quick.lift_time].max() < np.deg2rad(2.0)
    assert s["tension"].max() < 3.0 * share
