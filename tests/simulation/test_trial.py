"""Whole short flights: every outcome, the same bytes for the same seed, files, errors."""

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from drake_aerial import read_skill, transfer
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.solutions import ContactSolutions, Solution
from drake_aerial.errors import InputError
from drake_aerial.geometry import Pose
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.gripper import GripperParameters
from drake_aerial.plant.payload import Payload
from drake_aerial.references.trajectory import HoverTrajectory, TransportTrajectory
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.station import StationParameters
from drake_aerial.simulation.suspended_payload import SuspendedPayload
from drake_aerial.simulation.trial import fly, prepare_flight
from drake_aerial.simulation.trial_result import TrialResult


def contacts(*positions, cloud=None):
    UP = np.array([[1.0, 0.0, 0.0, 0.0]])
    solutions = []
    for rank, p in enumerate(positions, 1):
        p = np.array([p], dtype=float)
        normal = np.array([[0.0, 0.0, 1.0]])
        solutions.append(
            Solution(rank, 0.0, True, (), Pose(p, UP), normal, Pose(p + [0, 0, 0.5], UP))
        )
    cloud = {
        "path": None,
        "sha256": "",
        "points": 0,
        "dropped_points": 0,
        "centroid": [0, 0, 0],
        **(cloud or {}),
    }
    return ContactSolutions("task", 0, "flat", cloud, {}, tuple(solutions))


def test_shorter_steps_make_a_stiffer_cable(hang, quick):
    """The solver's limit gives way a little, the less the shorter its step."""
    over = []
    for step in (0.005, 0.002):
        s = (
            Flight(
                hang(),
                FlightOptions(
                    belief="true", trajectory=quick, parameters=StationParameters(time_step=step)
                ),
            )
            .run()
            .series
        )
        over.append(
            np.linalg.norm(s["quadrotor_position"] - s["contact_position"], axis=2).max() - 0.5
        )
    assert over[1] < 1e-4
    assert over[1] < over[0] < 3e-4


@pytest.mark.parametrize("controller", ["mpc", "geometric_ff"])
@pytest.mark.parametrize("cable", ["inextensible", "elastic"])
def test_a_flight_completes(hang, quick, controller, cable):
    parameters = StationParameters(cable=CableParameters(cable))
    result = Flight(
        hang(),
        FlightOptions(
            belief="true", controller=controller, trajectory=quick, parameters=parameters
        ),
    ).run()
    m, s = result.metrics, result.series
    assert (m["outcome"], m["outcome_reason"], m["outcome_time_s"]) == ("completed", "", None)
    assert m["position_rmse_m"] < (0.012 if controller == "mpc" else 0.2)
    assert m["slack_fraction"] == 0.0
    assert list(m["phases"]) == ["ground", "tensioning", "lifting", "approach", "circle", "hover"]
    assert m["phases"]["hover"] == pytest.approx([7.5, 8.5], abs=0.011)
    # The series agree with each other: span and length of a taut cable, thrust and weight.
    assert len(s["time"]) == 851
    gap = np.linalg.norm(s["quadrotor_position"] - s["contact_position"], axis=2)
    assert gap.max() < 0.5 + (3e-4 if cable == "inextensible" else 2e-3)
    assert gap[0] == pytest.approx(0.45, abs=1e-6)
    assert s["thrust"][-50:].mean() == pytest.approx(0.5022 * 9.81, rel=0.01)
    assert s["tension"][-50:].mean() == pytest.approx(0.252 * 9.81, rel=0.01)
    assert (s["tension"][:10] < 0.05).all()
    assert s["com_position"] == pytest.approx(s["payload_position"])
    error = np.linalg.norm(s["payload_position"] - s["reference_position"], axis=1)
    assert np.sqrt(np.mean(error[s["phase"] >= 4] ** 2)) == pytest.approx(m["position_rmse_m"])


