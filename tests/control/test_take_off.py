import numpy as np
import pytest

from drake_aerial.control.take_off import FlightPhase, TakeOff, TakeOffMemory
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.observation import Observation
from drake_aerial.references.trajectory import TransportTrajectory
from drake_aerial.statics.gravity import GRAVITY
from tests.control.payload_cases import random_model

INERTIA = np.diag([0.006, 0.0059, 0.0107])
REST = TransportTrajectory().sample(0.0)


def above(model, gap, p=(0.0, 0.0, 0.14), speed=0.0):
    """Everything level, each quadrotor `gap` (n,) above its contact."""
    p = np.asarray(p, float)
    p_WQ = p + model.p_LC + np.outer(np.broadcast_to(gap, model.n), [0.0, 0.0, 1.0])
    down = np.tile([0.0, 0.0, -1.0], (model.n, 1))
    zero = np.zeros((model.n, 3))
    return Observation(
        p, np.zeros(3), np.eye(3), np.zeros(3), p_WQ, zero + [0, 0, speed], -down, down, zero
    )


def phases(model, take_off, story):
    """The phases of a sequence of (time, observation)."""
    memory, found = TakeOffMemory.initial(model.n), []
    for t, observation in story:
        memory = take_off.next_phase(model, memory, t, observation, True)
        found.append(int(memory.phase))
    return found


def test_the_phases_follow_from_the_observations():
    model, take_off = random_model(2), TakeOff()
    l = model.cable_length
    story = [
        (0.0, above(model, l - 0.1)),
        (0.1, above(model, l - [0.1, 0.0])),  # one of two is taut: not enough
        (0.2, above(model, l, speed=0.4)),  # taut but still rising: wait
        (0.3, above(model, l)),
        (0.4, above(model, l)),
        (0.3 + take_off.ramp_time, above(model, l)),
        (2.0, above(model, l, p=(0.0, 0.0, 0.17))),
        (3.0, above(model, l, p=(0.0, 0.0, 0.20))),
        (4.0, above(model, l - 0.3)),  # slack in flight does not start over
    ]
    T, S, L, F = FlightPhase
    assert phases(model, take_off, story) == [T, T, T, S, S, L, L, F, F]


def test_a_payload_gripped_beside_its_centre_is_lifted_until_it_can_swing_free():
    model = PayloadModelParameters(0.25, INERTIA, [[0.2, 0.0, 0.14]])
    take_off = TakeOff()
    # Rise of the contact over the CoM when the CoM swings below it.
    swing = np.hypot(0.2, 0.14) - 0.14
    assert take_off.swing_height(model) >= swing
    centred = PayloadModelParameters(0.25, INERTIA, [[0.0, 0.0, 0.14]])
    assert take_off.swing_height(centred) == pytest.approx(0.0)


def test_taut_cables_fly_at_once_unless_the_reference_begins_on_the_ground():
    model, take_off = random_model(1), TakeOff()
    observation = above(model, model.cable_length)
    for grounded, expected in ((False, FlightPhase.FLYING), (True, FlightPhase.TIGHTENING)):
        begin = TakeOffMemory.initial(1)
        assert take_off.next_phase(model, begin, 0.0, observation, grounded).phase == expected


def test_a_hanging_payload_is_not_dropped_for_one_noisy_sample():
    model, take_off = random_model(3), TakeOff()
    begin, l = TakeOffMemory.initial(model.n), model.cable_length
    for measured, noise, phase in (
        (0.03, 0.0, FlightPhase.TIGHTENING),  # an exact sensor says that the cables are slack
        (0.03, 0.01, FlightPhase.FLYING),  # three standard deviations do not
        (0.08, 0.01, FlightPhase.TIGHTENING),
    ):
        observation = above(model, l - measured)
        assert take_off.next_phase(model, begin, 0.0, observation, False, noise).phase == phase
        grounded = take_off.next_phase(model, begin, 0.0, observation, True, noise)
        assert grounded.phase == FlightPhase.TIGHTENING


def test_tension_is_taken_over_in_a_ramp():
    model = PayloadModelParameters(0.3, INERTIA, [[-0.1, 0.0, 0.1], [0.3, 0.0, 0.1]])
    take_off = TakeOff(reach=0.0)
    observation = above(model, model.cable_length)
    memory = TakeOffMemory(FlightPhase.TENSIONING, 1.0, observation.p + model.p_LC)
    share = 0.3 * GRAVITY * np.array([0.75, 0.25])  # lever rule
    for fraction in (0.0, 0.5, 1.0):
        t = 1.0 + fraction * take_off.ramp_time
        thrust = take_off.compute_thrusts(model, memory, t, observation, REST, np.zeros(3))
        np.testing.assert_allclose(thrust[:, 2], 0.25 * GRAVITY + fraction * share, rtol=1e-9)
        np.testing.assert_allclose(thrust[:, :2], 0.0, atol=1e-12)


def test_a_slack_cable_is_tightened_at_a_bounded_speed():
    """Point quadrotors under the tightening law reach the end of their cables and stop there."""
    model, take_off = random_model(3), TakeOff()
    gap = model.cable_length - [0.05, 0.3, 0.02]
    observation, fastest, h = above(model, gap), 0.0, 0.01
    for _ in range(400):
        memory = TakeOffMemory(FlightPhase.TIGHTENING, 0.0, np.zeros((3, 3)))
        thrust = take_off.compute_thrusts(model, memory, 0.0, observation, REST, np.zeros(3))
        v = observation.v_WQ + h * (thrust / model.quadrotor_mass[:, None] - [0.0, 0.0, GRAVITY])
        fastest = max(fastest, np.abs(v).max())
        observation = observation._replace(v_WQ=v, p_WQ=observation.p_WQ + h * v)
    reached = (observation.p_WQ - observation.p - model.p_LC)[:, 2] - model.cable_length
    np.testing.assert_allclose(reached, take_off.reach, atol=1e-3)
    assert fastest < 0.35


def test_a_memory_comes_back_from_its_vector():
    values = np.arange(8.0)
    memory = TakeOffMemory.unpack(values)
    assert (memory.phase, memory.since, memory.p_WC[1].tolist()) == (0.0, 1.0, [5.0, 6.0, 7.0])
    np.testing.assert_array_equal(memory.pack(), values)
