"""H: its invariances, its value against single kernels, and the best formation frame."""

import numpy as np
import pytest
from scipy.stats import norm

from drake_aerial.density import kernels
from drake_aerial.geometry import (
    Pose,
    axis_of,
    quat_about_axis,
    quat_conjugate,
    quat_exp,
    quat_multiply,
    random_rotation,
    rotate,
)
from drake_aerial.skill.configuration_model import ConfigurationModel

Z = np.array([0.0, 0.0, 1.0])


def make(rng, n=3, axial=True):
    X_NG = Pose(rng.uniform(-0.3, 0.3, (n, 3)), quat_exp(0.4 * rng.standard_normal((n, 3))))
    X_NQ = Pose(X_NG.p + [0.0, 0.1, 0.5], X_NG.q)
    length = np.linalg.norm(X_NQ.p - X_NG.p, axis=1)
    return X_NG, ConfigurationModel.learn(
        X_NG, X_NQ, length, sigma_p=0.03, sigma_q=0.26, axial=axial
    )


@pytest.mark.parametrize("axial", [True, False])
@pytest.mark.parametrize("n", [1, 3])
def test_is_free_of_yaw_and_place(n, axial):
    rng = np.random.default_rng(0)
    X_NG, model = make(rng, n, axial)
    yaw, shift = 1.1, np.array([2.0, -1.0, 0.4])
    turn = quat_about_axis(Z, np.asarray(yaw))
    moved = Pose(rotate(turn, X_NG.p) + shift, quat_multiply(turn, X_NG.q))
    assert model.log_density(moved) == pytest.approx(model.log_density(X_NG), abs=1e-9)
    np.testing.assert_allclose(
        model.quadrotors_over(moved).p, rotate(turn, X_NG.p + [0.0, 0.1, 0.5]) + shift, atol=1e-9
    )


def test_is_not_free_of_tilt_or_layout():
    rng = np.random.default_rng(1)
    X_NG, model = make(rng)
    best = model.log_density(X_NG)
    tilt = quat_exp([0.5, 0.0, 0.0])
    assert model.log_density(Pose(rotate(tilt, X_NG.p), quat_multiply(tilt, X_NG.q))) < best - 3.0
    assert model.log_density(Pose(1.3 * X_NG.p, X_NG.q)) < best - 1.0
    stretched = model.log_density(Pose(1.3 * X_NG.p, X_NG.q), scale=np.asarray(1.3))
    assert stretched == pytest.approx(best, abs=1e-9)


@pytest.mark.parametrize("axial", [True, False])
def test_formation_yaw_is_the_likeliest(axial):
    rng = np.random.default_rng(3)
    _, model = make(rng, axial=axial)
    p = rng.uniform(-0.3, 0.3, (3, 3))
    X_NG = Pose(p, random_rotation(rng, 3))
    origin, yaw = model.formation_frames(X_NG)

    def cost(at):
        turned = model.demonstrated_at(origin, at)
        positions = -0.5 * np.sum((X_NG.p - turned.p) ** 2) / model.sigma_p**2
        axes = [Z] if axial else list(np.eye(3))
        weight = (1.0 if axial else 0.5) / model.sigma_q**2
        angles = sum(np.sum(rotate(X_NG.q, a) * rotate(turned.q, a)) for a in axes)
        return positions + weight * angles

    values = [cost(np.asarray(yaw + d)) for d in np.linspace(-np.pi, np.pi, 361)]
    assert cost(yaw) >= max(values) - 1e-9
    assert np.ptp(values) > 1.0


def test_batches_equal_single_evaluations():
    rng = np.random.default_rng(4)
    _, model = make(rng)
    X = Pose(rng.normal(size=(5, 3, 3)), random_rotation(rng, 5, 3))
    one_by_one = [float(model.log_density(X.take(k))) for k in range(5)]
    np.testing.assert_allclose(model.log_density(X), one_by_one, rtol=1e-12)


