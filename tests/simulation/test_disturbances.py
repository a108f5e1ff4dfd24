"""Wind, slow motors and a wrong mass, against statics; all of them off unless asked for."""

import numpy as np
import pytest
from scipy.optimize import fsolve

from drake_aerial.errors import InputError
from drake_aerial.estimation.disturbance_observer import DisturbanceObserver
from drake_aerial.geometry import matrix_from_quat
from drake_aerial.plant.air import AirParameters
from drake_aerial.plant.dryden import Dryden
from drake_aerial.plant.wind import WindParameters
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.simulation.suspended_payload import SuspendedPayload

G, LINK = 9.81, 2e-4
M, m = 0.252, 0.25


def hover(suspension, seconds=12.0, controller="geometric", parameters=None, **options):
    parameters = parameters or StationParameters(noise=0.0)
    trajectory = HoverTrajectory(hover_time=seconds)
    return Flight(
        suspension,
        FlightOptions(
            belief="true",
            controller=controller,
            trajectory=trajectory,
            parameters=parameters,
            **options,
        ),
    ).run()


def rotor_drag(thrust, speed):
    """Rotor drag (x, z) of wind along x, across a thrust in the x-z plane."""
    z = thrust / np.linalg.norm(thrust)
    return 0.465 * m * speed * (np.array([1.0, 0.0]) - z[0] * z)


def test_a_constant_wind_deflects_the_payload_as_statics_predicts(hang):
    wind, air = WindParameters(mean=(1.2, 0.0, 0.0)), AirParameters(added_mass=0.0)
    result = hover(hang(), 25.0, parameters=StationParameters(noise=0.0, air=air, wind=wind))
    assert result.metrics["outcome"] == "completed"
    s = result.series
    assert np.ptp(s["payload_position"][-200:], axis=0).max() < 2e-3
    assert s["wind"] == pytest.approx(np.tile([1.2, 0.0, 0.0], (len(s["time"]), 1)))

    # All in the x-z plane. The wind pushes on the box's centre, the cable pulls on the contact
    # above it: the box hangs along the cable, tilted by a about y, its faces too.
    faces = 0.5 * 1.225 * 1.05 * np.array([0.61 * 0.28, 0.68 * 0.61])

    def drag(a):
        to_world = np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]])
        return to_world @ (1.2 * faces * (to_world.T @ [1.2, 0.0]))

    def along_the_cable(a):
        x, z = np.array([0.0, M * G]) - drag(a[0])
        return x * np.cos(a[0]) - z * np.sin(a[0])

    a = fsolve(along_the_cable, 0.0)[0]
    pull = drag(a) - [0.0, M * G]  # T xi
    tension, xi = np.linalg.norm(pull), pull / np.linalg.norm(pull)
    thrust = rest = np.array([0.0, (m + LINK) * G]) - pull
    for _ in range(20):
        thrust = rest - rotor_drag(thrust, 1.2)
    assert abs(a) > np.deg2rad(2.0)
    assert s["tilt"][-1] == pytest.approx(abs(a), abs=2e-3)
    assert s["tension"][-1, 0] == pytest.approx(tension, rel=1e-3)
    assert s["thrust"][-1, 0] == pytest.approx(np.linalg.norm(thrust), rel=1e-3)
    gap = (s["contact_position"][-1, 0] - s["quadrotor_position"][-1, 0])[[0, 2]]
    assert gap / np.linalg.norm(gap) == pytest.approx(xi, abs=2e-3)

    # The law has no integral: it makes this thrust only where position errors ask for it.
    def law(e):
        wish = np.array([1.45 * e[0], 3.0 * e[1] + G])
        carried = 1.225 * 0.68 * 0.61 * 0.28  # has inertia and no weight
        mu = (M + carried) * wish - [0.0, carried * G]
        aim, across = -mu / np.linalg.norm(mu), np.array([xi[1], -xi[0]])
        turn = -16.0 * 0.5 * (aim @ across)  # the quadrotor goes against the way its cable turns
        along = xi * (xi @ (mu + m * wish))
        return along + across * (m * (across @ wish) + m * turn) - thrust

    expected = fsolve(law, np.zeros(2))
    error = (s["reference_position"][-1] - s["payload_position"][-1])[[0, 2]]
    assert abs(expected[0]) > 0.1
    assert error == pytest.approx(expected, abs=5e-3)


