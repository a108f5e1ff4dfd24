import numpy as np
import pytest

from drake_aerial.dynamics.flatness import ReferenceTable
from drake_aerial.dynamics.path_check import check_path
from drake_aerial.dynamics.path_clearance import cables_inside, surface_distances
from drake_aerial.dynamics.path_demands import force_demands
from drake_aerial.dynamics.path_limits import CarriedPayload, PathLimits
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.plant.triangles import box
from drake_aerial.references.trajectory import (
    HoverTrajectory,
    LineTrajectory,
    TransportTrajectory,
)
from drake_aerial.statics.gravity import GRAVITY

BOX = PayloadModelParameters(0.25, 0.006 * np.eye(3), [[0.0, 0.0, 0.1]])
TRIANGLE = 0.3 * np.array([[1.0, 0.0, 0.3], [-0.5, 0.87, 0.3], [-0.5, -0.87, 0.3]])
NO_MARGIN = PathLimits(thrust_margin=0.0, gripper_margin=0.0)


def of(check, what):
    return next(demand for demand in check.demands if demand.what == what)


def test_at_rest_the_demands_are_those_of_statics():
    model = PayloadModelParameters(0.6, 0.03 * np.eye(3), TRIANGLE, (0.05, 0.0, 0.0))
    carried = CarriedPayload(
        model, np.tile([0.0, 0.0, 1.0], (3, 1)), np.full(3, 20.0), np.full(3, 0.12)
    )
    check = check_path(HoverTrajectory(hover_time=1.0), carried)
    # Vertical forces with the moment about the centre of mass zero: contact 1 is nearest to it.
    arms = TRIANGLE[:, :2] - [0.05, 0.0]
    loads = np.linalg.solve(np.vstack([np.ones(3), arms.T]), [0.6 * GRAVITY, 0.0, 0.0])
    assert of(check, "gripper").value == pytest.approx(loads.max(), rel=1e-6)
    assert of(check, "tension").value == pytest.approx(loads.min(), rel=1e-6)
    assert of(check, "thrust").value == pytest.approx(loads.max() + 0.25 * GRAVITY, rel=1e-6)
    assert of(check, "tilt").value == pytest.approx(0.0, abs=1e-6)
    sides = np.linalg.norm(TRIANGLE - np.roll(TRIANGLE, 1, axis=0), axis=1)
    assert of(check, "distance").value == pytest.approx(sides.min() - 0.24, rel=1e-6)
    assert check.feasible


def test_on_a_steady_circle_the_thrust_is_that_of_a_conical_pendulum():
    turn = TransportTrajectory.airborne(radius=1.0, turns=2.0, circle_time=6.0, timing="constant")
    t = np.linspace(2.5, 3.5, 50)
    table = ReferenceTable(BOX, turn)
    carried = CarriedPayload.of_model(BOX)
    demands = force_demands(carried, NO_MARGIN, t, table.at(t), table.at([-1.0]))
    thrust = next(demand for demand in demands if demand.what == "thrust")
    rate = 2.0 * np.pi / 3.0
    # Payload and cable are one line from the centre of mass to the quadrotor, 0.6 m.
    angle = np.arctan(rate**2 / GRAVITY)
    across = rate**2 * (0.25 + 0.25 * (1.0 - 0.6 * np.sin(angle)))
    assert thrust.value == pytest.approx(np.hypot(across, 0.5 * GRAVITY), rel=2e-3)


