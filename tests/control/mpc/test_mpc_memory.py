import numpy as np
import pytest

from drake_aerial.control.controller_parameters import MpcParameters
from drake_aerial.control.mpc.mpc_memory import MpcMemory
from drake_aerial.control.mpc.payload_mpc import PayloadMpc
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.disturbance_observer import DisturbanceObserver, ObserverMemory


@pytest.mark.parametrize("observer", [0, 28])
def test_a_memory_comes_back_from_its_vector(observer):
    N, n = 5, 3
    size = MpcMemory.size(N, n, observer)
    values = np.random.default_rng(0).normal(size=size)
    memory = MpcMemory.unpack(values, N, n)
    np.testing.assert_array_equal(memory.pack(), values)
    assert memory.inputs.shape == (N, 3 * n)
    assert memory.states.shape == (N + 1, 18 + 9 * n)
    assert len(memory.observer) == observer
    names = ("begun", "iterations", "active_bounds", "prediction_error", "correction")
    assert [getattr(memory, name) for name in names] == values[:5].tolist()


def test_a_counted_step_is_one_more_in_age():
    values = np.arange(float(MpcMemory.size(5, 3, 0)))
    before = MpcMemory.unpack(values.copy(), 5, 3)
    assert MpcMemory.count_step(values) == (before.begun, before.age + 1.0)
    after = MpcMemory.unpack(values, 5, 3)
    np.testing.assert_array_equal(after.pack(), before._replace(age=before.age + 1.0).pack())


def test_an_observer_adds_its_memory():
    model = PayloadModelParameters(0.25, np.diag([0.006, 0.0059, 0.0107]), np.eye(3))
    plain = PayloadMpc(model)
    observing = PayloadMpc(model, MpcParameters(observer=DisturbanceObserver()))
    sizes = [c.CreateDefaultContext().num_total_states() for c in (plain, observing)]
    assert sizes[1] - sizes[0] == ObserverMemory.size(3)
