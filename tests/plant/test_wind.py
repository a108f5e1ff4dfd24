"""Wind: the shapes of gust and turbulence."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput

from drake_aerial.errors import InputError
from drake_aerial.plant.dryden import Dryden
from drake_aerial.plant.wind import Wind, WindParameters


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


@pytest.mark.parametrize(
    "bad",
    [
        {"mean": (1.0, 2.0)},
        {"gust": (np.nan, 0.0, 0.0)},
        {"turbulence": (1.0, 0.0, 0.0)},
        {"gust_duration": 0.0},
    ],
)
def test_impossible_winds_are_refused(bad):
    with pytest.raises(InputError, match=next(iter(bad))):
        WindParameters(**bad)