@pytest.mark.parametrize("controller", ["mpc", "geometric_ff"])
def test_same_seed_same_bytes_and_another_seed_another_flight(hang, quick, tmp_path, controller):
    short = replace(quick, hover_time=0.0, circle_time=1.0, turns=0.05)
    flight = Flight(
        hang(0.05), FlightOptions(controller=controller, belief="true", trajectory=short)
    )
    first, other, again = (flight.run(seed) for seed in (7, 8, 7))
    fresh = Flight(
        hang(0.05), FlightOptions(controller=controller, belief="true", trajectory=short)
    ).run(7)
    for name, value in first.series.items():
        assert (value == again.series[name]).all(), name
        assert (value == fresh.series[name]).all(), name
    assert (first.series["payload_position"] != other.series["payload_position"]).any()
    for k, result in enumerate((first, again)):
        result.metrics["timing"] = {}
        result.save(tmp_path / str(k))
    for name in ("metrics.json", "trial.npz"):
        assert (tmp_path / "0" / name).read_bytes() == (tmp_path / "1" / name).read_bytes()


@pytest.mark.parametrize("cable", ["inextensible", "elastic"])
def test_a_weak_magnet_drops_the_payload(hang, quick, cable):
    # The ramp passes 2 N while the payload still stands.
    parameters = StationParameters(
        cable=CableParameters(cable), gripper=GripperParameters(holding_force=2.0)
    )
    result = Flight(
        hang(),
        FlightOptions(
            controller="geometric", trajectory=quick, parameters=parameters, path_limits=None
        ),
    ).run()
    assert result.outcome == "dropped"
    assert 0.5 < result.metrics["outcome_time_s"] < 1.5
    assert result.series["time"][-1] == pytest.approx(
        result.metrics["outcome_time_s"] + 0.5, abs=0.03
    )
    assert result.metrics["position_rmse_m"] is None
    assert result.series["payload_position"][:, 2].max() < 0.16


def test_a_crash_is_recorded(hang, quick):
    # The reference sinks through the ground.
    down = replace(quick, lift_height=0.5, approach=(0.2, 0.0, -0.7))
    options = FlightOptions(controller="geometric", trajectory=down, path_limits=None)
    result = Flight(hang(), options).run()
    assert result.outcome == "crashed"
    assert result.metrics["outcome_reason"] == "the payload touched the ground"
    assert result.series["time"][-1] < 6.0


def test_a_flight_that_runs_away_diverged(hang, quick):
    far = replace(quick, approach=(40.0, 0.0, 0.0))
    options = FlightOptions(controller="geometric", trajectory=far, path_limits=None)
    result = Flight(hang(), options).run()
    assert result.outcome == "diverged"
    assert "m from the reference" in result.metrics["outcome_reason"]
    json.dumps(result.metrics, allow_nan=False)


def test_a_controller_that_fails_does_not_kill_the_process(hang, quick):
    flight = Flight(hang(), FlightOptions(controller="geometric", trajectory=quick))

    def fail(*_):
        raise np.linalg.LinAlgError("singular matrix")

    flight.station.controller.compute_thrusts = fail
    result = flight.run()
    assert (result.outcome, result.metrics["outcome_reason"]) == ("diverged", "singular matrix")
    assert result.series["time"][-1] > 1.0


def test_a_payload_hangs_with_its_centre_of_mass_below_a_bad_contact(hang, quick):
    m = Flight(hang(0.2), FlightOptions(belief="true", trajectory=quick)).run().metrics
    # At rest the centre of mass is straight below the contact; in the box it is 0.14 m below and
    # 0.2 m beside it.
    assert m["outcome"] == "completed"
    assert m["tilt_mean_rad"] == pytest.approx(np.arctan2(0.2, 0.14), abs=0.1)
    assert m["position_rmse_m"] < 0.012


