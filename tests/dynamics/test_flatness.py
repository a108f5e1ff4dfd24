import numpy as np
import pytest

from drake_aerial.dynamics.flatness import ReferenceTable
from drake_aerial.dynamics.payload_model import PayloadState, derivative
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.dynamics.reference_changes import disturbed
from drake_aerial.references.trajectory import HoverTrajectory, TransportTrajectory
from drake_aerial.statics.gravity import GRAVITY
from tests.control.payload_cases import random_model
from tests.dynamics.integration import integrate

INERTIA = np.diag([0.006, 0.0059, 0.0107])
THREE = [[-0.154, -0.267, 0.011], [0.308, 0.0, 0.011], [-0.154, 0.267, 0.011]]


def model_state(model, reference):
    W = (reference.omega[:, None] @ reference.R)[:, 0]
    omega_c = np.cross(reference.omega, reference.R @ model.p_LLcm)
    p = reference.p + reference.R @ model.p_LLcm
    return PayloadState(
        p, reference.v + omega_c, reference.R, W, reference.xi, reference.w, reference.F
    )


@pytest.mark.parametrize(
    "contacts",
    [[[0.0, 0.0, 0.14]], [[0.2, 0.0, 0.14]], [[-0.3, 0.0, 0.05], [0.25, 0.02, 0.1]], THREE],
)
def test_hover_is_an_equilibrium_of_the_model(contacts):
    model = PayloadModelParameters(0.25, INERTIA, contacts, p_LLcm=[0.01, -0.02, -0.03])
    reference = ReferenceTable(model, HoverTrajectory(start=(1.0, 2.0, 3.0))).at([1.0])
    d = derivative(model, model_state(model, reference), reference.u)
    for value in (d.a, d.dW, d.dw, d.dF):
        np.testing.assert_allclose(value, 0.0, atol=1e-9)
    assert (d.tension > 0.0).all()
    np.testing.assert_allclose(reference.F.sum((0, 1)), [0, 0, model.weight], atol=1e-9)


@pytest.mark.parametrize(
    "contacts", [[[0.2, 0.0, 0.14]], [[-0.3, 0.0, 0.05], [0.25, 0.02, 0.1]], THREE]
)
def test_hover_under_a_wrench_is_an_equilibrium_of_the_model(contacts):
    model = PayloadModelParameters(0.25, INERTIA, contacts, p_LLcm=[0.01, -0.02, -0.03])
    calm = ReferenceTable(model, HoverTrajectory(start=(1.0, 2.0, 3.0))).at([1.0])
    # One cable makes no moment along itself, nor does any reaction to a moment there.
    wrench = np.array([0.3, -0.2, 0.1, 0.06, -0.05, 0.0 if len(contacts) == 1 else 0.01])
    if len(contacts) == 1:
        a = model.arms[0]
        wrench[3:6] -= a * (a @ wrench[3:6]) / (a @ a)
    reference = disturbed(model, 0.0, calm, wrench)
    x = model_state(model, reference)
    d = derivative(model, x, reference.u, wrench)
    for value in (d.a, d.dW, d.dw, d.dF):
        np.testing.assert_allclose(value, 0.0, atol=1e-9)
    np.testing.assert_allclose(
        reference.F.sum((0, 1)), [0, 0, model.weight] - wrench[:3], atol=1e-9
    )
    np.testing.assert_array_equal(reference.p, calm.p)
    assert np.abs(derivative(model, x, reference.u).dW).max() > 1.0


def test_no_wrench_leaves_the_reference_as_it_is():
    for contacts in ([[0.1, 0.0, 0.14]], [[-0.3, 0.0, 0.05], [0.25, 0.02, 0.1]], THREE):
        model = PayloadModelParameters(0.25, INERTIA, contacts)
        calm = ReferenceTable(model, TransportTrajectory.airborne()).at(np.linspace(0.0, 12.0, 50))
        same = disturbed(model, 0.0, calm, np.zeros(6))
        for name, got, expected in zip(calm._fields, same, calm, strict=True):
            np.testing.assert_allclose(got, expected, atol=2e-3, err_msg=name)


