"""References in air: equilibria, and open-loop flights of the model that integrate drag."""

from dataclasses import replace

import numpy as np
import pytest

from drake_aerial.dynamics.flatness import ReferenceTable
from drake_aerial.dynamics.payload_model import derivative
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.dynamics.reference_changes import blown
from drake_aerial.plant.air import AirParameters, payload_air
from drake_aerial.plant.payload import Payload
from drake_aerial.references.trajectory import HoverTrajectory, TransportTrajectory
from drake_aerial.statics.gravity import GRAVITY
from tests.dynamics.integration import integrate
from tests.dynamics.test_flatness import INERTIA, THREE, model_state

TWO = [[-0.3, 0.0, 0.05], [0.25, 0.02, 0.1]]
WIND = np.array([4.0, 2.0, 0.3])
STEP = 0.05


def in_air(contacts, com=(0.01, -0.02, -0.03), offset=(0.02, 0.01, 0.0)):
    box = Payload.from_box([0.4, 0.4, 0.2])
    air = payload_air(box.vertices + np.array(offset), box.faces, AirParameters())
    return PayloadModelParameters(0.25, INERTIA, contacts, p_LLcm=com).in_air(air, 0.116)


@pytest.mark.parametrize("contacts", [[[0.05, 0.0, 0.1]], TWO, THREE])
def test_a_hover_in_still_air_is_an_equilibrium_that_carries_what_a_scale_shows(contacts):
    model = in_air(contacts)
    reference = ReferenceTable(model, HoverTrajectory()).at([1.0])
    d = derivative(model, model_state(model, reference), reference.u)
    for value in (d.a, d.dW, d.dw, d.dF):
        np.testing.assert_allclose(value, 0.0, atol=1e-3)
    weight = (0.25 + 0.25 * len(contacts)) * GRAVITY
    np.testing.assert_allclose(reference.F.sum((0, 1)), [0, 0, weight], atol=1e-4)


@pytest.mark.parametrize("contacts", [TWO, THREE])
@pytest.mark.parametrize("how", ["table", "blown"])
def test_a_hover_in_wind_is_an_equilibrium(contacts, how):
    model, t = in_air(contacts), 1.0 + STEP * np.arange(21)
    if how == "table":
        reference = ReferenceTable(model, HoverTrajectory(), WIND).at(t)
    else:
        calm = ReferenceTable(model, HoverTrajectory()).at(t)
        reference = blown(model, 0.0, calm, WIND, STEP)
    d = derivative(model, model_state(model, reference), reference.u, wind=WIND)
    for value in (d.a, d.dW, d.dw):
        np.testing.assert_allclose(value, 0.0, atol=1e-2)


def test_one_cable_in_wind_balances_all_but_the_moment_about_itself():
    model = in_air([[0.0, 0.0, 0.1]], com=(0.0, 0.0, -0.02), offset=(0.0, 0.0, 0.0))
    reference = ReferenceTable(model, HoverTrajectory(), WIND).at([1.0])
    d = derivative(model, model_state(model, reference), reference.u, wind=WIND)
    for value in (d.a, d.dW, d.dw):
        np.testing.assert_allclose(value, 0.0, atol=2e-2)


@pytest.mark.parametrize("wind", [None, WIND])
def test_the_reference_of_three_cables_in_air_is_flown_by_its_own_input(wind):
    """Open loop from the reference's state, integrated by Runge-Kutta; without drag it drifts."""
    model = in_air(THREE)
    table = ReferenceTable(model, TransportTrajectory.airborne(start=(1.0, 0.0, 1.0)), wind)
    begin, h = 4.0, 0.005

    def flown(flown_model):
        x = model_state(flown_model, table.at([begin]))
        for k in range(100):
            u = table.at([begin + (k + 0.5) * h]).u
            x = integrate(flown_model, x, u, h, wind=None if flown_model.air is None else wind)
        return x

    x, end = flown(model), model_state(model, table.at([begin + 100 * h]))
    assert np.linalg.norm(x.p - end.p) < 3e-3
    assert np.abs(x.xi - end.xi).max() < 1e-2
    assert np.linalg.norm(flown(replace(model, air=None)).p - end.p) > 2e-2


def test_a_reference_that_is_blown_is_that_of_the_table_in_the_same_wind():
    model = in_air(THREE)
    trajectory = TransportTrajectory.airborne()
    t = 4.0 + STEP * np.arange(21)
    wanted = ReferenceTable(model, trajectory, WIND).at(t)
    calm = ReferenceTable(model, trajectory).at(t)
    found = blown(model, trajectory.yaw, calm, WIND, STEP)
    assert np.abs(wanted.F - calm.F).max() > 0.3
    np.testing.assert_allclose(found.xi, wanted.xi, atol=2e-3)
    np.testing.assert_allclose(found.F[2:-2], wanted.F[2:-2], atol=5e-2)
    np.testing.assert_allclose(found.w[1:-1], wanted.w[1:-1], atol=3e-2)
