"""Transfer on boxes: accuracy, invariances, methods, options and errors."""

import json
from dataclasses import replace

import numpy as np
import pytest

from drake_aerial.choices import METHODS
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts import prepare_query
from drake_aerial.contacts.feasibility.reasons import ReasonKind
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.transfer import transfer
from drake_aerial.density.grid_density import GridDensity
from drake_aerial.errors import InputError, JobError
from drake_aerial.geometry import Pose, axis_of, quat_exp, rotate
from drake_aerial.geometry import transform as transformed
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn
from tests.contacts.box_scans import box_cloud, box_demonstration

SIZE = [0.68, 0.61, 0.28]
FAST = TransferParameters(
    candidates=1500,
    starts=100,
    chains=40,
    steps=120,
    paper_candidates=1500,
    paper_votes=1500,
    kernels=300,
)


@pytest.fixture(scope="module")
def skill():
    return learn(box_demonstration(SIZE))


@pytest.fixture(scope="module")
def cloud():
    return box_cloud([0.45, 0.35, 0.25], seed=1, noise=0.0005)


def run(skill, cloud, method="task", seed=0, **options):
    return transfer(skill, cloud, method=method, seed=seed, parameters=replace(FAST, **options))


def without_timing(solutions):
    values = json.loads(solutions.to_json())
    del values["timing"]
    return values


def test_central_demonstration_goes_to_the_centre_of_another_box(skill, cloud):
    solutions = run(skill, cloud)
    error = [np.linalg.norm(s.X_SG.p[0] - [0, 0, 0.125]) for s in solutions.solutions]
    assert np.median(error) < 0.02
    assert solutions[0].feasible
    np.testing.assert_allclose(solutions[0].normal, [[0, 0, 1]], atol=0.05)
    np.testing.assert_allclose(axis_of(solutions[0].X_SG.q, 2), solutions[0].normal, atol=1e-6)
    np.testing.assert_allclose(solutions[0].X_SQ.p, solutions[0].X_SG.p + [0, 0, 0.5], atol=0.03)
    assert [s.rank for s in solutions.solutions] == list(range(1, len(solutions) + 1))
    assert np.all(np.diff([s.log_likelihood for s in solutions.solutions]) <= 0.0)


@pytest.mark.parametrize("site", [(0.6, 0.0), (0.5, 0.6)])
def test_off_centre_demonstration_goes_to_the_corresponding_site(site):
    size = np.array([1.0, 0.8, 0.3])
    solutions = run(
        learn(box_demonstration(SIZE, site=site)), box_cloud(size, seed=5, spacing=0.012)
    )
    # A box looks the same after half a turn, and nearly so in a mirror.
    right = [0.5 * size[0] * site[0], 0.5 * size[1] * site[1], 0.15]
    np.testing.assert_allclose(np.abs(solutions[0].X_SG.p[0]), right, atol=0.025)


def test_top_view_to_full_view_and_back(skill, cloud):
    top = learn(box_demonstration(SIZE, view="top"))
    full_to_top = (skill, box_cloud([0.45, 0.35, 0.25], seed=2, view="top"))
    for learnt, scan in ((top, cloud), full_to_top):
        solutions = run(learnt, scan)
        assert np.linalg.norm(solutions[0].X_SG.p[0] - [0, 0, 0.125]) < 0.025


@pytest.mark.parametrize("method", ["task", "paper"])
@pytest.mark.parametrize("rotation", [[0.0, 0.0, 2.1], [0.4, -0.9, 0.7]])
def test_contacts_follow_the_cloud(skill, cloud, method, rotation):
    # A yaw keeps `up`; any other rotation turns it along with the cloud.
    X = Pose(np.array([3.0, -1.0, 0.7]), quat_exp(rotation))
    here, there = run(skill, cloud, method), run(skill, cloud.transformed(X), method)
    for a, b in zip(here.solutions, there.solutions, strict=True):
        np.testing.assert_allclose(b.X_SG.p, transformed(X, a.X_SG.p), atol=1e-6)
        np.testing.assert_allclose(b.X_SQ.p, transformed(X, a.X_SQ.p), atol=1e-6)
        np.testing.assert_allclose(b.normal, rotate(X.q, a.normal), atol=1e-6)
        assert b.log_likelihood == pytest.approx(a.log_likelihood, abs=1e-4)
        assert [*map(str, b.reasons)] == [*map(str, a.reasons)]


def test_order_of_points_does_not_matter(skill, cloud):
    shuffled = replace(cloud, points=np.random.default_rng(0).permutation(cloud.points))
    for a, b in zip(run(skill, cloud).solutions, run(skill, shuffled).solutions, strict=True):
        np.testing.assert_allclose(a.X_SG.p, b.X_SG.p, atol=1e-6)


def test_same_seed_same_bytes_other_seed_other_solutions(skill, cloud):
    first = run(skill, cloud)
    assert without_timing(first) == without_timing(run(skill, cloud))
    assert (
        without_timing(first)["solutions"] != without_timing(run(skill, cloud, seed=1))["solutions"]
    )


class NoVotes:
    """Votes of the same density everywhere."""

    def log_density(self, X_NG):
        return np.zeros(np.shape(X_NG.p)[:-1])


