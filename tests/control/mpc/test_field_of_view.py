import numpy as np
import pytest

from drake_aerial.control.controller_parameters import MpcParameters
from drake_aerial.control.mpc.field_of_view import view_penalty, view_violation
from drake_aerial.control.mpc.payload_mpc import PayloadMpc
from drake_aerial.dynamics.flatness import reference_table
from drake_aerial.dynamics.payload_model import retract, tangent_basis
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.errors import InputError
from drake_aerial.estimation.observation import PositionFilter
from drake_aerial.references.trajectory import LineTrajectory
from tests.control.light_loop import fly, hanging
from tests.control.payload_cases import random_model, random_state

INERTIA = np.diag([0.006, 0.0059, 0.0107])


def test_a_payload_straight_below_is_as_far_inside_as_can_be():
    model = PayloadModelParameters(0.25, INERTIA, [[0.0, 0.0, 0.14]])
    x = hanging(model, [0.0, 0.0, 1.0])._replace(F=np.array([[[0.0, 0.0, 5.0]]]))
    E = tangent_basis(x.xi)
    assert view_violation(model, x, E, 0.5)[0][0, 0] == pytest.approx(np.cos(0.5) - 1.0)
    tilted = x._replace(F=5.0 * np.array([[[np.sin(0.5), 0.0, np.cos(0.5)]]]))
    assert view_violation(model, tilted, E, 0.5)[0][0, 0] == pytest.approx(0.0, abs=1e-12)
    turned = x._replace(F=5.0 * np.array([[[np.sin(0.8), 0.0, np.cos(0.8)]]]))
    assert view_violation(model, turned, E, 0.5)[0][0, 0] == pytest.approx(
        np.cos(0.5) - np.cos(0.8)
    )


@pytest.mark.parametrize("n", [1, 3])
def test_the_jacobian_agrees_with_differences(n):
    model, x = random_model(n, seed=n), random_state(n, 4, seed=n)
    nx, eps = 12 + 7 * n, 1e-6
    J = view_violation(model, x, tangent_basis(x.xi), 0.4)[1]
    for k in range(nx):
        step = np.zeros((4, nx))
        step[:, k] = eps
        values = [
            view_violation(model, y, tangent_basis(y.xi), 0.4)[0]
            for y in (retract(x, step), retract(x, -step))
        ]
        np.testing.assert_allclose(J[:, :, k], (values[0] - values[1]) / (2 * eps), atol=1e-7)


def test_inside_the_view_nothing_is_penalised():
    violation, J = np.array([[-0.1, 0.2]]), np.random.default_rng(0).normal(size=(1, 2, 26))
    hessian, gradient = view_penalty(violation, J, 3.0)
    np.testing.assert_allclose(hessian[0], 3.0 * np.outer(J[0, 1], J[0, 1]))
    np.testing.assert_allclose(gradient[0], 3.0 * 0.2 * J[0, 1])


def test_a_narrow_view_is_kept_at_the_price_of_tracking():
    """A fast line asks for more tilt against the cable than 10 deg of view allow."""
    model = PayloadModelParameters(0.25, INERTIA, [[0.0, 0.0, 0.14]])
    dash = LineTrajectory(
        displacement=(1.5, 0.0, 0.0),
        line_time=1.6,
        ground_time=0.0,
        lift_time=0.0,
        hover_time=1.0,
        start=(0, 0, 1),
    )
    widest, error = [], []
    for view in (None, np.deg2rad(20.0)):
        parameters = MpcParameters(field_of_view=view, position_filter=PositionFilter(0.0))
        controller = PayloadMpc(model, parameters)
        x = hanging(model, dash.start)._replace(xi=reference_table(model, dash).at([-1.0]).xi)
        log = fly(controller, model, x, dash, 2.4)
        angles = []
        for state in log["x"][15:]:  # the first thrusts set the plant in motion
            violation, _ = view_violation(model, state, tangent_basis(state.xi), 0.0)
            angles.append(np.arccos(1.0 - violation[0, 0]))
        widest.append(np.rad2deg(max(angles)))
        error.append(np.sqrt((log["error"] ** 2).mean()))
    assert widest[0] > 15.0
    assert widest[1] - 10.0 < 0.5 * (
        widest[0] - 10.0
    )  # soft: the cone's edge is given way to, not ignored
    assert error[1] < 0.3


def test_an_impossible_view_is_refused():
    with pytest.raises(InputError, match="field_of_view"):
        PayloadMpc(
            PayloadModelParameters(0.25, INERTIA, [[0.0, 0.0, 0.14]]),
            MpcParameters(field_of_view=4.0),
        )
