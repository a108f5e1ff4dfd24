"""Checks of contacts on a box, the reasons they give, and where a gripper is off the surface."""

import numpy as np
import pytest

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.feasibility.checks import reasons_against
from drake_aerial.contacts.feasibility.local_surface import LocalSurface
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.errors import InputError
from drake_aerial.features.surface_features import FeatureParameters, compute_features
from drake_aerial.geometry import Pose, quat_from_two_vectors
from drake_aerial.statics.lift import Lift
from tests.contacts.box_scans import box_cloud

UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def surface():
    return LocalSurface(compute_features(box_cloud([0.6, 0.4, 0.3])))


def reasons(
    surface, positions, axes=None, centre=(0.0, 0.0), distance=None, cable=(0.0, 0.0, 0.5), **limits
):
    p = np.atleast_2d(np.asarray(positions, float))
    z = np.tile(UP, (len(p), 1)) if axes is None else np.atleast_2d(np.asarray(axes, float))
    X_NG = Pose(p, quat_from_two_vectors(UP, z))
    X_NQ = Pose(p + cable, np.tile([1.0, 0, 0, 0], (len(p), 1)))
    distance = np.zeros(len(p)) if distance is None else np.asarray(distance)
    found = reasons_against(
        X_NG, X_NQ, distance, np.asarray(centre), surface, TransferParameters(**limits)
    )
    return tuple(str(reason) for reason in found)


def test_top_of_a_box_is_feasible(surface):
    assert reasons(surface, [0.1, 0.05, 0.15]) == ()


def test_upside_down(surface):
    assert "upside down" in reasons(surface, [0, 0, -0.15], axes=[0, 0, -1])[0]


@pytest.mark.parametrize("elevation", [-0.4, 0.0, 3.0])
def test_a_gripper_on_a_side_face_is_sideways(surface, elevation):
    angle = np.deg2rad(elevation)
    found = reasons(surface, [0.3, 0, 0], axes=[np.cos(angle), 0, np.sin(angle)])
    assert found[0] == (
        f"sideways (its axis points {max(elevation, 0):.0f} deg above the horizontal, "
        "at least 10 deg are needed)"
    )


def test_cable_through_the_payload(surface):
    assert reasons(surface, [0, 0, -0.15]) == ("cable through the payload",)
    leaning = reasons(surface, [0.2, 0, 0.15], cable=(-0.4, 0.0, -0.2))
    assert leaning == ("cable through the payload",)


def test_off_the_surface(surface):
    found = reasons(surface, [0, 0, 0.2], distance=[0.05])
    assert found == ("off the surface (nearest point 5.0 cm away)",)


def test_quadrotors_too_close(surface):
    found = reasons(surface, [[-0.1, 0, 0.15], [0.1, 0, 0.15]])
    assert found == ("quadrotors 1 and 2 too close (0.20 m, at least 0.35 m)",)


def test_no_taut_equilibrium(surface):
    line = [[-0.25, 0, 0.15], [0.15, 0, 0.15]]
    assert reasons(surface, line) == ()
    assert "no positive-tension equilibrium" in reasons(surface, line, centre=(0.2, 0.0))[0]


THREE = np.array([[0.25, 0.0, 0.15], [-0.2, 0.18, 0.15], [-0.2, -0.18, 0.15]])


def test_a_formation_around_the_centre_is_feasible(surface):
    assert reasons(surface, THREE) == ()


def test_reasons_name_the_gripper(surface):
    p = THREE * [1, 1, 1]
    p[1, 2], p[2] = -0.15, [-0.3, 0.0, 0.0]
    found = reasons(
        surface, p, axes=[[0, 0, 1], [0, 0, 1], [-1, 0, 0]], distance=[0.03, 0, 0], separation=0.1
    )
    assert found[0] == "gripper 1: off the surface (nearest point 3.0 cm away)"
    assert found[1] == "gripper 2: cable through the payload"
    assert found[2].startswith("gripper 3: sideways")


@pytest.mark.parametrize(
    ("centre", "outside"), [((-0.25, 0.0), True), ((-0.19, 0.0), False), ((0.1, 0.12), True)]
)
def test_all_contacts_on_one_side(surface, centre, outside):
    # Beyond the base of the triangle, just inside it, and beyond one of its legs.
    found = reasons(surface, THREE, centre=centre)
    expected = "no positive-tension equilibrium (all contacts on one side of the centre of mass)"
    assert found == ((expected,) if outside else ())


def test_cables_that_all_lean_one_way_do_not_balance(surface):
    found = reasons(surface, THREE, cable=(0.2, 0.0, 0.45))
    assert found == ("no positive-tension equilibrium (cables do not balance)",)


def test_more_tension_than_the_propellers_lift(surface):
    line = [[-0.1, 0, 0.15], [0.3, 0, 0.15]]
    # Lever rule: 3/4 and 1/4 of 19.62 N; a 0.25 kg quadrotor of 15 N holds 15 - 2.4525 N.
    lift = Lift(2.0, (15.0, 15.0), (0.25, 0.25))
    assert reasons(surface, line, lift=lift) == (
        "gripper 1: more tension than the propellers lift (14.7 N, at most 12.5 N)",
    )
    assert reasons(surface, line, lift=Lift(2.0, (17.5, 15.0), (0.25, 0.25))) == ()
    alone = reasons(surface, [0, 0, 0.15], lift=Lift(1.0, (10.0,), (0.25,)))
    assert alone == ("more tension than the propellers lift (9.8 N, at most 7.5 N)",)


def test_strong_quadrotors_relieve_a_weak_one_where_statics_allow_it(surface):
    p = np.array([[0.2, 0.19, 0.15], [-0.2, 0.19, 0.15], [-0.2, -0.19, 0.15], [0.2, -0.19, 0.15]])
    # Even shares are 4.9 N; the second holds 3 N, and its neighbours make up for it.
    weak = Lift(2.0, (15.0, 5.4525, 15.0, 15.0), (0.25,) * 4)
    assert reasons(surface, p, lift=weak) == ()
    # Two neighbours carry half of the weight, 9.8 N, however they share it.
    weak_side = Lift(2.0, (5.4525, 5.4525, 15.0, 15.0), (0.25,) * 4)
    assert [reason[:9] for reason in reasons(surface, p, lift=weak_side)] == [
        "gripper 1",
        "gripper 2",
    ]


def test_refuses_the_lift_of_another_team(surface):
    with pytest.raises(InputError, match=r"1 quadrotor.*, got 2"):
        reasons(surface, [0, 0, 0.15], lift=Lift(1.0, (10.0, 10.0), (0.25, 0.25)))


def test_gaps_between_samples_are_surface_and_holes_are_not():
    # Samples 2 cm apart on average, thrown at random, with a hole of 10 cm radius.
    rng = np.random.default_rng(0)
    xy = rng.uniform(-0.5, 0.5, (2500, 2))
    xy = xy[np.linalg.norm(xy, axis=1) > 0.1]
    sparse = PointCloud.read(np.column_stack([xy, np.zeros(len(xy))]), viewpoint=(0, 0, 2))
    surface = LocalSurface(compute_features(sparse, FeatureParameters(rho=0.06)))
    at = rng.uniform(-0.4, 0.4, (2000, 2))
    at = at[np.linalg.norm(at, axis=1) > 0.14]
    gap = np.linalg.norm(at[:, None] - surface.points[:, :2], axis=2).min(axis=1)
    assert np.mean(gap > surface.hole) < 0.01
    assert np.linalg.norm(surface.points[:, :2], axis=1).min() > surface.hole
