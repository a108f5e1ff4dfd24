"""Wind: the shapes of gust and turbulence, and the drag's terminal velocity."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, Multiplexer

from drake_aerial.errors import InputError
from drake_aerial.plant.dryden import Dryden
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.payload_body import add_payload
from drake_aerial.plant.quadrotor import add_quadrotor
from drake_aerial.plant.wind import Wind, WindParameters, connect_wind
from drake_aerial.plant.world import add_plant


def blow(parameters, seconds, seed=0, period=0.01):
    builder = DiagramBuilder()
    wind = builder.AddSystem(Wind(parameters))
    log = LogVectorOutput(wind.get_output_port(), builder, period)
    simulator = Simulator(builder.Build())
    wind.set_seed(wind.GetMyMutableContextFromRoot(simulator.get_mutable_context()), seed)
    simulator.AdvanceTo(seconds)
    found = log.FindLog(simulator.get_context())
    return np.array(found.sample_times()), np.array(found.data().T)


def test_mean_and_gust_add_up_to_a_raised_cosine():
    t, v = blow(
        WindParameters(
            mean=(1.0, 0.0, 0.0), gust=(0.0, 4.0, -2.0), gust_start=1.0, gust_duration=2.0
        ),
        4.0,
    )
    assert v[:, 0] == pytest.approx(1.0)
    assert v[np.isclose(t, 2.0)][0] == pytest.approx([1.0, 4.0, -2.0])
    assert v[np.isclose(t, 1.5)][0] == pytest.approx([1.0, 2.0, -1.0])
    assert not v[(t < 1.0) | (t > 3.0), 1:].any()


def test_turbulence_is_as_strong_from_the_first_instant_on():
    calm = Dryden((1.0, 1.0, 1.0), (1.0, 2.0, 3.0))
    first = np.array(
        [blow(WindParameters(turbulence=calm), 0.004, seed, 0.002)[1][1] for seed in range(150)]
    )
    assert first.std(axis=0) == pytest.approx([1.0, 1.0, 1.0], rel=0.2)


def test_a_seed_is_a_wind():
    gusty = WindParameters(turbulence=Dryden((1.0, 1.0, 1.0), (0.5, 0.5, 0.5)))
    a, b, c = (blow(gusty, 1.0, seed)[1] for seed in (1, 1, 2))
    assert a.tobytes() == b.tobytes()
    assert not (a[5:] == c[5:]).any()


def test_turbulence_turns_with_the_mean_wind():
    # The same noise in every case: along and across turn with the heading, up stays.
    turbulence = Dryden((1.0, 0.5, 0.2), (0.5, 0.6, 0.7))
    east, other = (
        WindParameters(mean=mean, turbulence=turbulence)
        for mean in ((2.0, 0.0, 0.3), (-1.2, 1.6, 0.3))
    )
    a = blow(east, 1.0, 5)[1] - east.mean
    b = blow(other, 1.0, 5)[1] - other.mean
    turn = np.array([[-0.6, -0.8, 0.0], [0.8, -0.6, 0.0], [0.0, 0.0, 1.0]])
    assert b == pytest.approx(a @ turn.T, abs=1e-12)
    still = blow(WindParameters(turbulence=turbulence), 1.0, 5)[1]
    assert still == pytest.approx(a, abs=1e-12)


def test_drag_carries_everything_along_at_the_pace_of_its_law():
    # m v' = -c v^2 for the speed relative to the air: v = v0 / (1 + c v0 t / m).
    builder = DiagramBuilder()
    plant, _ = add_plant(builder, 0.001)
    box = Payload.from_box([0.4, 0.3, 0.2], 0.25)
    payload, quadrotor = add_payload(plant, box), add_quadrotor(plant)
    plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
    plant.Finalize()
    states = builder.AddSystem(Multiplexer([13]))
    builder.Connect(plant.get_state_output_port(quadrotor.model_instance), states.get_input_port(0))
    parameters = WindParameters(mean=(0.0, 6.0, 0.0))
    payload_state = plant.get_state_output_port(payload.model_instance)
    _, forces = connect_wind(
        builder, plant, payload, [quadrotor], payload_state, states.get_output_port(), parameters
    )
    builder.Connect(forces, plant.get_applied_spatial_force_input_port())
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    q = plant.GetPositions(context, quadrotor.model_instance)
    q[4:7] = [5.0, 0.0, 0.0]
    plant.SetPositions(context, quadrotor.model_instance, q)
    simulator.AdvanceTo(2.0)
    for body, c_A in ((payload, 1.05 * 0.4 * 0.2), (quadrotor, 0.01)):
        velocity = plant.GetVelocities(context, body.model_instance)
        expected = 6.0 - 6.0 / (1.0 + 0.5 * 1.225 * c_A * 6.0 * 2.0 / 0.25)
        assert velocity == pytest.approx([0, 0, 0, 0, expected, 0], abs=3e-3)


@pytest.mark.parametrize(
    "bad",
    [
        {"mean": (1.0, 2.0)},
        {"gust": (np.nan, 0.0, 0.0)},
        {"turbulence": (1.0, 0.0, 0.0)},
        {"gust_duration": 0.0},
        {"payload_drag": -0.1},
    ],
)
def test_impossible_winds_are_refused(bad):
    with pytest.raises(InputError, match=next(iter(bad))):
        WindParameters(**bad)
