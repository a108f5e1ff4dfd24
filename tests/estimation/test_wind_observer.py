"""Wind observer: it finds wind of any size, and leaves to a force what no wind explains."""

import numpy as np
import pytest

from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.errors import InputError
from drake_aerial.estimation.observation import Observation
from drake_aerial.estimation.wind_observer import WindObserver
from drake_aerial.geometry import cross
from drake_aerial.statics.gravity import GRAVITY
from tests.control.light_loop import hanging
from tests.dynamics.integration import integrate
from tests.dynamics.test_flatness import INERTIA
from tests.dynamics.test_flatness_in_air import THREE, in_air


def observation(model, x):
    p, v = x.p[0] - x.R[0] @ model.p_LLcm, x.v[0] - x.R[0] @ cross(x.W[0], model.p_LLcm)
    arm = x.R[0] @ cross(x.W[0], model.arms).T
    xi_dot = cross(x.w[0], x.xi[0])
    l = model.cable_length[:, None]
    p_C = x.p[0] + model.arms @ x.R[0].T
    z = x.F[0] / np.linalg.norm(x.F[0], axis=1, keepdims=True)
    v_Q = x.v[0] + arm.T - l * xi_dot
    return Observation(p, v, x.R[0], x.W[0], p_C - l * x.xi[0], v_Q, z, x.xi[0], xi_dot)


def observed(truth, belief, wind, seconds):
    """Estimates of a free flight under hover thrust in a wind."""
    observer, x = WindObserver(), hanging(truth, [0.0, 0.0, 1.0])
    memory = np.zeros(WindObserver.size(truth.n))
    thrust = np.zeros((truth.n, 3))
    thrust[:, 2] = truth.weight / truth.n
    x = x._replace(F=thrust[None])
    for _ in range(round(seconds / 0.02)):
        disturbance, memory = observer.advance(belief, memory, observation(belief, x), thrust, 0.02)
        x = integrate(truth, x, thrust[None], 0.01, 2, wind=wind)
    return disturbance


@pytest.mark.parametrize("wind", [(5.0, 0.0, 0.0), (-3.0, 9.0, 0.0), (0.4, 0.2, 0.0)])
@pytest.mark.parametrize("contacts", [[[0.0, 0.0, 0.1]], THREE])
def test_wind_of_any_size_is_found(wind, contacts):
    model = in_air(contacts, com=(0.0, 0.0, 0.0), offset=(0.0, 0.0, 0.0))
    found = observed(model, model, np.array(wind), 1.5)
    assert not found.limited
    np.testing.assert_allclose(found.wind[:2], wind[:2], atol=0.1 * np.linalg.norm(wind) + 0.1)


def test_a_wrong_mass_is_a_vertical_force_and_no_wind():
    truth = in_air(THREE, com=(0.0, 0.0, 0.0), offset=(0.0, 0.0, 0.0))
    belief = PayloadModelParameters(truth.mass + 0.05, truth.inertia, THREE, air=truth.air)
    found = observed(truth, belief, np.zeros(3), 1.5)
    assert found.force[2] == pytest.approx(0.05 * GRAVITY, abs=0.1)
    assert np.abs(found.wind[:2]).max() < 0.2


def test_a_model_without_air_is_refused():
    model = PayloadModelParameters(0.25, INERTIA, [[0.0, 0.0, 0.14]])
    x = hanging(model, [0.0, 0.0, 1.0])._replace(F=np.array([[[0.0, 0.0, model.weight]]]))
    with pytest.raises(InputError, match="needs a model with air"):
        WindObserver().advance(
            model, np.zeros(WindObserver.size(1)), observation(model, x), x.F[0], 0.02
        )