def test_two_cables_share_the_weight_by_the_lever_rule():
    model = PayloadModelParameters(
        0.3, INERTIA, [[-0.1, 0.0, 0.1], [0.3, 0.0, 0.1]], quadrotor_mass=[0.2, 0.4]
    )
    reference = ReferenceTable(model, HoverTrajectory()).at([1.0])
    pull = reference.F[0, :, 2] - model.quadrotor_mass * GRAVITY
    np.testing.assert_allclose(pull, 0.3 * GRAVITY * np.array([0.75, 0.25]), rtol=1e-6)


def test_three_cables_share_the_weight_as_statics_demands():
    contacts = np.array([[0.3, 0.0, 0.1], [-0.1, 0.2, 0.1], [-0.2, -0.25, 0.1]])
    model = PayloadModelParameters(0.3, INERTIA, contacts)
    reference = ReferenceTable(model, HoverTrajectory()).at([1.0])
    pull = reference.F[0, :, 2] - 0.25 * GRAVITY
    levers = np.vstack([np.ones(3), contacts[:, 0], contacts[:, 1]])
    np.testing.assert_allclose(pull, np.linalg.solve(levers, [0.3 * GRAVITY, 0.0, 0.0]), rtol=1e-6)


def test_the_reference_of_three_cables_is_flown_by_its_own_input():
    """Open loop from the reference's state: the model with u_ref stays on the reference."""
    model = PayloadModelParameters(
        0.25, INERTIA, THREE, quadrotor_mass=[0.2, 0.25, 0.3], cable_length=[0.4, 0.5, 0.6]
    )
    table = ReferenceTable(model, TransportTrajectory.airborne(start=(1.0, 0.0, 1.0)))
    begin, h = 4.0, 0.005
    x = model_state(model, table.at([begin]))
    for k in range(100):
        x = integrate(model, x, table.at([begin + (k + 0.5) * h]).u, h)
    end = model_state(model, table.at([begin + 100 * h]))
    assert np.linalg.norm(x.p - end.p) < 2e-3
    assert np.abs(x.xi - end.xi).max() < 5e-3
    assert np.abs(x.F - end.F).max() < 2e-2
    moved = table.at([begin]).p - table.at([begin + 100 * h]).p
    assert np.linalg.norm(moved) > 0.4


@pytest.mark.parametrize(
    ("contacts", "limit"),
    [([[0.0, 0.0, 0.14]], 0.2), ([[-0.3, 0.0, 0.05], [0.25, 0.02, 0.1]], 0.2), (THREE, 0.01)],
)
def test_the_model_accelerates_along_its_reference(contacts, limit):
    model = PayloadModelParameters(0.25, INERTIA, contacts)
    table = ReferenceTable(model, TransportTrajectory.airborne())
    t, h = np.linspace(0.2, 11.8, 300), 0.005
    here, after, before = table.at(t), table.at(t + h), table.at(t - h)
    d = derivative(model, model_state(model, here), here.u)
    np.testing.assert_allclose(d.a, (after.v - before.v) / (2 * h), atol=5e-3)
    dw = (after.w - before.w) / (2 * h)
    assert np.sqrt(((d.dw - dw) ** 2).mean()) < limit
    assert (d.tension > 0.5).all()


def test_unequal_quadrotors_may_come_in_any_order():
    model = random_model(4, seed=2)
    order = [3, 1, 0, 2]
    shuffled = PayloadModelParameters(
        model.mass,
        model.inertia,
        model.p_LC[order],
        model.p_LLcm,
        model.quadrotor_mass[order],
        model.cable_length[order],
        model.thrust_lag[order],
    )
    trajectory = TransportTrajectory.airborne()
    a = ReferenceTable(model, trajectory).at([3.0, 7.0])
    b = ReferenceTable(shuffled, trajectory).at([3.0, 7.0])
    np.testing.assert_allclose(b.u, a.u[:, order], atol=1e-7)
    np.testing.assert_allclose(b.R, a.R, atol=1e-9)
