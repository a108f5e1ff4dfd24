"""J as the product of its parts, the closed-form scale, and its prior from two hulls."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from drake_aerial.contacts.likelihood.contact_likelihood import (
    GAMMA,
    GAMMA_FORMATION,
    SMALLEST_SCALE,
    ContactLikelihood,
    ScalePrior,
)
from drake_aerial.contacts.votes.scan_cuts import ScanCuts
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.geometry import Pose, quat_about_axis, quat_exp, quat_multiply, rotate
from drake_aerial.skill.configuration_model import ConfigurationModel

Z = np.array([0.0, 0.0, 1.0])
UNEVEN = np.array([[0.5, -0.3], [0.4, 0.35], [-0.2, 0.4], [-0.6, -0.25]])


def hull(points):
    return HorizontalHull.of_points(points)


def turned(points, yaw):
    c, s = np.cos(yaw), np.sin(yaw)
    return points @ np.array([[c, s], [-s, c]])


def configuration(n, vertical=1.0):
    rng = np.random.default_rng(n)
    p = rng.uniform(-0.3, 0.3, (n, 3)) + [0.1, 0.0, 0.2]
    X_NG = Pose(p, quat_exp(0.3 * rng.standard_normal((n, 3))))
    model = ConfigurationModel.learn(
        X_NG,
        Pose(p + [0.0, 0.0, 0.5], X_NG.q),
        np.full(n, 0.5),
        sigma_p=0.03,
        sigma_q=0.26,
        axial=True,
    )
    return model.with_heights(1.0, vertical)


def placed(model, rng, scale, batch=6):
    """Gripper poses about a formation of a scale, anywhere."""
    origin, yaw = rng.uniform(-1.0, 1.0, (batch, 3)), rng.uniform(-np.pi, np.pi, batch)
    at = model.demonstrated_at(origin, yaw, scale)
    shape = (batch, len(model), 3)
    turn = quat_exp(0.1 * rng.standard_normal(shape))
    return Pose(at.p + 0.02 * rng.standard_normal(shape), quat_multiply(turn, at.q))


class Everywhere:
    """A query density or votes of one value, which records where it was evaluated."""

    def __init__(self, value):
        self.value, self.asked = value, []

    def log_density(self, *where):
        self.asked.append(where)
        return np.full(6, self.value)


@pytest.mark.parametrize("scale", [0.5, 1.0, 1.7])
def test_hulls_of_one_shape_tell_the_scale_exactly(scale):
    prior = ScalePrior.of_hulls(hull(scale * UNEVEN + [3.0, -1.0]), hull(UNEVEN), 0.0)
    assert prior.log_mean == pytest.approx(np.log(scale), abs=1e-9)
    assert prior.sigma == 0.02  # no more certain than that


def test_the_yaw_turns_the_old_hull_onto_the_new_one():
    new, old = hull(1.3 * turned(UNEVEN, 0.7)), hull(UNEVEN)
    assert ScalePrior.of_hulls(new, old, 0.7).log_mean == pytest.approx(np.log(1.3), abs=1e-9)
    assert ScalePrior.of_hulls(new, old, 0.7).sigma == 0.02
    assert ScalePrior.of_hulls(new, old, -0.7).sigma > 0.1
    # Gripper positions turn with it: those along the object's length tell that.
    line = np.array([[0.4, 0.0, 0.1], [-0.4, 0.0, 0.1]])
    longer = hull(turned(UNEVEN * [2.0, 1.0], 0.7))
    assert (
        ScalePrior.of_hulls(longer, old, 0.7, line).log_mean
        > ScalePrior.of_hulls(longer, old, 0.7).log_mean + 0.1
    )


def test_mean_and_spread_are_those_over_all_directions():
    # Discs about their centroids, stretched: h^2 = a^2 cos^2 + b^2 sin^2.
    angle = np.linspace(0.0, 2.0 * np.pi, 2000, endpoint=False)
    disc = np.column_stack([np.cos(angle), np.sin(angle)])
    prior = ScalePrior.of_hulls(hull(disc * [2.0, 1.0]), hull(disc), 0.3)
    log_ratio = 0.5 * np.log(4.0 * disc[:, 0] ** 2 + disc[:, 1] ** 2)
    # The mean over the circle is known: log((a + b) / 2).
    assert prior.log_mean == pytest.approx(np.log(1.5), abs=1e-4)
    assert prior.sigma == pytest.approx(log_ratio.std(), abs=1e-4)
    # Seen by grippers in line, at right angles to the stretch, weighted by the cosine's square.
    across = ScalePrior.of_hulls(
        hull(disc * [2.0, 1.0]), hull(disc), 0.0, np.array([[0.0, 0.2, 0.0], [0.0, -0.2, 0.0]])
    )
    weight = disc[:, 1] ** 2 / np.sum(disc[:, 1] ** 2)
    mean = weight @ log_ratio
    assert across.log_mean == pytest.approx(mean, abs=1e-4)
    assert across.sigma == pytest.approx(np.sqrt(weight @ (log_ratio - mean) ** 2), abs=1e-4)


def test_one_gripper_weighs_all_directions_alike():
    new, old = hull(UNEVEN * [1.5, 0.9]), hull(UNEVEN)
    alone, plain = (
        ScalePrior.of_hulls(new, old, 0.2, np.zeros((1, 3))),
        ScalePrior.of_hulls(new, old, 0.2),
    )
    assert (alone.log_mean, alone.sigma) == (plain.log_mean, plain.sigma)


@pytest.mark.parametrize("steps", [0, 8, 20, 45])
def test_across_a_cut_an_object_is_as_wide_as_ever(steps):
    # A strip is missing at the end of a box of any yaw; five of 72 directions face it.
    yaw, flags = np.deg2rad(5.0 * steps), np.zeros(72, bool)
    flags[(np.arange(-2, 3) + steps) % 72] = True
    whole = 0.5 * np.array([[0.68, 0.61], [-0.68, 0.61], [-0.68, -0.61], [0.68, -0.61]])
    left = np.column_stack([np.minimum(whole[:, 0], 0.19), 1.3 * whole[:, 1]])
    prior = ScalePrior.of_hulls(hull(turned(left, yaw)), hull(whole), yaw, None, ScanCuts(flags))
    assert prior.log_mean == pytest.approx(np.log(1.3), abs=0.03)


@pytest.mark.parametrize("degrees", [0.0, 35.0, 190.0, 355.0])
def test_without_votes_the_yaw_is_where_hulls_are_most_alike(degrees):
    new = hull(0.8 * turned(UNEVEN, np.deg2rad(degrees)))
    prior = ScalePrior.of_best_yaw(new, hull(UNEVEN))
    assert prior.log_mean == pytest.approx(np.log(0.8), abs=1e-6)
    assert prior.sigma == 0.02


@pytest.mark.parametrize("vertical", [1.0, 0.4])
@pytest.mark.parametrize("true", [0.6, 1.0, 1.5])
def test_the_scale_is_the_likeliest(true, vertical):
    model, prior = configuration(3, vertical), ScalePrior(np.log(1.2), 0.1)
    likelihood = ContactLikelihood(model, (), None, prior)
    X_NG = placed(model, np.random.default_rng(0), true)
    origin, yaw = model.formation_frames(X_NG)
    got = likelihood.scale(X_NG, origin, yaw)

    for k in range(6):
        X = X_NG.take(k)

        def cost(scale, X=X, k=k):
            # The density at that scale, and a Gaussian prior of the same relative deviation.
            return -model.log_density(X, scale=scale) + 0.5 * ((scale - 1.2) / (0.1 * 1.2)) ** 2

        best = minimize_scalar(cost, bounds=(0.1, 3.0), method="bounded", options={"xatol": 1e-9}).x
        assert got[k] == pytest.approx(best, abs=1e-6)


def test_no_scale_is_smaller_than_the_smallest():
    model = configuration(3)
    likelihood = ContactLikelihood(model, (), None, ScalePrior(np.log(0.3), 5.0))
    # A layout turned inside out, against a demonstrated yaw.
    p = -model.X_FG.p[None]
    assert (
        likelihood.scale(Pose(p, model.X_FG.q[None]), np.zeros((1, 3)), np.zeros(1))[0]
        == SMALLEST_SCALE
    )


def test_one_gripper_has_the_scale_of_the_hulls():
    model = configuration(1)
    likelihood = ContactLikelihood(model, (), None, ScalePrior(np.log(0.7), 0.1))
    X_NG = placed(model, np.random.default_rng(1), 1.0)
    np.testing.assert_allclose(
        likelihood.scale(X_NG, *model.formation_frames(X_NG)), np.full(6, 0.7)
    )
    assert likelihood.scale_slope == 0.0


@pytest.mark.parametrize("vertical", [1.0, 0.4])
def test_the_slope_of_the_scale_by_the_overlap(vertical):
    model = configuration(3, vertical)
    likelihood = ContactLikelihood(model, (), None, ScalePrior(np.log(1.2), 0.1))
    X_NG = placed(model, np.random.default_rng(2), 1.1)
    origin, yaw = model.formation_frames(X_NG)
    p_NG = origin[:, None] + 1.01 * (X_NG.p - origin[:, None])
    there = rotate(quat_about_axis(Z, yaw)[:, None], model.X_FG.p)
    moved = np.sum(there * (p_NG - X_NG.p) * [1.0, 1.0, vertical**2], axis=(1, 2))
    change = likelihood.scale(Pose(p_NG, X_NG.q), origin, yaw) - likelihood.scale(X_NG, origin, yaw)
    np.testing.assert_allclose(change / moved, likelihood.scale_slope, rtol=1e-9)


@pytest.mark.parametrize(("n", "gamma"), [(1, GAMMA), (3, GAMMA_FORMATION)])
@pytest.mark.parametrize("with_votes", [True, False])
def test_the_likelihood_is_the_product_of_its_parts(n, gamma, with_votes):
    model, prior = configuration(n), ScalePrior(np.log(1.2), 0.1)
    queries, votes = (
        tuple(Everywhere(-1.0 - k) for k in range(n)),
        Everywhere(-0.7) if with_votes else None,
    )
    likelihood = ContactLikelihood(model, queries, votes, prior)
    X_NG = placed(model, np.random.default_rng(3), 1.15)
    origin, yaw = model.formation_frames(X_NG)
    scale = likelihood.scale(X_NG, origin, yaw)
    # One gripper has no scale to be judged.
    judged = 0.0 if n == 1 else -((np.log(scale) - np.log(1.2)) ** 2) / (2 * 0.1**2)
    voted = -0.7 * gamma if with_votes else 0.0
    expected = model.log_density(X_NG, scale=scale) + judged - sum(range(1, n + 1)) + voted
    np.testing.assert_allclose(likelihood(X_NG), expected, rtol=1e-12)
    likelihood(X_NG, coarse=True)
    for k, query in enumerate(queries):
        np.testing.assert_array_equal(query.asked[0][0].p, X_NG.p[:, k])
        np.testing.assert_array_equal(query.asked[0][0].q, X_NG.q[:, k])
        assert [coarse for _, coarse in query.asked] == [False, True]
    if with_votes:
        np.testing.assert_array_equal(votes.asked[0][0], origin)
        np.testing.assert_array_equal(votes.asked[0][1], yaw)