def test_a_centre_of_mass_off_the_contact_tilts_the_normal_away_from_the_load():
    model = PayloadModelParameters(0.25, 0.006 * np.eye(3), [[0.0, 0.0, 0.1]], (0.1, 0.0, 0.0))
    carried = CarriedPayload(model, np.array([[0.0, 0.0, 1.0]]), np.array([20.0]), np.array([0.12]))
    pull = of(check_path(HoverTrajectory(hover_time=1.0), carried), "gripper").value
    assert pull == pytest.approx(0.25 * GRAVITY * np.cos(np.pi / 4), rel=1e-6)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"holding_force": np.array([2.0])}, "gripper"),
        ({"limits": PathLimits(tilt=0.05)}, "tilt"),
        ({"limits": PathLimits(tension=0.95)}, "tension"),
        ({"limits": PathLimits(thrust_margin=0.9)}, "thrust"),
    ],
)
def test_each_limit_alone_makes_a_path_impossible(change, what):
    carried = CarriedPayload(
        BOX,
        np.array([[0.0, 0.0, 1.0]]),
        change.get("holding_force", np.array([20.0])),
        np.array([0.12]),
    )
    # It falls by half a metre, so that the cable is relieved.
    way = (0.5, 0.0, -0.5)
    line = LineTrajectory(displacement=way, line_time=2.5, ground_time=0.0, lift_time=0.0)
    assert check_path(line, carried).feasible == ("limits" in change)
    check = check_path(line, carried, change.get("limits"))
    assert [demand.what for demand in check.violations] == [what]
    assert check.violations[0].margin < 0.0
    record = check.to_dict()
    assert not record["feasible"]
    assert record["margins"][what]["unit"] in ("N", "rad")


def test_margins_are_parts_of_what_rest_leaves_of_a_limit():
    # A payload so heavy that rest leaves 0.1 N of the thrust can still be held.
    heavy = PayloadModelParameters((7.07 - 0.1) / GRAVITY - 0.25, 0.006 * np.eye(3), [[0, 0, 0.1]])
    carried = CarriedPayload.of_model(heavy)
    thrust = of(check_path(HoverTrajectory(hover_time=1.0), carried), "thrust")
    assert thrust.kept
    assert thrust.limit == pytest.approx(7.07 - 0.15 * 0.1)
    least = of(check_path(HoverTrajectory(hover_time=1.0), carried), "least thrust")
    assert least.limit == pytest.approx(0.8 + 0.15 * (6.97 - 0.8))


def test_a_velocity_step_is_named_with_its_size_and_time():
    check = check_path(TransportTrajectory(timing="constant"), CarriedPayload.of_model(BOX))
    step = of(check, "velocity step")
    assert not step.kept
    assert step.value == pytest.approx(2.0 * np.pi / 6.0)
    assert step.time == pytest.approx(8.0)
    assert "velocity step of 1.05 m/s at t = 8.00 s" in str(step)


def test_a_cable_that_crosses_the_payload_is_found_and_one_that_leaves_it_is_not():
    vertices, faces = box(np.array([0.4, 0.4, 0.2]))
    contacts = np.array([[0.0, 0.0, 0.1], [0.0, 0.0, 0.1], [0.1, 0.0, -0.1]])
    ends = np.array([[0.0, 0.0, 0.6], [0.3, 0.0, 0.101], [0.1, 0.0, 0.4]])
    assert cables_inside(vertices, faces, contacts, ends).tolist() == [False, False, True]
    assert surface_distances(vertices, faces, ends) == pytest.approx([0.5, 0.1, 0.3], abs=2e-3)


def test_the_clearance_is_the_distance_from_guard_to_surface():
    vertices, faces = box(np.array([0.4, 0.4, 0.2]))
    short = PayloadModelParameters(0.25, 0.006 * np.eye(3), [[0.0, 0.0, 0.1]], cable_length=0.13)
    carried = CarriedPayload(
        short, np.array([[0.0, 0.0, 1.0]]), np.array([20.0]), np.array([0.12]), vertices, faces
    )
    clearance = of(check_path(HoverTrajectory(hover_time=1.0), carried), "clearance")
    assert clearance.value == pytest.approx(0.01, abs=1e-6)
    # Half of the distance at rest is kept where that is less than the limit.
    assert clearance.limit == pytest.approx(0.005, abs=1e-6)
    assert clearance.kept


def test_a_cable_that_crosses_the_payload_is_a_warning():
    vertices, faces = box(np.array([0.4, 0.4, 0.2]))
    # Gripped from below, the cable would have to pass through the box.
    below = PayloadModelParameters(0.25, 0.006 * np.eye(3), [[0.0, 0.1, -0.1]], (0.0, 0.1, -0.2))
    carried = CarriedPayload(
        below, np.array([[0.0, 0.0, -1.0]]), np.array([20.0]), np.array([0.12]), vertices, faces
    )
    check = check_path(HoverTrajectory(hover_time=1.0), carried)
    assert check.feasible
    assert [str(warning) for warning in check.warnings] == [
        "the path pulls cable 1 through the payload at t = 0.00 s"
    ]