@pytest.mark.parametrize("axial", [True, False])
@pytest.mark.parametrize("vertical", [1.0, 0.3])
def test_is_the_product_of_normalised_kernels_in_the_formation_frame(axial, vertical):
    rng = np.random.default_rng(5)
    model = make(rng, axial=axial)[1].with_heights(1.0, vertical)
    X_NG = Pose(rng.normal(size=(3, 3)), random_rotation(rng, 3))
    origin, yaw = model.formation_frames(X_NG)
    back = quat_conjugate(quat_about_axis(Z, yaw))
    p, q = rotate(back, X_NG.p - origin), quat_multiply(back, X_NG.q)
    # A difference in height of sigma / vertical is as likely as a horizontal one of sigma.
    expected = norm.logpdf(p, 1.4 * model.X_FG.p, [0.03, 0.03, 0.03 / vertical]).sum()
    if axial:
        expected += kernels.log_axis(axis_of(q, 2), axis_of(model.X_FG.q, 2), 0.26).sum()
    else:
        expected += kernels.log_theta(q, model.X_FG.q, 0.26).sum()
    assert model.log_density(X_NG, scale=1.4) == pytest.approx(expected, rel=1e-9)


def test_other_heights_move_grippers_and_their_quadrotors_alike():
    model = make(np.random.default_rng(6))[1]
    high = model.with_heights(2.5, 0.7)
    np.testing.assert_allclose(high.X_FG.p, model.X_FG.p * [1.0, 1.0, 2.5], rtol=1e-12)
    np.testing.assert_allclose(high.p_FQ - high.X_FG.p, model.p_FQ - model.X_FG.p, atol=1e-12)
    np.testing.assert_array_equal(high.X_FG.q, model.X_FG.q)
    assert (high.vertical, model.vertical) == (0.7, 1.0)


def test_quadrotors_hang_their_cables_level_above():
    rng = np.random.default_rng(7)
    X_NG, model = make(rng)
    assert len(model) == 3
    np.testing.assert_allclose(
        model.cable_direction, np.tile([0.0, 0.1, 0.5], (3, 1)) / np.sqrt(0.26), atol=1e-12
    )
    over = model.quadrotors_over(X_NG.take(np.array([0, 1, 2])))
    np.testing.assert_allclose(
        np.linalg.norm(over.p - X_NG.p, axis=1), model.cable_length, rtol=1e-12
    )
    np.testing.assert_array_equal(over.q, np.tile([1.0, 0.0, 0.0, 0.0], (3, 1)))


def test_demonstrated_formations_are_placed_turned_and_scaled():
    model = make(np.random.default_rng(8))[1]
    origin, yaw, scale = (
        np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]]),
        np.array([0.4, -2.0]),
        np.array([1.5, 0.5]),
    )
    at = model.demonstrated_at(origin, yaw, scale)
    for k in range(2):
        c, s = np.cos(yaw[k]), np.sin(yaw[k])
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        np.testing.assert_allclose(
            at.p[k], origin[k] + scale[k] * model.X_FG.p @ turn.T, atol=1e-12
        )
        np.testing.assert_allclose(
            axis_of(at.q[k], 0), axis_of(model.X_FG.q, 0) @ turn.T, atol=1e-12
        )
    # The fit returns the frames at which the grippers were placed.
    fitted, angle = model.formation_frames(at)
    np.testing.assert_allclose(fitted, origin, atol=1e-12)
    np.testing.assert_allclose(angle, yaw, atol=1e-9)


def test_models_are_learnt_about_the_mean_gripper():
    X_NG = Pose(np.array([[1.0, 0.0, 0.2], [3.0, 2.0, 0.4]]), np.eye(4)[:2])
    X_NQ = Pose(X_NG.p + [0.0, 0.3, 0.4], X_NG.q)
    model = ConfigurationModel.learn(X_NG, X_NQ, [1, 2], sigma_p=0.1, sigma_q=0.2, axial=True)
    np.testing.assert_allclose(model.X_FG.p, [[-1.0, -1.0, -0.1], [1.0, 1.0, 0.1]], atol=1e-12)
    np.testing.assert_allclose(model.p_FQ, [[-1.0, -0.7, 0.3], [1.0, 1.3, 0.5]], atol=1e-12)
