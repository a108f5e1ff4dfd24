"""Teams of unequal quadrotors, cables and grippers: statics is the oracle."""

from dataclasses import replace

import numpy as np
import pytest

from drake_aerial.errors import InputError
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.gripper import GripperParameters
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.quadrotor import QuadrotorParameters
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.station import make_transport_station
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.simulation.suspended_payload import SuspendedPayload
from drake_aerial.simulation.trial_result import TrialResult

G = 9.81
TRIANGLE = np.array([[-0.1, -0.2, 0.14], [0.25, 0.02, 0.14], [-0.2, 0.2, 0.14]])
SMALL = QuadrotorParameters(mass=0.2, inertia=(4e-4, 4e-4, 7e-4))
LARGE = QuadrotorParameters(
    mass=0.4, inertia=(1.2e-3, 1.1e-3, 2e-3), thrust_coefficient=1.1e-8, arm=0.14, max_rpm=15000
)
TEAM = (QuadrotorParameters(), LARGE, SMALL)
CABLES = tuple(CableParameters(length=length) for length in (0.5, 0.7, 0.6))
GRIPPERS = tuple(GripperParameters(mass=mass) for mass in (0.002, 0.02, 0.005))


def hang(contacts, payload="box_68x61x28"):
    up = np.tile([0.0, 0.0, 1.0], (len(contacts), 1))
    return SuspendedPayload.from_contacts(Payload.read(payload), contacts, up)


def hover(contacts, parameters, seconds=4.0, **options):
    trajectory = HoverTrajectory(hover_time=seconds)
    return Flight(
        hang(contacts),
        FlightOptions(belief="true", trajectory=trajectory, parameters=parameters, **options),
    ).run()


@pytest.mark.parametrize("controller", ["mpc", "geometric_ff"])
@pytest.mark.parametrize("kind", ["inextensible", "elastic"])
def test_each_of_an_unequal_team_hovers_at_its_own_thrust(kind, controller):
    cables = tuple(replace(cable, kind=kind) for cable in CABLES)
    parameters = StationParameters(quadrotor=TEAM, cable=cables, gripper=GRIPPERS, noise=0.0)
    result = hover(TRIANGLE, parameters, controller=controller)
    assert result.metrics["outcome"] == "completed"
    assert result.metrics["position_rmse_m"] < 0.02
    assert result.metrics["slack_fraction"] == 0.0
    s = result.series
    last = s["time"] > 3.0
    distance = np.linalg.norm(s["quadrotor_position"] - s["contact_position"], axis=2)[last].mean(
        axis=0
    )
    assert distance == pytest.approx([0.5, 0.7, 0.6], abs=2e-3)
    # Three vertical cables are statically determinate: one force and two moments of payload and
    # grippers.
    masses = np.array([0.25] + [gripper.mass for gripper in GRIPPERS])
    points = np.vstack([[0.0, 0.0, 0.0], TRIANGLE])
    A = np.vstack([np.ones(3), TRIANGLE[:, 0], TRIANGLE[:, 1]])
    share = np.linalg.solve(
        A, G * np.array([masses.sum(), masses @ points[:, 0], masses @ points[:, 1]])
    )
    link = 2e-4 if kind == "inextensible" else 0.0
    own = G * (np.array([q.mass for q in TEAM]) + link)
    assert np.ptp(share) > 0.3
    assert s["tension"][last].mean(axis=0) == pytest.approx(share, abs=0.02)
    assert s["thrust"][last].mean(axis=0) == pytest.approx(own + share, abs=0.02)


@pytest.mark.parametrize("controller", ["mpc", "geometric_ff"])
def test_two_quadrotors_on_unequal_cables_hover(controller):
    parameters = StationParameters(
        cable=(CableParameters(length=0.4), CableParameters(length=0.8)), noise=0.0
    )
    contacts = np.array([[-0.25, 0.0, 0.14], [0.25, 0.0, 0.14]])
    result = hover(contacts, parameters, controller=controller)
    assert result.metrics["outcome"] == "completed"
    assert result.metrics["position_rmse_m"] < 0.01
    assert result.metrics["tilt_max_rad"] < 0.05
    height = (
        result.series["quadrotor_position"][-1, :, 2] - result.series["contact_position"][-1, :, 2]
    )
    assert height == pytest.approx([0.4, 0.8], abs=5e-3)
    assert result.cable_length == pytest.approx([0.4, 0.8])


def test_an_unequal_team_takes_off_from_the_ground(quick):
    parameters = StationParameters(quadrotor=TEAM, cable=CABLES, gripper=GRIPPERS)
    result = Flight(
        hang(TRIANGLE), FlightOptions(belief="true", trajectory=quick, parameters=parameters)
    ).run()
    assert result.metrics["outcome"] == "completed"
    assert result.metrics["position_rmse_m"] < 0.02
    assert result.metrics["configuration"]["station"]["quadrotor"][1]["mass"] == 0.4


