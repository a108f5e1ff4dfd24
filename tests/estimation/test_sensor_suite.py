from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource

from drake_aerial.errors import InputError
from drake_aerial.estimation.sensor_parameters import Measurement, SensorParameters
from drake_aerial.estimation.sensor_suite import SensorSuite
from drake_aerial.geometry import quat_conjugate, quat_exp, quat_log, quat_multiply
from drake_aerial.statics.gravity import GRAVITY

STEP = 0.005
EXACT = SensorParameters(
    **{name: Measurement() for name in SensorParameters.__dataclass_fields__ if name != "level"}
)
TILTED = quat_exp([0.1, -0.2, 0.4])
QUADROTOR = np.concatenate([TILTED, [0.5, -1.0, 2.0], [0.3, 0.2, -0.1], [1.0, 2.0, 3.0]])


class Clock(LeafSystem):
    """A payload whose x is the time, in multiples of the step."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorOutputPort("state", 13, self._calc)

    def _calc(self, context, output):
        state = np.eye(1, 13)[0]
        state[4] = context.get_time()
        output.SetFromVector(state)


def diagram_of(parameters, payload=None, n=1):
    builder = DiagramBuilder()
    suite = builder.AddSystem(SensorSuite(np.zeros((n, 3)), parameters, time_step=STEP))
    source = Clock() if payload is None else ConstantVectorSource(payload)
    builder.Connect(
        builder.AddSystem(source).get_output_port(), suite.GetInputPort("payload_state")
    )
    for name, value in (
        ("quadrotor_states", np.tile(QUADROTOR, n)),
        ("payload_acceleration", np.zeros(6)),
        ("quadrotor_accelerations", np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 2.0], n)),
        ("squared_speeds", np.full(4 * n, 1e8)),
    ):
        constant = builder.AddSystem(ConstantVectorSource(value))
        builder.Connect(constant.get_output_port(), suite.GetInputPort(name))
    return suite, builder.Build()


def read(suite, simulator, port):
    context = suite.GetMyContextFromRoot(simulator.get_context())
    return suite.GetOutputPort(port).Eval(context).copy()


def samples(parameters, port, seed=0, count=2000):
    suite, diagram = diagram_of(parameters, np.eye(1, 13)[0])
    simulator = Simulator(diagram)
    suite.set_seed(suite.GetMyMutableContextFromRoot(simulator.get_mutable_context()), seed)
    simulator.Initialize()
    found = []
    for k in range(count):
        simulator.AdvanceTo(0.01 * k)
        found.append(read(suite, simulator, port))
    return np.array(found)


@pytest.mark.parametrize(
    ("period", "delay"), [(0.01, 0.0), (0.01, 0.015), (0.02, 0.03), (0.005, 0.02)]
)
def test_a_sample_is_read_when_it_is_as_old_as_the_delay(period, delay):
    position = Measurement(period=period, delay=delay)
    suite, diagram = diagram_of(replace(EXACT, payload_position=position))
    simulator = Simulator(diagram)
    simulator.Initialize()
    for k in range(40):
        # A reader comes a little after the events of a step.
        simulator.AdvanceTo(k * STEP + 0.001)
        newest = np.floor((k * STEP - delay) / period + 1e-9) * period
        x = read(suite, simulator, "payload_state")[4]
        assert x == pytest.approx(max(newest, 0.0), abs=1e-12), k


def test_the_noise_has_its_standard_deviation_and_no_memory():
    parameters = replace(EXACT, payload_position=Measurement(noise=0.02))
    error = samples(parameters, "payload_state")[:, 4:7]
    assert error.std(axis=0) == pytest.approx([0.02] * 3, rel=0.06)
    assert np.abs(error.mean(axis=0)).max() < 4 * 0.02 / np.sqrt(len(error))
    after = (error[1:] * error[:-1]).mean(axis=0) / error.var(axis=0)
    assert np.abs(after).max() < 0.1
    assert np.abs(np.corrcoef(error.T) - np.eye(3)).max() < 0.1


def test_the_bias_is_constant_in_a_flight_and_differs_between_seeds():
    parameters = replace(EXACT, quadrotor_position=Measurement(bias=0.05))
    found = []
    for seed in range(200):
        values = samples(parameters, "quadrotor_states", seed, count=3)[:, 4:7]
        assert np.ptp(values, axis=0) == pytest.approx([0.0] * 3, abs=1e-12)
        found.append(values[0] - QUADROTOR[4:7])
    assert np.std(found) == pytest.approx(0.05, rel=0.12)


def test_attitude_errors_are_rotations_about_the_axes_of_the_body():
    parameters = replace(EXACT, quadrotor_attitude=Measurement(noise=0.03))
    q = samples(parameters, "quadrotor_states", count=1000)[:, 0:4]
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, atol=1e-12)
    error = quat_log(quat_multiply(quat_conjugate(TILTED), q))
    assert error.std(axis=0) == pytest.approx([0.03] * 3, rel=0.1)


def test_exact_sensors_measure_the_truth():
    suite, diagram = diagram_of(EXACT, np.eye(1, 13)[0])
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.001)
    state = read(suite, simulator, "quadrotor_states")
    expected = QUADROTOR.copy()
    expected[10:13] += 0.5 * STEP * np.array([1.0, 0.0, 2.0])
    np.testing.assert_allclose(state, expected, atol=1e-12)
    imu = read(suite, simulator, "imu")
    # The accelerometer feels a - g: its length does not depend on the attitude.
    assert np.linalg.norm(imu[0:3]) == pytest.approx(np.hypot(1.0, GRAVITY + 2.0))
    assert np.linalg.norm(imu[3:6]) == pytest.approx(np.linalg.norm(QUADROTOR[7:10]))
    np.testing.assert_allclose(read(suite, simulator, "rotor_speeds"), 1e4)
    xi = read(suite, simulator, "cable_directions")[0:3]
    np.testing.assert_allclose(xi, -QUADROTOR[4:7] / np.linalg.norm(QUADROTOR[4:7]), atol=1e-12)


def test_measured_cable_directions_are_unit_vectors_with_perpendicular_rates():
    parameters = replace(
        EXACT,
        level="cables",
        cable_direction=Measurement(noise=0.02),
        cable_rate=Measurement(noise=0.1),
    )
    found = samples(parameters, "cable_directions", count=1000)
    xi, rate = found[:, 0:3], found[:, 3:6]
    np.testing.assert_allclose(np.linalg.norm(xi, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(np.vecdot(xi, rate), 0.0, atol=1e-12)
    true = -QUADROTOR[4:7] / np.linalg.norm(QUADROTOR[4:7])
    angle = np.arccos(np.clip(xi @ true, -1.0, 1.0))
    # The angle of two independent components has the mean square 2 sigma^2.
    assert np.sqrt((angle**2).mean()) == pytest.approx(np.sqrt(2.0) * 0.02, rel=0.06)


def test_a_seed_gives_the_same_samples_again_and_another_seed_others():
    first, again, other = (
        samples(SensorParameters(), "quadrotor_states", seed, count=20) for seed in (3, 3, 4)
    )
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.0


def test_a_cloned_context_goes_on_alike():
    suite, diagram = diagram_of(SensorParameters())
    simulator = Simulator(diagram)
    simulator.Initialize()
    simulator.AdvanceTo(0.1)
    clone = Simulator(diagram, simulator.get_context().Clone())
    ends = []
    for one in (simulator, clone):
        one.Initialize()
        one.AdvanceTo(0.2)
        ends.append(read(suite, one, "payload_state"))
    np.testing.assert_array_equal(*ends)


@pytest.mark.parametrize(
    ("level", "absent"),
    [
        ("payload", ()),
        ("cables", ("payload_state",)),
        ("vehicles", ("payload_state", "cable_directions")),
    ],
)
def test_each_level_has_the_ports_of_what_it_measures(level, absent):
    suite = SensorSuite(np.zeros((2, 3)), replace(EXACT, level=level), time_step=STEP)
    names = {"payload_state", "quadrotor_states", "cable_directions", "imu", "rotor_speeds"}
    assert {name for name in names if not suite.HasOutputPort(name)} == set(absent)


def test_times_that_are_no_multiples_of_the_time_step_are_refused():
    with pytest.raises(InputError, match=r"`payload_position.delay` must be a multiple of the"):
        SensorSuite(
            np.zeros((1, 3)),
            replace(EXACT, payload_position=Measurement(delay=0.007)),
            time_step=STEP,
        )