@pytest.mark.parametrize("cable", ["inextensible", "elastic"])
def test_a_reference_in_the_air_starts_in_the_air(hang, cable):
    parameters = StationParameters(cable=CableParameters(cable))
    hover = HoverTrajectory(hover_time=2.0)
    result = Flight(
        hang(0.1), FlightOptions(belief="true", trajectory=hover, parameters=parameters)
    ).run()
    s = result.series
    assert result.outcome == "completed"
    assert list(result.metrics["phases"]) == ["hover"]
    assert s["tilt"][0] == pytest.approx(np.arctan2(0.1, 0.14), abs=0.03)
    assert result.metrics["position_max_m"] < 0.01
    assert np.ptp(s["tilt"]) < 0.05


def test_three_quadrotors_share_the_load(box, quick):
    triangle = np.array([[-0.154, -0.267, 0.14], [0.308, 0.0, 0.14], [-0.154, 0.267, 0.14]])
    suspension = SuspendedPayload.from_contacts(box, triangle, [[0, 0, 1]] * 3)
    m = Flight(suspension, FlightOptions(belief="true", trajectory=quick)).run().metrics
    assert m["outcome"] == "completed"
    assert m["position_rmse_m"] < 0.008
    assert m["attitude_rmse_rad"] < 0.02
    assert m["slack_fraction"] == 0.0


def test_a_flight_from_contacts_json_is_read_back_from_its_files(quick, tmp_path):
    path = tmp_path / "contacts.json"
    contacts([0.0, 0.0, 0.14], [0.1, 0.0, 0.145]).write(path)
    short = replace(quick, hover_time=0.2, circle_time=1.0, turns=0.1)
    seen = []
    result = fly(
        path,
        payload="box_68x61x28",
        solution=2,
        controller="mpc",
        trajectory=short,
        noise=0.0,
        seed=3,
        progress=lambda fraction, what: seen.append(fraction),
    )
    assert result.outcome == "completed"
    assert result.p_LC == pytest.approx(np.array([[0.1, 0.0, 0.14]]))
    assert result.metrics["configuration"]["contacts_moved_m"] == pytest.approx([0.005])
    assert result.metrics["configuration"]["source"]["solution"] == 2
    assert seen == sorted(seen)
    assert len(seen) > 20
    result.save(tmp_path / "out")
    loaded = TrialResult.load(tmp_path / "out")
    assert (
        loaded.metrics
        == result.metrics
        == json.loads((tmp_path / "out" / "metrics.json").read_text())
    )
    assert set(loaded.series) == set(result.series)
    assert (loaded.series["tension"] == result.series["tension"]).all()
    assert loaded.phase_names == result.phase_names
    assert "completed" in loaded.summary()


def test_the_scan_alone_is_enough(quick, tmp_path):
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.5, 0.5, (3000, 3))
    points[np.arange(3000), rng.integers(0, 3, 3000)] = rng.choice([-0.5, 0.5], 3000)
    points *= [0.68, 0.61, 0.28]
    np.save(tmp_path / "scan.npy", points)
    cloud = PointCloud.read(tmp_path / "scan.npy")
    facts = {"path": "scan.npy", "sha256": cloud.sha256, "centroid": cloud.centroid.tolist()}
    path = tmp_path / "contacts.json"
    contacts([0.0, 0.0, 0.14], cloud=facts).write(path)
    flight = prepare_flight(path, mass=0.2, trajectory=quick)
    assert flight.suspended_payload.payload.mass == 0.2
    assert flight.model.p_LLcm[2] == pytest.approx(-cloud.centroid[2], abs=1e-3)
    np.save(tmp_path / "scan.npy", points + 0.1)
    with pytest.raises(InputError, match="not the scan of these contacts"):
        prepare_flight(path, trajectory=quick)
    (tmp_path / "scan.npy").unlink()
    with pytest.raises(InputError, match=r"scan\.npy.*`cloud`, --cloud"):
        prepare_flight(path, trajectory=quick)
    assert prepare_flight(path, cloud=cloud, trajectory=quick).suspended_payload.scan_L.shape == (
        3000,
        3,
    )


