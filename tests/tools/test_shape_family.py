"""The generated shapes of the benches: sites lie on the surface, parts hide each other, cuts."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

sys.path.insert(0, str(Path(__file__).parents[2] / "tools" / "bench"))
try:
    import held_out_shapes
    from shape_cases import CUT, Case, corrupted
    from shape_family import KINDS, kinds_of
    from shape_parts import Shape, arc, bent_bar, centred, frustum
finally:
    sys.path.pop(0)


@pytest.mark.parametrize("kind", KINDS.values(), ids=list(KINDS))
def test_sites_lie_on_the_sampled_surface_under_the_open_sky(kind):
    rng = np.random.default_rng(3)
    shape = kind.make(rng, 0.6)
    assert shape.size == pytest.approx(0.6, rel=0.25)
    points = shape.sample(6000, rng)
    tree = cKDTree(points)
    for site in kind.sites:
        places, normals = shape.places(site)
        assert tree.query(places)[0].max() < 0.03
        assert np.all(normals[:, 2] > 0.1)
        for place in places:
            near = np.linalg.norm(points[:, :2] - place[:2], axis=1) < 0.004
            assert np.all(points[near, 2] < place[2] + 0.02)


def test_there_are_20_kinds_and_40_sites_in_equal_halves():
    halves = [{kind.name for kind in kinds_of(half)} for half in ("development", "report")]
    assert len(halves[0]) == len(halves[1]) >= 10
    assert not halves[0] & halves[1]
    assert sum(len(kind.sites) for kind in KINDS.values()) >= 40


def test_points_inside_another_part_are_not_sampled():
    shape = Shape([centred((0.4, 0.4, 0.1)), frustum((0.05, 0.05), (0, 0, 0.05), 0.2)], {})
    points = shape.sample(5000, np.random.default_rng(0))
    buried = (np.hypot(points[:, 0], points[:, 1]) < 0.048) & (points[:, 2] > 0.01)
    assert np.all(points[buried, 2] > 0.249)
    inside = np.all(np.abs(points - [0, 0, 0.05]) < [0.199, 0.199, 0.049], axis=1)
    assert not inside.any()


def test_a_bent_bar_keeps_its_radius_from_the_path():
    path = arc((0.0, 0.0, 0.0), (0.2, 0.2), (0.0, 180.0), 40)
    shape = Shape(bent_bar(path, (0.02, 0.02)), {})
    points = shape.sample(3000, np.random.default_rng(1))
    points = points[points[:, 2] > 0.02]
    tube = np.hypot(np.hypot(points[:, 0], points[:, 2]) - 0.2, points[:, 1])
    assert np.abs(tube - 0.02).max() < 0.002


def test_a_cut_takes_38_percent_away_and_leaves_the_site():
    for seed in range(5):
        case = Case("l_shape", "long_end", "cut", seed)
        places, _ = case.asked.places(case.site)
        whole = corrupted(case.asked, places, "clean", np.random.default_rng(seed))
        left = corrupted(case.asked, places, "cut", np.random.default_rng(seed))
        assert len(left) == pytest.approx((1 - CUT) * len(whole), rel=0.01)
        assert cKDTree(left).query(places)[0].min() < 0.02


def test_a_case_is_the_same_whenever_it_is_drawn_and_differs_between_masters():
    first, again, other = (Case("box", "corner", "clean", 4, m).scan[0].sha256 for m in (0, 0, 1))
    assert first == again != other


def test_a_contact_at_any_equivalent_place_has_no_error():
    case = Case("box", "corner", "clean", 0)
    places, _ = case.asked.places(case.site)
    _, X_SB = case.scan
    from drake_aerial.geometry import transform

    assert case.errors(transform(X_SB, places)).max() < 1e-12
    shifted = transform(X_SB, places + [0.0, 0.0, 0.02])
    assert case.errors(shifted) == pytest.approx(0.02)


def test_the_wilson_interval_is_the_textbook_one():
    # Brown, Cai and DasGupta (2001): 0 of 10 gives [0, 0.278].
    assert held_out_shapes.wilson(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-3)
    assert held_out_shapes.wilson(50, 100) == pytest.approx((0.404, 0.596), abs=1e-3)


def test_the_table_counts_a_failed_transfer_as_wrong():
    good = {"errors": [0.001, 0.3], "feasible": [False, True], "size": 0.2, "cpu_s": 1.0}
    failed = {"errors": [], "feasible": [], "size": 0.2, "cpu_s": 1.0}
    s = held_out_shapes.summary([good, failed])
    assert (s["rank1"], s["best5"], s["flown"], s["count"]) == (1, 1, 0, 2)
