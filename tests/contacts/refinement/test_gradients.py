"""Gradients of every cost and constraint of a contact program, against finite differences."""

import numpy as np
import pytest
from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, ExtractValue, InitializeAutoDiff

from drake_aerial.contacts.likelihood.formation_frame import FormationFrames
from drake_aerial.contacts.refinement.differentiable import Differentiable
from drake_aerial.contacts.refinement.program import ContactProgram
from drake_aerial.errors import InputError
from drake_aerial.geometry import (
    Pose,
    invert,
    quat_exp,
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