@pytest.mark.parametrize("controller", ["mpc", "geometric_ff"])
def test_the_order_of_the_team_does_not_matter(controller):
    parameters = StationParameters(quadrotor=TEAM, cable=CABLES, gripper=GRIPPERS, noise=0.0)
    order = [2, 0, 1]
    turned = replace(
        parameters,
        quadrotor=[TEAM[i] for i in order],
        cable=[CABLES[i] for i in order],
        gripper=[GRIPPERS[i] for i in order],
    )
    a = hover(TRIANGLE, parameters, 1.0, controller=controller).series
    b = hover(TRIANGLE[order], turned, 1.0, controller=controller).series
    assert b["thrust"] == pytest.approx(a["thrust"][:, order], abs=1e-3)
    assert b["payload_position"] == pytest.approx(a["payload_position"], abs=1e-5)


@pytest.mark.parametrize("n", range(1, 7))
def test_a_result_of_any_team_is_read_back(n, tmp_path):
    angle = 2.0 * np.pi * np.arange(n) / n
    contacts = np.stack([0.25 * np.cos(angle), 0.25 * np.sin(angle), np.full(n, 0.14)], axis=1)
    cables = tuple(CableParameters(length=0.5 + 0.05 * i) for i in range(n))
    result = hover(contacts if n > 1 else [[0.0, 0.0, 0.14]], StationParameters(cable=cables), 0.2)
    assert result.metrics["outcome"] == "completed"
    assert result.series["moment"].shape == (len(result.series["time"]), n, 3)
    result.save(tmp_path)
    loaded = TrialResult.load(tmp_path)
    assert loaded.metrics == result.metrics
    assert loaded.phase_names == result.phase_names
    assert set(loaded.series) == set(result.series)
    for name, value in result.series.items():
        assert (loaded.series[name] == value).all(), name
    for name in ("p_LC", "cable_length", "vertices", "faces"):
        assert (getattr(loaded, name) == getattr(result, name)).all(), name
    assert len(loaded.cable_length) == n


@pytest.mark.parametrize("what", ["quadrotor", "cable", "gripper"])
def test_a_team_of_the_wrong_number_is_refused(box, what):
    given = {"quadrotor": TEAM, "cable": CABLES, "gripper": GRIPPERS}[what]
    with pytest.raises(InputError, match=rf"{what}s must be one for all or 2, .* got 3"):
        make_transport_station(box, TRIANGLE[:2], parameters=StationParameters(**{what: given}))


def test_cables_of_two_kinds_are_refused(box):
    mixed = (CableParameters(), CableParameters("elastic"), CableParameters())
    with pytest.raises(InputError, match="elastic and inextensible"):
        make_transport_station(box, TRIANGLE, parameters=StationParameters(cable=mixed))


def test_a_quadrotor_that_cannot_lift_its_share_is_refused(box):
    # 0.6 kg on two: 2.94 N each at equal arms. The weak one lifts 4.0 N and weighs 2.45 N; the
    # team as a whole has enough thrust.
    weak = replace(QuadrotorParameters(), thrust_coefficient=4.0 / (4 * 16400.0**2))
    team = StationParameters(quadrotor=(weak, LARGE), gripper=GripperParameters(mass=1e-6))
    heavy = Payload.from_box([0.6, 0.3, 0.2], 0.6)
    equal = np.array([[-0.25, 0.0, 0.1], [0.25, 0.0, 0.1]])
    with pytest.raises(
        InputError, match=r"quadrotor 1 of 2 .* 0\.6 kg, 2\.94 N, got 1\.55 N above its own"
    ):
        make_transport_station(heavy, equal, parameters=team)
    # Three times the arm, a quarter of the load, 1.47 N.
    make_transport_station(heavy, equal * [[1.0, 1.0, 1.0], [1 / 3, 1.0, 1.0]], parameters=team)
    hopeless = replace(weak, mass=0.41)
    on_box, pair = equal + [0.0, 0.0, 0.04], replace(team, quadrotor=(hopeless, LARGE))
    with pytest.raises(
        InputError, match=r"quadrotor 1 of 2 must exceed its own weight, 4\.02 N, got 4\.00 N"
    ):
        make_transport_station(box, on_box, parameters=pair)
    # Contacts that cannot hold the payload level are not judged by this check.
    make_transport_station(box, TRIANGLE * [0.2, 1.0, 1.0] + [0.2, 0.0, 0.0])
