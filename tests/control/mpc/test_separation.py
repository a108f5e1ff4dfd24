import numpy as np

from drake_aerial.control.mpc.separation import Separation
from drake_aerial.dynamics.payload_model import retract
from tests.control.payload_cases import random_model, random_state


def test_the_violation_is_what_the_quadrotors_miss_of_their_distance():
    model, x = random_model(3, seed=1), random_state(3, 5, seed=1)
    missing, direction = Separation(model, 0.7).violation(x)
    contacts = x.p[:, None] + model.arms @ x.R.mT
    place = contacts - model.cable_length[:, None] * x.xi
    for k, (i, j) in enumerate(((0, 1), (0, 2), (1, 2))):
        gap = place[:, i] - place[:, j]
        size = np.linalg.norm(gap, axis=1)
        np.testing.assert_allclose(missing[:, k], 0.7 - size)
        np.testing.assert_allclose(direction[:, k], gap / size[:, None])


def test_its_jacobian_agrees_with_finite_differences():
    model, x = random_model(3, seed=2), random_state(3, 4, seed=2)
    separation, eps = Separation(model, 0.7), 1e-6
    J = separation.jacobian(x, separation.violation(x)[1])
    for column in range(12 + 7 * 3):
        step = np.zeros((4, 33))
        step[:, column] = eps
        plus, minus = (separation.violation(retract(x, s * step))[0] for s in (1.0, -1.0))
        np.testing.assert_allclose(J[:, :, column], (plus - minus) / (2 * eps), atol=1e-7)
