import copy

import numpy as np
import pytest

from drake_aerial.errors import InputError
from drake_aerial.references.trajectory import (
    HoverTrajectory,
    LineTrajectory,
    TransportTrajectory,
    WaypointTrajectory,
)
from drake_aerial.references.trajectory_files import (
    read_trajectory,
    trajectory_from_dict,
    trajectory_to_dict,
)

ALL = [TransportTrajectory(), HoverTrajectory(), LineTrajectory(), WaypointTrajectory()]


@pytest.mark.parametrize("trajectory", ALL, ids=lambda trajectory: trajectory.name)
def test_each_derivative_is_the_derivative_of_the_one_before(trajectory):
    step = 1e-5
    ends = np.array([phase.end for phase in trajectory.phases])
    t = np.random.default_rng(0).uniform(0.0, trajectory.duration, 200)
    legs = np.arange(0.0, trajectory.duration, 0.5)
    t = t[np.abs(t[:, None] - np.concatenate([ends, legs])).min(axis=1) > 2 * step]
    before, here, after = (trajectory.sample(x) for x in (t - step, t, t + step))
    for k in range(4):
        numeric = (after[k] - before[k]) / (2 * step)
        scale = max(1.0, np.abs(here[k + 1]).max())
        np.testing.assert_allclose(here[k + 1], numeric, atol=1e-6 * scale)


@pytest.mark.parametrize("trajectory", ALL, ids=lambda trajectory: trajectory.name)
def test_position_velocity_and_acceleration_are_continuous(trajectory):
    t = np.arange(-0.5, trajectory.duration + 0.5, 1e-3)
    sample = trajectory.sample(t)
    # Between neighbours the value moves by the next derivative times the step, and by no more.
    for k, bound in ((0, 2.5), (1, 5.0), (2, 25.0)):
        assert np.abs(np.diff(sample[k], axis=0)).max() < bound * 1e-3


def test_transport_visits_what_it_promises():
    trajectory = TransportTrajectory(start=(0.3, -0.2, 0.14))
    assert [phase.name for phase in trajectory.phases] == [
        "ground",
        "lift",
        "approach",
        "circle",
        "hover",
    ]
    circle, hover = trajectory.phase("circle"), trajectory.phase("hover")
    assert circle.end - circle.start == pytest.approx(12.0)
    assert hover.end - hover.start >= 5.0
    first = trajectory.sample(circle.start).p
    np.testing.assert_allclose(first, [1.3, -0.2, 1.14], atol=1e-12)
    t = np.linspace(circle.start, circle.end, 20001)
    p = trajectory.sample(t).p
    np.testing.assert_allclose(np.linalg.norm(p[:, :2] - [0.3, -0.2], axis=1), 1.0, atol=1e-12)
    length = np.linalg.norm(np.diff(p, axis=0), axis=1).sum()
    assert length == pytest.approx(2 * 2 * np.pi, rel=1e-6)
    np.testing.assert_allclose(trajectory.sample(hover.end + 3.0).p, first, atol=1e-12)
    np.testing.assert_allclose(trajectory.sample(0.0).p, [0.3, -0.2, 0.14])


def test_constant_rate_starts_with_a_velocity_step_and_keeps_its_speed():
    trajectory = TransportTrajectory.airborne(timing="constant")
    speed = np.linalg.norm(trajectory.sample(np.linspace(0.0, 11.99, 50)).v, axis=1)
    np.testing.assert_allclose(speed, 2 * np.pi / 6.0, rtol=1e-12)
    assert np.linalg.norm(trajectory.sample(-1e-6).v) == 0.0


def test_sampling_is_vectorised_and_scalar_alike():
    trajectory = TransportTrajectory(yaw=0.7)
    t = np.linspace(0.0, 25.0, 12).reshape(3, 4)
    batch = trajectory.sample(t)
    assert batch.p.shape == (3, 4, 3)
    assert batch.q.shape == (3, 4, 4)
    one = trajectory.sample(float(t[1, 2]))
    for k in range(6):
        np.testing.assert_array_equal(batch[k][1, 2], one[k])
    np.testing.assert_allclose(one.q, [np.cos(0.35), 0, 0, np.sin(0.35)])


def test_a_trajectory_is_a_value():
    trajectory = TransportTrajectory()
    assert copy.deepcopy(trajectory) is trajectory
    assert trajectory == TransportTrajectory()
    moved = trajectory.starting_at([1.0, 2.0, 3.0])
    np.testing.assert_allclose(moved.sample(7.7).p - trajectory.sample(7.7).p, [1.0, 2.0, 3.0])
    with pytest.raises(AttributeError):
        trajectory.radius = 2.0


@pytest.mark.parametrize("trajectory", ALL, ids=lambda trajectory: trajectory.name)
def test_names_and_mappings_read_back(trajectory):
    assert read_trajectory(trajectory.name) == trajectory
    assert trajectory_from_dict(trajectory_to_dict(trajectory)) == trajectory


def test_a_file_is_read_strictly(tmp_path):
    path = tmp_path / "t.yaml"
    path.write_text("kind: transport\nradius: 0.5\ntiming: constant\n")
    assert read_trajectory(path) == TransportTrajectory(radius=0.5, timing="constant")
    for text, expected in [
        ("kind: transport\nradios: 1\n", "did you mean 'radius'"),
        ("kind: transprot\n", "did you mean 'transport'"),
        ("radius: 1\n", "no kind"),
        ("- 1\n", "mapping"),
        ("kind: transport\ntiming: cubic\n", "quintic"),
        ("kind: transport\nradius: wide\n", "`radius` must be a number"),
        ("kind: line\ndisplacement: [1, 2]\n", "three finite numbers"),
        ("kind: hover\nhover_time: -1\n", r"`hover_time` must be in \[0, inf\)"),
        ("kind: waypoints\nwaypoints: []\n", "waypoints"),
        ("kind: waypoints\nleg_times: [1, 2]\n", "`leg_times` must be one number or 3"),
        ("kind: [\n", "YAML"),
    ]:
        path.write_text(text)
        with pytest.raises(InputError, match=expected) as caught:
            read_trajectory(path)
        assert "\n" not in str(caught.value)
        assert str(path) in str(caught.value)
    with pytest.raises(InputError, match="transport, hover, line, waypoints"):
        read_trajectory("spiral")


def test_the_transport_is_also_read_by_the_name_of_earlier_versions():
    assert read_trajectory("circle") == read_trajectory("transport") == TransportTrajectory()


def test_no_step_in_jerk_or_snap_where_legs_meet_but_for_the_circles_own_quintic():
    trajectory = TransportTrajectory()
    ends = {phase.name: phase.end for phase in trajectory.phases}
    for name in ("ground", "lift"):
        before, after = trajectory.sample(np.array([ends[name] - 1e-6, ends[name] + 1e-6])).jerk
        np.testing.assert_allclose(before, after, atol=1e-3)
        before, after = trajectory.sample(np.array([ends[name] - 1e-6, ends[name] + 1e-6])).snap
        np.testing.assert_allclose(before, after, atol=1e-2)
    smooth = TransportTrajectory(timing="smooth")
    before, after = smooth.sample(np.array([ends["approach"] - 1e-6, ends["approach"] + 1e-6])).snap
    np.testing.assert_allclose(before, after, atol=1e-2)