@pytest.mark.parametrize(
    "contacts", [[[0.0, 0.0, 0.14]], [[-0.2, -0.25, 0.14], [0.3, 0.0, 0.14], [-0.1, 0.25, 0.14]]]
)
def test_with_a_disturbance_observer_wind_leaves_no_offset(box, contacts):
    # Statics of the whole: the thrusts carry all weight and wind forces, whatever the cables do.
    speed = 1.0
    wind = WindParameters(mean=(speed, 0.0, 0.0))
    suspension = SuspendedPayload.from_contacts(
        box, np.array(contacts), np.tile([0.0, 0.0, 1.0], (len(contacts), 1))
    )
    options = {"observer": DisturbanceObserver()}
    parameters = StationParameters(noise=0.0, wind=wind)
    result = hover(suspension, 10.0, "mpc", parameters, controller_options=options)
    assert result.metrics["outcome"] == "completed"
    s, n = result.series, len(contacts)
    error = np.linalg.norm(s["reference_position"] - s["payload_position"], axis=1)
    assert error.max() > 0.02  # it comes as a surprise
    assert error[-100:].max() < 0.005
    if n == 3:  # level: the faces that the wind meets are the box's own
        drag = np.array([0.5 * 1.225 * speed**2 * 1.05 * 0.61 * 0.28, 0.0, 0.0])
        z = matrix_from_quat(s["quadrotor_quaternion"][-1])[:, :, 2]
        drag += 0.465 * m * speed * (n * np.eye(3)[0] - z.T @ z[:, 0])
        total = (s["thrust"][-1][:, None] * z).sum(0)
        weight = [0.0, 0.0, (0.25 + n * (0.002 + m + LINK)) * G]
        assert total == pytest.approx(weight - drag, abs=0.01)


@pytest.mark.parametrize("ratio", [0.8, 1.25])
def test_a_wrong_mass_costs_height(hang, ratio):
    # (M_b + m)(g + k e) = (M + m) g, k = 3 1/s^2.
    result = hover(hang(), 15.0, mass_ratio=ratio)
    believed = ratio * 0.25 + 0.002
    expected = G * ((M + m + LINK) / (believed + m) - 1.0) / 3.0
    error = result.series["reference_position"][-1] - result.series["payload_position"][-1]
    assert abs(expected) > 0.2
    assert error == pytest.approx([0.0, 0.0, expected], abs=2e-3)
    assert result.metrics["configuration"]["mass_ratio"] == ratio
    assert result.metrics["slack_fraction"] == 0.0


def test_a_mass_ratio_of_zero_is_refused(hang):
    with pytest.raises(InputError, match=r"`mass_ratio` must be > 0, got 0\.0"):
        hover(hang(), mass_ratio=0.0)


@pytest.mark.parametrize("controller", ["mpc", "geometric_ff"])
def test_a_flight_with_slow_motors_in_a_gust_completes_and_repeats(hang, quick, controller):
    turbulence = Dryden((0.2, 0.2, 0.1), (1.0, 1.0, 1.0))
    wind = WindParameters(mean=(0.5, 0.0, 0.0), gust=(0.0, 1.0, 0.0), turbulence=turbulence)
    parameters = StationParameters(wind=wind, motor_lag=0.02)
    flight = Flight(
        hang(),
        FlightOptions(
            belief="true", controller=controller, trajectory=quick, parameters=parameters
        ),
    )
    first, other, again = (flight.run(seed) for seed in (1, 2, 1))
    assert first.metrics["outcome"] == other.metrics["outcome"] == "completed"
    for name, value in first.series.items():
        assert (value == again.series[name]).all(), name
    assert (first.series["payload_position"] != other.series["payload_position"]).any()
    assert first.series["wind"].shape == first.series["payload_position"].shape
    assert (first.series["wind"] != other.series["wind"]).any()
    assert first.metrics["configuration"]["station"]["wind"]["gust"] == [0.0, 1.0, 0.0]


def test_slow_motors_start_at_the_speed_that_carries(hang):
    parameters = StationParameters(noise=0.0, motor_lag=0.03)
    result = hover(hang(), 1.0, "mpc", parameters)
    assert "wind" not in result.series
    assert result.series["thrust"][0, 0] == pytest.approx((M + m) * G, rel=1e-6)
    assert result.metrics["position_max_m"] < 0.01


def test_lead_compensation_flies_slow_motors(hang, quick):
    led = (
        Flight(
            hang(),
            FlightOptions(
                belief="true", trajectory=quick, parameters=StationParameters(motor_lag=0.05)
            ),
        )
        .run(1)
        .metrics
    )
    assert led["outcome"] == "completed"
    assert (
        led["position_rmse_m"] < 0.007
    )  # what the MPC must keep with prompt motors and this noise


def test_without_lead_compensation_slow_motors_lose_the_payload(hang, quick):
    parameters = StationParameters(motor_lag=0.05, motor_lead=False)
    assert (
        Flight(hang(), FlightOptions(belief="true", trajectory=quick, parameters=parameters))
        .run(1)
        .metrics["outcome"]
        == "crashed"
    )
