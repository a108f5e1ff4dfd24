"""Infeasible set-ups are rejected before the simulation with the reason, unless forced."""

import json
from dataclasses import replace

import numpy as np
import pytest

from drake_aerial.cli import main
from drake_aerial.contacts.feasibility.reasons import Reason
from drake_aerial.contacts.solutions import ContactSolutions, Solution
from drake_aerial.errors import InputError, JobError
from drake_aerial.geometry import Pose
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.quadrotor import QuadrotorParameters
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.suspended_payload import SuspendedPayload
from drake_aerial.simulation.trial import fly, prepare_flight
from drake_aerial.statics.gravity import GRAVITY

TRIANGLE = np.array([[-0.1, -0.2, 0.14], [0.15, 0.0, 0.14], [-0.1, 0.2, 0.14]])
ONE_SIDE = TRIANGLE + [0.15, 0.0, 0.0]  # the box's centre is 5 cm outside
HOVER = HoverTrajectory(hover_time=1.0)


def solutions(*formations, reasons=()):
    found = []
    for rank, p in enumerate(formations, 1):
        q, normal = (
            np.tile([1.0, 0.0, 0.0, 0.0], (len(p), 1)),
            np.tile([0.0, 0.0, 1.0], (len(p), 1)),
        )
        found.append(
            Solution(
                rank,
                0.0,
                not reasons,
                tuple(map(Reason.from_text, reasons)),
                Pose(p, q),
                normal,
                Pose(p + [0, 0, 0.5], q),
            )
        )
    cloud = {"path": None, "sha256": "", "points": 0, "dropped_points": 0, "centroid": [0, 0, 0]}
    return ContactSolutions("task", 0, "formation", cloud, {}, tuple(found))


def prepare(p, **options):
    suspension = SuspendedPayload.from_contacts(
        Payload.read("box_68x61x28"), p, np.tile([0.0, 0.0, 1.0], (len(p), 1))
    )
    return Flight(suspension, FlightOptions(controller="geometric", trajectory=HOVER, **options))


def test_a_solution_marked_infeasible_is_refused_with_its_reasons():
    contacts = solutions(
        TRIANGLE, reasons=("gripper 2: off the surface", "quadrotors 1 and 3 too close")
    )
    with pytest.raises(
        JobError,
        match=r"solution 1 .*gripper 2: off the surface; quadrotors 1 and 3 too close;.*--force",
    ):
        prepare_flight(contacts, payload="box_68x61x28")
    assert (
        prepare_flight(contacts, payload="box_68x61x28", force=True).configuration["forced"] is True
    )


@pytest.mark.parametrize("inside", [0.005, -0.005])
def test_contacts_on_one_side_of_the_true_centre_of_mass_are_refused(inside):
    # Two contacts between x = inside - 0.3 and inside, three with an edge there; the centre of
    # mass is at x = 0.
    for shape in ([[-0.3, 0.0], [0.0, 0.0]], [[-0.3, 0.0], [0.0, -0.2], [0.0, 0.2]]):
        p = np.array([[x + inside, y, 0.14] for x, y in shape])
        if inside > 0.0:
            prepare(p, belief="below_contact")
        else:
            with pytest.raises(JobError, match="all contacts on one side of the centre of mass"):
                prepare(p, belief="below_contact")
            prepare(p, force=True)


def test_the_payloads_own_centre_of_mass_counts():
    box = Payload.read("box_68x61x28")
    shifted = replace(box, com=box.com + [0.2, 0.0, 0.0])
    fly(
        solutions(ONE_SIDE),
        payload=shifted,
        controller="geometric",
        trajectory=HOVER,
        belief="true",
    )
    with pytest.raises(JobError, match="one side"):
        fly(solutions(ONE_SIDE), payload=box, controller="geometric", trajectory=HOVER)


def test_a_quadrotors_share_of_the_load_must_not_exceed_its_spare_thrust():
    # On two cables 0.1 and 0.3 m from the centre, three quarters of the weight are the near one's.
    p = np.array([[-0.1, 0.0, 0.14], [0.3, 0.0, 0.14]])
    quadrotor = QuadrotorParameters()
    spare = quadrotor.thrust_limits[1] - GRAVITY * (quadrotor.mass + 2e-4)
    heaviest = (spare / (0.75 * GRAVITY)) - 0.004  # less two grippers', nearly
    for mass, refused in ((0.99 * heaviest, False), (1.01 * heaviest, True)):
        box = Payload.from_box([0.68, 0.61, 0.28], mass)
        suspension = SuspendedPayload.from_contacts(box, p, [[0.0, 0.0, 1.0]] * 2)
        if refused:
            with pytest.raises(
                JobError, match=r"gripper 1: more tension than the propellers lift \(4\.[67] N"
            ):
                Flight(suspension, FlightOptions(trajectory=HOVER))
            Flight(suspension, FlightOptions(trajectory=HOVER, force=True))
        else:
            Flight(suspension, FlightOptions(trajectory=HOVER))
    heavy = Payload.from_box([0.68, 0.61, 0.28], 1.2)
    with pytest.raises(InputError, match=r"14\.1\d N at most"):
        Flight(
            SuspendedPayload.from_contacts(heavy, p, [[0.0, 0.0, 1.0]] * 2),
            FlightOptions(trajectory=HOVER),
        )


def test_too_heavy_a_payload_flies_by_force_and_never_leaves_the_ground(quick):
    heavy = Payload.from_box([0.68, 0.61, 0.28], 0.6)
    result = fly(
        solutions([[0.0, 0.0, 0.14]]),
        payload=heavy,
        controller="geometric",
        trajectory=quick,
        force=True,
    )
    assert result.outcome in ("diverged", "crashed")
    assert result.series["payload_position"][:, 2].max() < 0.2


@pytest.mark.parametrize("controller", ["mpc", "geometric_ff", "geometric"])
def test_the_command_refuses_one_side_and_records_how_it_ends_by_force(
    controller, tmp_path, capsys
):
    contacts, out = tmp_path / "contacts.json", tmp_path / "out"
    solutions(ONE_SIDE).write(contacts)
    arguments = [
        "fly",
        contacts,
        "--payload",
        "box_68x61x28",
        "--controller",
        controller,
        "--belief",
        "true",
    ]
    arguments = [str(argument) for argument in [*arguments, "--out", out]]
    assert main(arguments) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "all contacts on one side of the centre of mass" in said
    assert "--force" in said
    assert not out.exists()

    assert main([*arguments, "--force"]) == 1
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["outcome"] in ("crashed", "diverged", "dropped")
    assert metrics["outcome_reason"]
    assert metrics["configuration"]["forced"] is True
    assert (out / "trial.npz").is_file()
    said = capsys.readouterr().err.splitlines()
    assert said[0].startswith("flown by force, although the path leaves cable ")
    assert "that contact is not simulated" in said[-1]
