"""Gradients of every cost and constraint of a contact program, against finite differences."""

import numpy as np
import pytest
from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, ExtractValue, InitializeAutoDiff

from drake_aerial.contacts.likelihood.formation_frame import FormationFrames
from drake_aerial.contacts.refinement.differentiable import Differentiable
from drake_aerial.contacts.refinement.program import ContactProgram
from drake_aerial.contacts.refinement.smooth_surface import SmoothSurface
from drake_aerial.errors import InputError
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import (
    Pose,
    axis_of,
    invert,
    perpendicular,
    quat_exp,
    quat_from_xz,
    quat_multiply,
)
from tests.contacts.formations import learnt_skill, transferred

STEP = 1e-6


def disturbed(X_SG, rng, size=0.02, angle=0.3):
    """Grippers off the surface and tilted, where nothing is at an optimum."""
    n = len(X_SG.p)
    turn = quat_exp(angle * rng.standard_normal((n, 3)))
    return Pose(X_SG.p + size * rng.uniform(-1.0, 1.0, (n, 3)), quat_multiply(turn, X_SG.q))


def program_at(n, rng, **kinds):
    solutions = transferred(n, **kinds)
    skill = learnt_skill(n, kinds.get("axial", True), kinds.get("leaning", False))
    return ContactProgram(skill, solutions.query, disturbed(solutions[0].X_SG, rng))


def point(program, binding, rng):
    """The binding's variables at the initial guess, the quaternions not quite of unit length."""
    x = program.prog().GetInitialGuess(binding.variables())
    return x + 0.02 * rng.standard_normal(len(x)) * (np.arange(len(x)) % 7 >= 3)


def values(function, x):
    return np.atleast_1d(np.asarray(function(x), float))


def differences(function, x):
    columns = [values(function, x + d) - values(function, x - d) for d in STEP * np.eye(len(x))]
    return np.stack(columns, axis=-1) / (2.0 * STEP)


CASES = [
    (1, {}),
    (2, {}),
    (3, {}),
    (1, {"leaning": True}),
    (2, {"leaning": True}),
    (3, {"leaning": True}),
    (1, {"axial": False}),
    (3, {"axial": False, "leaning": True}),
    (3, {"method": "paper"}),
    (1, {"method": "control"}),
]


@pytest.mark.parametrize(("n", "kinds"), CASES, ids=lambda value: str(value))
def test_every_cost_and_constraint_against_finite_differences(n, kinds):
    rng = np.random.default_rng(n)
    for _ in range(2):
        program = program_at(n, rng, **kinds)
        prog = program.prog()
        generic = prog.generic_costs() + prog.generic_constraints()
        assert len(prog.generic_costs()) == n + (
            1 if kinds.get("method") in ("paper", "control") else 2
        )
        assert len(prog.generic_constraints()) == (2 * n if n == 1 else 2 * n + 2)
        for binding in generic:
            name, x = binding.evaluator().get_description(), point(program, binding, rng)
            expected = differences(binding.evaluator().Eval, x)
            y = binding.evaluator().Eval(InitializeAutoDiff(x))
            np.testing.assert_allclose(
                ExtractValue(y)[:, 0],
                values(binding.evaluator().Eval, x),
                rtol=1e-12,
                atol=1e-12,
                err_msg=name,
            )
            scale = max(1.0, np.abs(expected).max())
            np.testing.assert_allclose(
                ExtractGradient(y), expected, rtol=2e-5, atol=2e-6 * scale, err_msg=name
            )


@pytest.mark.parametrize(("n", "kinds"), CASES, ids=lambda value: str(value))
def test_costs_are_the_log_likelihood(n, kinds):
    rng = np.random.default_rng(10 + n)
    program, query = program_at(n, rng, **kinds), transferred(n, **kinds).query
    X_SG = disturbed(transferred(n, **kinds)[0].X_SG, rng)
    x = np.hstack([X_SG.p, X_SG.q]).ravel()
    X_NG = invert(query.scan.X_SN) @ X_SG
    expected = float(query.likelihood(Pose(X_NG.p[None], X_NG.q[None]))[0])
    assert program.log_likelihood(x) == pytest.approx(expected, abs=1e-6)
    prog = program.prog()
    prog.SetInitialGuess(program.gripper_variables(), x)
    total = sum(
        binding.evaluator().Eval(prog.GetInitialGuess(binding.variables()))[0]
        for binding in prog.generic_costs()
    )
    assert total == pytest.approx(-expected, abs=1e-6)
    gradient = program.log_likelihood(InitializeAutoDiff(x)[:, 0]).derivatives()
    numeric = differences(program.log_likelihood, x)[0]
    np.testing.assert_allclose(gradient, numeric, rtol=2e-5, atol=2e-6 * np.abs(numeric).max())


