"""The sensor: its rate, its noise, its cable directions."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput

from drake_aerial import geometry
from drake_aerial.errors import InputError
from drake_aerial.estimation.state_sensor import StateSensor
from drake_aerial.plant.cable_geometry import contact_offsets
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.payload_body import add_payload
from drake_aerial.plant.quadrotor import add_quadrotor
from drake_aerial.plant.world import add_plant
from drake_aerial.references.trajectory import TransportTrajectory
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.simulation.suspended_payload import SuspendedPayload

RNG = np.random.default_rng(0)
P_LC = RNG.normal(size=(2, 3))


def random_state(rng):
    return np.concatenate([geometry.random_rotation(rng), rng.normal(size=9)])


PAYLOAD = random_state(RNG)
QUADROTORS = np.concatenate([random_state(RNG) + np.eye(1, 13, 6)[0] * 3 for _ in range(2)])
QUADROTORS[[0, 1, 2, 3]] = [1, 0, 0, 0]
QUADROTORS[[13, 14, 15, 16]] = [1, 0, 0, 0]


def sampled(seed=0, duration=1.0, period=0.001, **options):
    builder = DiagramBuilder()
    sensor = builder.AddSystem(StateSensor(P_LC, **options))
    for name, value in (("payload_state", PAYLOAD), ("quadrotor_states", QUADROTORS)):
        source = builder.AddSystem(ConstantVectorSource(value))
        builder.Connect(source.get_output_port(), sensor.GetInputPort(name))
    names = ("payload_state", "quadrotor_states", "cable_directions")
    logs = [LogVectorOutput(sensor.GetOutputPort(name), builder, period) for name in names]
    simulator = Simulator(builder.Build())
    sensor.set_seed(sensor.GetMyMutableContextFromRoot(simulator.get_mutable_context()), seed)
    simulator.AdvanceTo(duration)
    context = simulator.get_context()
    return logs[0].FindLog(context).sample_times(), [log.FindLog(context).data().T for log in logs]


def test_it_samples_at_its_rate_and_holds():
    times, (payload, _, _) = sampled(period=0.001, duration=0.4)
    position = payload[(times > 0.0005), 4:7]
    changes = np.flatnonzero(np.abs(np.diff(position, axis=0)).max(axis=1) > 0)
    assert np.diff(changes) == pytest.approx(np.full(len(changes) - 1, 20))


def test_noise_is_on_the_position_alone_and_has_its_size():
    _, (payload, quadrotors, _) = sampled(duration=60.0, period=0.02, noise=0.01)
    payload, quadrotors = payload[2:], quadrotors[2:]
    noise = payload[:, 4:7] - PAYLOAD[4:7]
    assert noise.std(axis=0) == pytest.approx(np.full(3, 0.01), rel=0.06)
    assert noise.mean(axis=0) == pytest.approx(np.zeros(3), abs=0.001)
    correlation = np.mean(noise[1:] * noise[:-1], axis=0) / 1e-4
    assert correlation == pytest.approx(np.zeros(3), abs=0.08)
    other = np.delete(payload, [4, 5, 6], axis=1)
    assert (other == np.delete(PAYLOAD, [4, 5, 6])).all()
    assert (quadrotors == QUADROTORS).all()


def test_seeds():
    first, again, other = (sampled(seed)[1][0] for seed in (3, 3, 4))
    assert (first == again).all()
    assert np.abs(first[30:, 4:7] - other[30:, 4:7]).min(axis=0).max() > 0
    assert (sampled(noise=0.0)[1][0][2:] == PAYLOAD).all()


def test_directions_and_rates_agree_with_finite_differences():
    _, (_, _, directions) = sampled(duration=0.1)
    directions = directions[-1].reshape(-1, 6)
    h = 1e-6

    def xi(dt):
        # First-order motion of the bodies, written out independently of the system.
        R = geometry.matrix_from_quat(PAYLOAD[:4])
        spin = geometry.matrix_from_quat(geometry.quat_exp(PAYLOAD[7:10] * dt))
        contacts = PAYLOAD[4:7] + PAYLOAD[10:13] * dt + (spin @ R @ P_LC.T).T
        q = QUADROTORS.reshape(-1, 13)
        p = contacts - q[:, 4:7] - q[:, 10:13] * dt
        return p / np.linalg.norm(p, axis=1, keepdims=True)

    assert directions[:, :3] == pytest.approx(xi(0.0))
    assert directions[:, 3:] == pytest.approx((xi(h) - xi(-h)) / (2 * h), abs=1e-6)
    assert np.sum(directions[:, :3] * directions[:, 3:], axis=1) == pytest.approx(
        np.zeros(2), abs=1e-12
    )


def test_inferred_directions_carry_the_positions_noise():
    _, (payload, _, directions) = sampled(duration=0.1, measured_directions=False)
    p = contact_offsets(payload[-1], QUADROTORS, P_LC).p_QC_W
    assert directions[-1].reshape(-1, 6)[:, :3] == pytest.approx(
        p / np.linalg.norm(p, axis=1, keepdims=True)
    )
    assert np.abs(directions[-1] - sampled(duration=0.1)[1][2][-1]).max() > 1e-4


@pytest.mark.parametrize("bad", [{"noise": -0.1}, {"noise": np.nan}, {"period": 0.0}])
def test_bad_parameters_are_refused(bad):
    with pytest.raises(InputError, match=next(iter(bad))):
        StateSensor(P_LC, **bad)


@pytest.mark.parametrize("dt", [0.002, 0.01])
def test_sampled_velocities_are_those_of_the_samples_moment(dt):
    """Free fall: a semi-implicit plant's own velocities are half a step behind its positions."""
    builder = DiagramBuilder()
    plant, _ = add_plant(builder, dt)
    body = add_payload(plant, Payload.from_box([0.3, 0.2, 0.1], 0.5)).body
    quadrotor = add_quadrotor(plant)
    plant.Finalize()
    instances = (body.model_instance(), quadrotor.model_instance)
    sensor = builder.AddSystem(StateSensor([[0.0, 0.0, 0.05]], noise=0.0, time_step=dt))
    for of, instance in zip(("payload", "quadrotor"), instances, strict=True):
        many = "s" if of == "quadrotor" else ""
        builder.Connect(
            plant.get_state_output_port(instance), sensor.GetInputPort(f"{of}_state{many}")
        )
        acceleration = plant.get_generalized_acceleration_output_port(instance)
        builder.Connect(acceleration, sensor.GetInputPort(f"{of}_acceleration{many}"))
    logs = [
        LogVectorOutput(port, builder, 0.02)
        for port in (
            plant.get_state_output_port(instances[0]),
            *(
                sensor.GetOutputPort(f"{k}_state{'s' * (k == 'quadrotor')}")
                for k in ("payload", "quadrotor")
            ),
        )
    ]
    simulator = Simulator(builder.Build())
    context = simulator.get_mutable_context()
    own = plant.GetMyMutableContextFromRoot(context)
    for one, height in ((body, 50.0), (quadrotor.body, 52.0)):
        plant.SetFreeBodyPose(own, one, RigidTransform([0.0, 0.0, height]))
    simulator.AdvanceTo(1.0)
    plain, *samples = (log.FindLog(simulator.get_context()) for log in logs)
    t = plain.sample_times()[5:-1]
    # A parabola through the plant's positions; a sample is logged one period after it was taken.
    z = np.polynomial.Polynomial.fit(t, plain.data()[6, 5:-1], 2)
    assert plain.data()[12, 5:-1] - z.deriv()(t) == pytest.approx(
        np.full(len(t), 0.5 * 9.81 * dt), rel=1e-6
    )
    for log in samples:
        assert log.data()[12, 6:] == pytest.approx(z.deriv()(t), abs=1e-9)


def test_tracking_does_not_depend_on_the_plants_step():
    box = SuspendedPayload.from_contacts(
        Payload.read("box_68x61x28"), [[0.0, 0.0, 0.14]], [[0.0, 0.0, 1.0]]
    )
    turn = TransportTrajectory.airborne(circle_time=6.0, turns=1.0, hover_time=1.0)
    errors = []
    for dt in (0.001, 0.005):
        parameters = StationParameters(time_step=dt, noise=0.0, air=None)
        flight = Flight(box, FlightOptions(belief="true", trajectory=turn, parameters=parameters))
        errors.append(flight.run(seed=3).metrics["circle_position_rmse_m"])
    # With velocities half a step old, a step of five times the length cost millimetres.
    assert np.ptp(errors) < 2e-4