def test_the_scan_of_a_transfer_is_flown_from_memory():
    """An array in, transfer, fly: the scan has no file."""
    box = trimesh.creation.box((0.5, 0.4, 0.2))
    points = trimesh.sample.sample_surface(box, 6000, seed=1)[0]
    solutions = transfer(read_skill("flat"), PointCloud.read(points), method="centroid")
    hover = HoverTrajectory(hover_time=0.2)
    flight = prepare_flight(solutions, mass=0.2, trajectory=hover)
    assert flight.suspended_payload.payload.mass == 0.2
    assert flight.suspended_payload.scan_L == pytest.approx(points - points.mean(axis=0))
    assert fly(solutions, mass=0.2, trajectory=hover).outcome == "completed"
    # A payload of its own flies as from contacts.json, which holds no points.
    own = prepare_flight(solutions, payload=Payload.from_box([0.5, 0.4, 0.2]), trajectory=hover)
    assert own.suspended_payload.scan_L is None
    with pytest.raises(InputError, match="do not name a scan file"):
        prepare_flight(replace(solutions, scan=None), mass=0.2, trajectory=hover)


def test_the_scan_beside_contacts_json_is_found_by_its_file_name(tmp_path):
    points = np.random.default_rng(0).uniform(-0.2, 0.2, (2000, 3)) * [1.0, 1.0, 0.5]
    np.save(tmp_path / "scan.npy", points)
    cloud = PointCloud.read(tmp_path / "scan.npy")
    facts = {**cloud.to_record(), "path": "/another/machine/scan.npy"}
    path = tmp_path / "contacts.json"
    contacts([0.0, 0.0, 0.1], cloud=facts).write(path)
    flight = prepare_flight(path, mass=0.2, trajectory="hover")
    assert len(flight.suspended_payload.scan_L) == 2000


@pytest.mark.parametrize("name", ["transport", "circle"])
def test_the_transport_trajectory_is_recorded_by_one_name(name):
    flight = prepare_flight(
        contacts([0.0, 0.0, 0.14]), payload="box_68x61x28", trajectory=name, force=True
    )
    assert flight.configuration["trajectory"]["kind"] == "transport"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"belief": "blind"}, "below_contact, geometric, true"),
        ({"controller": "pid"}, "mpc, geometric_ff, geometric"),
        ({"trajectory": "spiral"}, "spiral"),
        ({"cable": "rope"}, "`cable` must be one of inextensible, elastic"),
        ({"solution": 3}, "`solution` must be one of the ranks 1, got 3"),
        ({"payload": "anvil"}, "box_68x61x28"),
        ({"payload": Payload.from_box([0.68, 0.61, 0.28], 0.5)}, "7.07 N"),
        ({"mass": 0.2}, "only by its scan"),
        ({"noise": -1.0}, "noise"),
    ],
)
def test_bad_input_is_refused_before_anything_flies(options, words):
    with pytest.raises(InputError, match=words):
        fly(contacts([0.0, 0.0, 0.14]), **{"payload": "box_68x61x28", **options})


def test_other_files_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"trial\.npz"):
        TrialResult.load(tmp_path / "trial.npz")
    np.savez(
        tmp_path / "trial.npz",
        metrics=np.array(json.dumps({"schema": "drake_aerial/trial", "version": 99})),
    )
    with pytest.raises(InputError, match="99"):
        TrialResult.load(tmp_path)
    (tmp_path / "trial.npz").write_text("not a trial")
    with pytest.raises(InputError, match="cannot read"):
        TrialResult.load(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(("x", "limit"), [(0.0, 0.008), (0.1, 0.009), (0.2, 0.009)])
def test_the_whole_transport_stays_within_a_centimetre(hang, x, limit):
    flight = Flight(hang(x), FlightOptions(belief="true", trajectory=TransportTrajectory()))
    errors = [flight.run(seed).metrics["position_rmse_m"] for seed in range(3)]
    assert np.mean(errors) < limit