@pytest.mark.parametrize("axial", [True, False])
def test_formation_frames_are_those_of_the_configuration_model(axial):
    configuration, rng = learnt_skill(3, axial=axial).configuration, np.random.default_rng(0)
    for _ in range(5):
        X_NG = disturbed(transferred(3, axial=axial)[0].X_SG, rng, 0.1, 0.5)
        frame = FormationFrames(configuration)(X_NG)
        origin, yaw = configuration.formation_frames(X_NG)
        np.testing.assert_allclose(frame.origin, origin)
        assert frame.yaw == pytest.approx(float(yaw), abs=1e-12)


def test_derivatives_follow_the_chain_rule():
    program = program_at(1, np.random.default_rng(3))
    x = program.prog().GetInitialGuess(program.gripper_variables())
    direct = program.log_likelihood(InitializeAutoDiff(x)[:, 0]).derivatives()
    # x as a function of one parameter t: every variable moves at its own rate.
    rate = np.arange(1.0, 8.0)
    moving = np.array([AutoDiffXd(value, [r]) for value, r in zip(x, rate)])
    assert program.log_likelihood(moving).derivatives() == pytest.approx(direct @ rate)
    constant = np.array([AutoDiffXd(value) for value in x])
    assert program.log_likelihood(constant).value() == pytest.approx(program.log_likelihood(x))


def test_symbolic_variables_are_refused_by_name():
    program = program_at(1, np.random.default_rng(4))
    with pytest.raises(InputError, match="Variable"):
        program.log_likelihood(program.gripper_variables())


def test_a_vector_function_of_double_and_autodiff():
    square = Differentiable(lambda x: (x**2, np.diag(2.0 * x)))
    np.testing.assert_array_equal(square(np.array([1.0, 3.0])), [1.0, 9.0])
    y = square(InitializeAutoDiff(np.array([1.0, 3.0]))[:, 0])
    np.testing.assert_array_equal(ExtractGradient(y), [[2.0, 0.0], [0.0, 6.0]])


def sphere_features(radius, count=4000):
    """Exact features of a sphere about the origin, points on a spiral."""
    k = np.arange(count) + 0.5
    z, azimuth = 1.0 - 2.0 * k / count, np.pi * (1.0 + 5.0**0.5) * k
    normal = np.stack(
        [np.cos(azimuth) * np.sqrt(1 - z**2), np.sin(azimuth) * np.sqrt(1 - z**2), z], axis=1
    )
    rho = 0.03
    r = np.full((count, 2), rho / radius)
    frames = quat_from_xz(perpendicular(normal), normal)
    return SurfaceFeatures(radius * normal, frames, r, np.zeros(count), np.zeros(count, bool), rho)


@pytest.mark.parametrize("radius", [0.05, 0.2])
def test_smooth_surface_of_a_sphere(radius):
    features, rng = sphere_features(radius), np.random.default_rng(5)
    spacing = radius * np.sqrt(4.0 * np.pi / 4000)
    for _ in range(20):
        u = rng.standard_normal(3)
        u /= np.linalg.norm(u)
        surface = SmoothSurface(features, radius * u, 0.05, spacing)
        for height in (-0.2 * radius, 0.0, 0.2 * radius):
            foot = surface.footing((radius + height) * u, u)
            assert foot.level == pytest.approx(height, abs=0.02 * spacing + 0.01 * abs(height))
            assert foot.normal @ u > np.cos(0.02)
            np.testing.assert_allclose(foot.level_by_p, u, atol=0.06)
            nearest = np.linalg.norm(features.p - (radius + height) * u, axis=1).min()
            assert nearest <= foot.gap <= nearest + 0.5 * spacing


def test_a_thin_plate_has_two_faces():
    grid = (
        np.stack(np.meshgrid(np.arange(-9, 10), np.arange(-9, 10)), axis=-1).reshape(-1, 2) * 0.008
    )
    top = np.column_stack([grid, np.full(len(grid), 0.002)])
    up, down = np.tile([1.0, 0, 0, 0], (len(grid), 1)), np.tile([0.0, 1, 0, 0], (len(grid), 1))
    n = 2 * len(grid)
    plate = SurfaceFeatures(
        np.vstack([top, top * [1, 1, -1]]),
        np.vstack([up, down]),
        np.zeros((n, 2)),
        np.zeros(n),
        np.zeros(n, bool),
        0.03,
    )
    surface = SmoothSurface(plate, np.zeros(3), 0.05, 0.012)
    z = axis_of(up[0], 2)
    for side in (1.0, -1.0):
        foot = surface.footing(np.array([0.003, 0.001, 0.0]), side * z)
        assert foot.level == pytest.approx(-0.002, abs=5e-5)
        assert foot.normal @ (side * z) > 0.999