def test_kopicki_is_the_paper_with_votes_off(skill, cloud, monkeypatch):
    kopicki = run(skill, cloud, "kopicki")
    assert (
        without_timing(run(skill, cloud, "paper"))["solutions"]
        != without_timing(kopicki)["solutions"]
    )
    monkeypatch.setattr(prepare_query, "paper_votes", lambda *_: NoVotes())
    off = run(skill, cloud, "paper")
    assert without_timing(off)["solutions"] == without_timing(kopicki)["solutions"]


def test_control_is_task_with_votes_off(skill, cloud, monkeypatch):
    control = run(skill, cloud, "control")
    assert without_timing(run(skill, cloud))["solutions"] != without_timing(control)["solutions"]
    monkeypatch.setattr(GridDensity, "log_density", lambda _, x: np.zeros(np.shape(x)[:-1]))
    off = run(skill, cloud)
    assert without_timing(off)["solutions"] == without_timing(control)["solutions"]


def test_reports_its_progress_and_the_cloud(skill, cloud):
    seen = []
    solutions = transfer(
        skill, cloud, parameters=FAST, progress=lambda fraction, what: seen.append((fraction, what))
    )
    fractions = [fraction for fraction, _ in seen]
    assert fractions == sorted(fractions)
    assert (fractions[0], fractions[-1]) == (0.0, 1.0)
    assert {"annealing", "query density"} <= {what for _, what in seen}
    assert solutions.cloud["points"] == len(cloud)
    assert solutions.cloud["sha256"] == cloud.sha256
    assert solutions.cloud["up"] == [0.0, 0.0, 1.0]


def test_centroid_learns_nothing(cloud):
    solutions = run(learn(box_demonstration(SIZE, site=(0.6, 0.0))), cloud, "centroid")
    np.testing.assert_allclose(solutions[0].X_SG.p, [[0, 0, 0.125]], atol=0.003)
    assert len(solutions) == 1


@pytest.mark.parametrize("method", METHODS)
def test_every_method_stands_on_the_surface(skill, cloud, method):
    for solution in run(skill, cloud, method).solutions:
        p = solution.X_SG.p[0]
        outside = np.abs(p) / [0.225, 0.175, 0.125]
        assert outside.max() == pytest.approx(1.0, abs=0.03)
        assert ReasonKind.OFF_SURFACE not in [reason.kind for reason in solution.reasons]


def test_several_grippers_keep_their_layout():
    corners = np.array([[0.2, 0.0, 0.14], [-0.1, 0.17, 0.14], [-0.1, -0.17, 0.14]])
    skill = learn(Demonstration.make(box_cloud(SIZE, seed=100), corners, name="three"))
    p = run(skill, box_cloud(SIZE, seed=3))[0].X_SG.p
    np.testing.assert_allclose(p[:, 2], 0.14, atol=0.004)
    assert np.linalg.norm(p.mean(axis=0)[:2]) < 0.04
    sides = np.linalg.norm(p - np.roll(p, 1, axis=0), axis=1)
    expected = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
    np.testing.assert_allclose(sides, expected, atol=0.06)


def test_keeps_the_densities_for_pictures(skill, cloud):
    query = run(skill, cloud).query
    n = len(query.scan.features)
    assert query.log_query().shape == query.log_votes().shape == query.log_surface().shape == (n,)
    hottest = query.scan.features_S.p[np.argmax(query.log_surface())]
    assert np.linalg.norm(hottest - [0, 0, 0.125]) < 0.04
    p, weights = query.votes_S()
    assert len(p) == len(weights) == 1000 * 50


def test_up_is_honoured(skill):
    # The same box lying on its side, once gravity says so: the contact goes to the face that is up.
    lying = box_cloud([0.25, 0.45, 0.35], seed=4)
    turned = PointCloud.read(lying.points, up=(1.0, 0.0, 0.0))
    np.testing.assert_allclose(run(skill, turned)[0].X_SG.p, [[0.125, 0, 0]], atol=0.03)


def test_a_surface_unlike_the_demonstrated_one_is_an_error_that_names_the_factor(skill):
    rng = np.random.default_rng(0)
    v = rng.standard_normal((4000, 3))
    ball = PointCloud.read(0.021 * v / np.linalg.norm(v, axis=1, keepdims=True))
    tight = replace(
        skill.parameters, bandwidth=replace(skill.parameters.bandwidth, descriptor=0.05)
    )
    with pytest.raises(JobError, match=r"contact density .* is zero"):
        run(learn(box_demonstration(SIZE), parameters=tight), ball)


@pytest.mark.parametrize(
    ("options", "message"),
    [({"method": "magic"}, "task, paper"), ({"top": 0}, "top"), ({"seed": -1}, "seed")],
)
def test_refuses_bad_options(skill, cloud, options, message):
    with pytest.raises(InputError, match=message):
        transfer(skill, cloud, **options)


@pytest.mark.parametrize(
    "bad", [{"scale": "big"}, {"voters": 0}, {"vote_sigma": 0.0}, {"temperature": (0.1, 1.0)}]
)
def test_refuses_bad_parameters(bad):
    with pytest.raises(InputError, match=next(iter(bad))):
        TransferParameters(**bad)
