"""Whole flights of formations, against figures of independent simulators and of the design."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_aerial.geometry import matrix_from_quat
from drake_aerial.plant.gripper import GripperParameters
from drake_aerial.plant.payload import TABLE_INERTIA, Payload
from drake_aerial.references.trajectory import TransportTrajectory
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.simulation.suspended_payload import SuspendedPayload

GRIPPERS = [(-0.154, -0.267, 0.011), (0.308, 0.0, 0.011), (-0.154, 0.267, 0.011)]
EXACT = StationParameters(noise=0.0, perception_period=0.01)
CIRCLE = TransportTrajectory.airborne()


@pytest.fixture
def plate():
    payload = Payload.from_box([0.68, 0.61, 0.022], inertia=TABLE_INERTIA)
    return SuspendedPayload.from_contacts(payload, GRIPPERS, [[0.0, 0.0, 1.0]] * 3)


def geometric(plate, name, trajectory=CIRCLE, parameters=EXACT):
    options = {"period": 0.01}
    return Flight(
        plate,
        FlightOptions(
            belief="true",
            controller=name,
            trajectory=trajectory,
            parameters=parameters,
            controller_options=options,
            path_limits=None,
        ),
    ).run()


def test_the_geometric_law_errs_as_two_independent_simulators_found(plate):
    """Control at 100 Hz with held forces, a circle at constant rate that starts from rest.

    Both simulators give 0.137 m RMSE over the 12 s, and 0.480 m at the stop after it.
    """
    # Sensor, law and hold follow one another by one plant step; 1 ms is short against 10 ms.
    parameters = replace(
        EXACT, attitude_period=0.01, time_step=0.001, gripper=GripperParameters(mass=1e-6)
    )
    circle = TransportTrajectory.airborne(timing="constant", hover_time=1.0)
    result = geometric(plate, "geometric", circle, parameters)
    s = result.series
    error = np.linalg.norm(s["payload_position"] - s["reference_position"], axis=1)
    assert result.metrics["circle_position_rmse_m"] == pytest.approx(0.137, abs=0.002)
    assert error.max() == pytest.approx(0.480, abs=0.005)
    assert 12.0 < s["time"][error.argmax()] < 13.0


def test_a_first_sample_that_is_far_off_does_not_drop_a_hanging_payload(plate):
    # The first sample of this seed is 2.4 cm too high: cables of 50 cm seem to span 47.6 cm.
    short = TransportTrajectory.airborne(circle_time=1.0, turns=0.01, hover_time=0.5)
    flight = Flight(plate, FlightOptions(belief="true", trajectory=short))
    context = flight.station.CreateDefaultContext()
    flight.station.place(context, seed=109, reference=flight.trajectory)
    simulator = Simulator(flight.station, context)
    simulator.AdvanceTo(0.001)
    height = flight.station.GetOutputPort("payload.state").Eval(context)[6]
    assert flight.station.GetOutputPort("perception.payload_state").Eval(context)[6] - height > 0.02
    result = flight.run(109)
    assert result.outcome == "completed"
    assert result.metrics["position_max_m"] < 0.05


@pytest.mark.slow
def test_the_cables_rate_fed_forward_keeps_seven_centimetres_on_both_kinds_of_cable(plate):
    equal = replace(EXACT, time_step=0.002)
    both = [
        geometric(plate, "geometric_ff", parameters=equal.with_cable_kind(kind))
        for kind in ("inextensible", "elastic")
    ]
    errors = [result.metrics["circle_position_rmse_m"] for result in both]
    assert max(errors) <= 0.07
    assert abs(errors[0] - errors[1]) <= 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("seed", [100, 101])
def test_the_mpc_carries_a_formation_within_seven_millimetres_on_both_kinds_of_cable(plate, seed):
    rmse = []
    for kind in ("inextensible", "elastic"):
        result = Flight(plate, FlightOptions(belief="true", trajectory=CIRCLE, cable=kind)).run(
            seed
        )
        s, m = result.series, result.metrics
        error = np.linalg.norm(s["payload_position"] - s["reference_position"], axis=1)
        hover = s["phase"] == result.phase_names.index("hover")
        assert m["outcome"] == "completed"
        assert m["circle_position_rmse_m"] <= 0.007
        assert np.sqrt(np.mean(error[hover] ** 2)) <= 0.004
        assert np.rad2deg(m["attitude_rmse_rad"]) <= 0.5
        rmse.append(m["position_rmse_m"])
    assert abs(rmse[0] - rmse[1]) <= 1e-3


@pytest.mark.slow
def test_the_mpc_carries_a_formation_from_the_ground_within_eight_millimetres(plate):
    m = Flight(plate, FlightOptions(belief="true")).run(100).metrics
    assert m["outcome"] == "completed"
    assert m["position_rmse_m"] <= 0.008
    assert m["slack_fraction"] == 0.0


def ring(box, n):
    angles = 2.0 * np.pi * np.arange(n) / n
    contacts = np.column_stack([0.29 * np.cos(angles), 0.29 * np.sin(angles), np.full(n, 0.14)])
    return SuspendedPayload.from_contacts(box, contacts, [[0.0, 0.0, 1.0]] * n)


@pytest.mark.slow
@pytest.mark.parametrize("n", [4, 6])
def test_larger_formations_fly(box, n):
    # Six rotor guards on this ring nearly touch on the circle, which the check before take-off
    # refuses.
    options = FlightOptions(belief="true", path_limits=None)
    m = Flight(ring(box, n), options).run(100).metrics
    assert m["outcome"] == "completed"
    assert m["position_rmse_m"] <= 0.008
    assert np.rad2deg(m["attitude_rmse_rad"]) <= 0.5


@pytest.mark.slow
def test_below_two_cables_the_payload_hangs_along_the_effective_gravity(box):
    # Forces at two contacts make no moment about the line through them, here x. About it the box
    # is a pendulum of 7.6 rad/s, on a circle whose acceleration turns at 2 rad/s at most.
    flight = Flight(ring(box, 2), FlightOptions(belief="true", trajectory=CIRCLE))
    result = flight.run(100)
    s = result.series
    assert result.outcome == "completed"
    assert result.metrics["position_rmse_m"] <= 0.008
    z_W = matrix_from_quat(s["payload_quaternion"])[:, :, 2]
    acceleration = flight.trajectory.sample(s["time"]).a
    about_x = np.rad2deg(np.arctan2(z_W[:, 1], z_W[:, 2]))
    hanging = np.rad2deg(np.arctan2(acceleration[:, 1], 9.81))
    assert np.sqrt(np.mean(hanging**2)) > 7.0
    assert np.sqrt(np.mean((about_x - hanging) ** 2)) < 1.0
    assert np.sqrt(np.mean(np.rad2deg(np.arctan2(z_W[:, 0], z_W[:, 2])) ** 2)) < 0.5
