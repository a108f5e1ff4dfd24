import numpy as np
import pytest
import trimesh

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.features.surface_features import (
    FeatureParameters,
    SurfaceFeatures,
    compute_features,
)
from drake_aerial.geometry import (
    Pose,
    perpendicular,
    quat_conjugate,
    quat_multiply,
    random_rotation,
    rotate,
    rotation_angle,
)
from tests.features import cloud_shapes as shapes

RHO = 0.03


def features_of(points, noise=0.0, seed=1, **keywords):
    cloud = PointCloud.read(points, **keywords)
    if noise:
        cloud = cloud.with_noise(noise, np.random.default_rng(seed))
    return compute_features(cloud)


def curvature_errors(f, k1, k2, scale):
    """Mean absolute errors of both curvatures relative to `scale` [1/m]."""
    kappa = f.r / f.rho
    return np.mean(np.abs(kappa[:, 0] - k1)) / scale, np.mean(np.abs(kappa[:, 1] - k2)) / scale


@pytest.mark.parametrize("count", [20000, 100000])
def test_sphere_curvatures_within_3_percent(count):
    f = features_of(shapes.sphere(0.2, count, np.random.default_rng(0)))
    assert max(curvature_errors(f, 5.0, 5.0, 5.0)) < 0.03
    assert np.all(f.r > 0)  # convex is positive
    assert np.sum(f.normal * f.p, axis=1).min() > 0.199


@pytest.mark.parametrize("count", [20000, 100000])
def test_cylinder_curvatures_within_3_percent(count):
    f = features_of(shapes.cylinder(0.15, 0.6, count, np.random.default_rng(0)))
    inside = f.take(np.abs(f.p[:, 2]) < 0.3 - RHO)
    assert max(curvature_errors(inside, 1 / 0.15, 0.0, 1 / 0.15)) < 0.03
    radial = inside.p * [1, 1, 0] / np.linalg.norm(inside.p[:, :2], axis=1, keepdims=True)
    assert np.sum(inside.normal * radial, axis=1).min() > 0.99
    # k1 runs around the cylinder.
    assert np.percentile(np.abs(inside.k1[:, 2]), 95) < 0.05
    assert inside.anisotropy.min() > 0.8


@pytest.mark.parametrize("count", [40000, 200000])
def test_torus_curvatures_within_3_percent(count):
    ring, tube = 0.3, 0.1
    f = features_of(shapes.torus(ring, tube, count, np.random.default_rng(0)))
    across = np.hypot(f.p[:, 0], f.p[:, 1])
    assert max(curvature_errors(f, 1 / tube, (across - ring) / tube / across, 1 / tube)) < 0.03
    # On the inner side the second curvature is concave: the sign is part of the descriptor.
    assert np.all(f.r[across < ring - 0.5 * tube, 1] < 0)


def test_noise_of_1_mm_costs_less_than_a_tenth():
    rng = np.random.default_rng(0)
    f = features_of(shapes.sphere(0.2, 20000, rng), noise=1e-3)
    assert max(curvature_errors(f, 5.0, 5.0, 5.0)) < 0.10
    f = features_of(shapes.cylinder(0.15, 0.6, 20000, rng), noise=1e-3)
    f = f.take(np.abs(f.p[:, 2]) < 0.3 - RHO)
    assert max(curvature_errors(f, 1 / 0.15, 0.0, 1 / 0.15)) < 0.10
    f = features_of(shapes.plane([0.7, 0.6], 20000, rng), noise=1e-3)
    flat = f.take((np.abs(f.p[:, :2]) < np.array([0.35, 0.3]) - RHO).all(axis=1))
    assert np.percentile(np.abs(flat.r[:, 0]), 99) < 0.05  # below the anisotropy floor


def test_frames_are_right_handed_and_ordered():
    f = features_of(shapes.torus(0.3, 0.1, 20000, np.random.default_rng(0)))
    y = rotate(f.q, np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(y, np.cross(f.normal, f.k1), atol=1e-12)
    assert np.all(np.abs(f.r[:, 0]) >= np.abs(f.r[:, 1]))
    np.testing.assert_allclose(np.linalg.norm(f.q, axis=1), 1.0, atol=1e-12)


@pytest.mark.parametrize("noise", [0.0, 1e-3, 3e-3])
def test_box_normals_point_outward_and_edges_stand_out(noise):
    size = np.array([0.68, 0.61, 0.28])
    f = features_of(shapes.box(size, 20000, np.random.default_rng(0)), noise=noise)
    gap = size / 2 - np.abs(f.p)
    face = np.argmin(gap, axis=1)
    row = np.arange(len(f))
    assert np.mean(np.sign(f.p[row, face]) * f.normal[row, face] > 0) > 0.999
    gap = np.sort(gap, axis=1)
    edge = (np.abs(gap[:, :2]) < 0.004).all(axis=1) & (gap[:, 2] > 2 * RHO)
    # What FeatureParameters.edge_saliency claims of a right-angled edge.
    assert 1.05 < np.median(f.r[edge, 0]) < 1.25
    assert np.median(np.abs(f.r[edge, 1])) < 0.1
    assert np.median(f.saliency[gap[:, 1] > 2 * RHO]) < 0.06
    # Independent draws of some 40 points to a ball leave holes that look like a rim; evenly
    # sampled surfaces do not.
    assert f.rim.mean() < 3e-3


def test_closed_mesh_has_no_rim():
    f = features_of(trimesh.creation.box([0.68, 0.61, 0.28]))
    assert len(f) > 10000
    assert not f.rim.any()


def test_concave_edge_is_negative():
    # Two walls of a room's corner line, seen from inside the room.
    rng = np.random.default_rng(0)
    floor = shapes.plane([0.4, 0.4], 8000, rng) + [0.2, 0, 0]
    wall = shapes.plane([0.4, 0.4], 8000, rng)[:, [2, 1, 0]] + [0, 0, 0.2]
    f = features_of(np.concatenate([floor, wall]), viewpoint=[0.3, 0, 0.3])
    edge = (f.p[:, 0] < 0.004) & (f.p[:, 2] < 0.004) & (np.abs(f.p[:, 1]) < 0.15)
    assert -1.25 < np.median(f.r[edge, 0]) < -1.05


def test_viewpoint_orients_normals():
    points = shapes.plane([0.5, 0.5], 10000, np.random.default_rng(0))
    assert features_of(points, viewpoint=[0, 0, 1.0]).normal[:, 2].min() > 0.99
    assert features_of(points, viewpoint=[0, 0, -1.0]).normal[:, 2].max() < -0.99


def test_one_face_without_viewpoint_looks_up():
    points = shapes.plane([0.7, 0.6], 20000, np.random.default_rng(0))
    f = features_of(points, noise=1e-3)
    assert f.normal[:, 2].min() > 0.9
    turn = random_rotation(np.random.default_rng(3))
    f = features_of(rotate(turn, points), up=rotate(turn, np.array([0, 0, 1.0])))
    assert np.all(f.normal @ rotate(turn, np.array([0, 0, 1.0])) > 0.9)


def test_bowl_seen_from_above_looks_up_and_dome_outward():
    rng = np.random.default_rng(0)
    points = shapes.sphere(0.2, 40000, rng)
    bowl = points[points[:, 2] < 0]
    f = features_of(bowl)
    assert np.all(np.sum(f.normal * f.p, axis=1) < 0)
    assert np.all(f.take(~f.rim).r < 0)
    f = features_of(-bowl)
    assert np.all(np.sum(f.normal * f.p, axis=1) > 0)


def test_thin_plate_has_opposite_normals_on_its_sides():
    # The walls are 2 cm apart, within one neighbourhood of another.
    size = np.array([0.4, 0.3, 0.02])
    f = features_of(shapes.box(size, 40000, np.random.default_rng(0)))
    inner = (np.abs(f.p[:, :2]) < size[:2] / 2 - 2 * RHO).all(axis=1)
    assert np.mean(f.normal[inner, 2] * np.sign(f.p[inner, 2]) > 0.9) > 0.99


def test_separate_parts_are_each_turned_outward():
    ball = shapes.sphere(0.1, 10000, np.random.default_rng(0))
    f = features_of(np.concatenate([ball + [0.3, 0, 0], ball - [0.3, 0, 0]]))
    centre = np.where(f.p[:, :1] > 0, 1, -1) * np.array([0.3, 0, 0])
    assert np.sum(f.normal * (f.p - centre), axis=1).min() > 0.09


def test_rim_of_a_lone_face():
    size = np.array([0.68, 0.61])
    f = features_of(shapes.plane(size, 20000, np.random.default_rng(0)), noise=1e-3)
    gap = size / 2 - np.abs(f.p[:, :2])
    side = np.argmin(gap, axis=1)
    row = np.arange(len(f))
    outline = (gap.min(axis=1) < 0.004) & (gap.max(axis=1) > 2 * RHO)
    assert f.rim[outline].mean() > 0.8
    assert f.rim[gap.min(axis=1) > 0.02].mean() < 1e-3
    outward = f.k1[row, side] * np.sign(f.p[row, side])
    assert np.percentile(outward[outline & f.rim], 5) > 0.9
    np.testing.assert_array_equal(f.saliency[f.rim], FeatureParameters().edge_saliency)
    np.testing.assert_array_equal(f.saliency[~f.rim], np.abs(f.r[~f.rim, 0]))


def one_feature(c, rim, count=20000):
    return SurfaceFeatures(
        p=np.zeros((count, 3)),
        q=np.tile([1.0, 0, 0, 0], (count, 1)),
        r=np.zeros((count, 2)),
        anisotropy=np.full(count, c),
        rim=np.full(count, rim),
        rho=RHO,
    )


def test_spun_draws_the_stated_ambiguity():
    # c = 0.15: std pi exp(-2.25) = 0.331 rad, small enough to tell the two flips apart.
    f = one_feature(0.15, False)
    pose = f.spun(np.random.default_rng(0))
    np.testing.assert_allclose(
        rotate(pose.q, np.array([0, 0, 1.0])), np.tile([0, 0, 1.0], (len(f), 1)), atol=1e-12
    )
    x = rotate(pose.q, np.array([1.0, 0, 0]))
    angle = np.arctan2(x[:, 1], x[:, 0])
    flipped = np.abs(angle) > np.pi / 2
    assert abs(flipped.mean() - 0.5) < 0.02
    assert abs(np.std(angle[~flipped]) / (np.pi * np.exp(-2.25)) - 1) < 0.03
    # No curvature direction at all: every direction is drawn.
    x = rotate(one_feature(0.0, False).spun(np.random.default_rng(0)).q, np.array([1.0, 0, 0]))
    assert np.abs(x.mean(axis=0)).max() < 0.02
    # A rim's sign is known.
    x = rotate(one_feature(1.0, True).spun(np.random.default_rng(0)).q, np.array([1.0, 0, 0]))
    assert x[:, 0].min() > 0.999999
    # Same seed, same draw.
    again = f.spun(np.random.default_rng(0))
    np.testing.assert_array_equal(pose.q, again.q)


def test_features_move_with_the_cloud():
    rng = np.random.default_rng(0)
    points = shapes.torus(0.2, 0.08, 15000, rng)
    turn, shift = random_rotation(rng), np.array([0.3, -1.0, 0.4])
    plain = FeatureParameters(voxel=0.0)  # the voxel grid itself does not turn
    a = compute_features(PointCloud.read(points), plain)
    up = rotate(turn, np.array([0, 0, 1.0]))
    b = compute_features(PointCloud.read(rotate(turn, points) + shift, up=up), plain)
    moved = a.transformed(Pose(shift, turn))
    np.testing.assert_allclose(b.p, moved.p, atol=1e-12)
    np.testing.assert_allclose(b.r, moved.r, atol=1e-7)
    np.testing.assert_allclose(b.normal, moved.normal, atol=1e-8)
    clear = a.anisotropy > 0.3
    angle = rotation_angle(quat_multiply(quat_conjugate(moved.q), b.q))[clear]
    assert np.minimum(angle, np.pi - angle).max() < 1e-5  # k1 is known up to its sign


def test_batches_give_what_one_batch_gives(monkeypatch):
    points = shapes.box([0.3, 0.2, 0.1], 10000, np.random.default_rng(0))
    whole = features_of(points)
    monkeypatch.setattr("drake_aerial.features.neighbourhoods._PAIRS", 3000)
    parts = features_of(points)
    assert len(whole) > 2000
    np.testing.assert_allclose(parts.r, whole.r, atol=1e-9)
    np.testing.assert_array_equal(parts.rim, whole.rim)


def test_the_number_of_cores_makes_no_difference(monkeypatch):
    points = shapes.box([0.3, 0.2, 0.1], 10000, np.random.default_rng(0))
    found = []
    for cores in ("1", "3"):
        monkeypatch.setenv("OMP_NUM_THREADS", cores)
        found.append(features_of(points))
    for name in ("p", "q", "r", "rim"):
        np.testing.assert_array_equal(getattr(found[0], name), getattr(found[1], name))


def test_take_keeps_rows_together():
    f = features_of(shapes.torus(0.3, 0.1, 5000, np.random.default_rng(0)))
    part = f.take([5, 2])
    assert len(part) == 2
    assert part.rho == f.rho
    np.testing.assert_array_equal(part.p, f.p[[5, 2]])
    np.testing.assert_array_equal(part.q, f.q[[5, 2]])
    np.testing.assert_array_equal(part.r, f.r[[5, 2]])


def test_stray_points_are_left_out_and_sparse_clouds_refused():
    points = shapes.plane([0.3, 0.3], 5000, np.random.default_rng(0))
    f = features_of(np.concatenate([points, [[0, 0, 0.5]]]))
    assert f.p[:, 2].max() < 1e-9
    with pytest.raises(
        InputError, match=r"too sparse: neighbouring points are .* cm apart.* scan more densely"
    ):
        features_of(np.random.default_rng(0).uniform(-1, 1, (50, 3)))


@pytest.mark.parametrize("keywords", [{"voxel": 0.05}, {"rho": 0.02, "voxel": 0.02}])
def test_cubes_as_large_as_the_neighbourhood_are_refused(keywords):
    with pytest.raises(InputError, match=r"`voxel` must be < rho = 0\.0[23] m, got 0\.0[25]"):
        FeatureParameters(**keywords)


def test_the_default_cubes_are_a_quarter_of_the_radius():
    assert FeatureParameters(voxel=0.0).voxel_size == 0.0
    assert FeatureParameters(rho=0.02, voxel=0.0199).voxel_size == 0.0199
    assert FeatureParameters(rho=0.02).voxel_size == pytest.approx(0.005)


def bent(radius, count=20000, half=0.1):
    """A patch of a cylinder about y, seen from above, within `half` of the origin."""
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-half, half, (2, count))
    return np.column_stack([x, y, np.sqrt(radius**2 - x**2) - radius])


@pytest.mark.parametrize("radius", [0.15, 0.3, 1.2])
def test_anisotropy_is_the_part_of_the_curvature_that_has_a_direction(radius):
    f = features_of(bent(radius), viewpoint=[0.0, 0.0, 1.0])
    f = f.take((np.abs(f.p[:, :2]) < 0.1 - RHO).all(axis=1))
    assert not f.rim.any()
    # |r1| / max(|r1|, 0.05): below the floor it counts as noise, in proportion.
    assert np.median(f.anisotropy) == pytest.approx(min(1.0, RHO / radius / 0.05), abs=0.05)
    assert np.median(np.abs(f.k1[:, 1])) < 0.05  # across the bend


def test_on_a_torus_anisotropy_is_that_of_its_curvatures():
    ring, tube = 0.3, 0.1
    f = features_of(shapes.torus(ring, tube, 100000, np.random.default_rng(0)))
    across = np.hypot(f.p[:, 0], f.p[:, 1])
    second = np.abs((across - ring) / tube / across)
    assert np.mean(np.abs(f.anisotropy - (1.0 / tube - second) * tube)) < 0.03


def test_where_no_direction_stands_out_any_fixed_tangent_serves():
    grid = 0.004 * np.stack(np.meshgrid(np.arange(50), np.arange(50)), axis=-1).reshape(-1, 2)
    cloud = PointCloud.read(np.column_stack([grid, np.zeros(2500)]), viewpoint=[0.1, 0.1, 1.0])
    f = compute_features(cloud, FeatureParameters(voxel=0.0))
    inside = f.take(~f.rim)
    assert len(inside) > 1500
    np.testing.assert_allclose(inside.r, 0.0, atol=1e-9)
    np.testing.assert_allclose(inside.k1, perpendicular(inside.normal), atol=1e-12)
    np.testing.assert_array_equal(f.anisotropy[f.rim], 1.0)
    np.testing.assert_allclose(inside.anisotropy, 0.0, atol=1e-6)
    # The outline, and nothing that is a radius away from it.
    edge = (np.abs(f.p[:, :2] - 0.098) > 0.0975).any(axis=1)
    assert f.rim[edge].all()
    assert not f.rim[(np.abs(f.p[:, :2] - 0.098) < 0.098 - RHO).all(axis=1)].any()
    assert np.sum(f.k1[f.rim] * (f.p[f.rim] - [0.098, 0.098, 0.0]), axis=1).min() > 0.05  # outward


def test_where_a_ball_is_round_any_fixed_tangent_serves():
    # The pole of a cap of rings: its curvatures are alike, but for rounding, and not zero.
    angle = np.arange(8) * np.pi / 4
    rings = [
        np.column_stack([s * np.cos(angle), s * np.sin(angle), np.full(8, np.sqrt(0.01 - s * s))])
        for s in (0.01, 0.02)
    ]
    cap = np.vstack([[0.0, 0.0, 0.1], *rings])
    f = compute_features(
        PointCloud.read(cap, viewpoint=[0.0, 0.0, 1.0]), FeatureParameters(voxel=0.0)
    )
    pole = f.take(f.p[:, 2] > 0.0999)
    assert pole.r[0, 0] == pytest.approx(pole.r[0, 1], abs=1e-12)
    assert pole.r[0, 0] > 0.05
    np.testing.assert_allclose(pole.k1, perpendicular(pole.normal), atol=1e-9)


@pytest.mark.parametrize("thickness", [0.01, 0.02])
def test_the_other_side_of_a_thin_wall_bends_nothing(thickness):
    size = np.array([0.4, 0.3, thickness])
    f = features_of(shapes.box(size, 40000, np.random.default_rng(0)))
    inner = f.take((np.abs(f.p[:, :2]) < size[:2] / 2 - 2 * RHO).all(axis=1))
    assert np.percentile(np.abs(inner.r), 95) < 0.05
    assert inner.rim.mean() < 0.01


def test_neighbours_on_one_line_say_nothing():
    # A wire beside a plate.
    rng = np.random.default_rng(0)
    wire = np.column_stack([rng.uniform(0.0, 0.3, 400), np.zeros(400), np.full(400, 0.2)])
    plate = shapes.plane([0.3, 0.3], 4000, rng)
    f = compute_features(
        PointCloud.read(np.vstack([wire, plate]), viewpoint=[0, 0, 1]), FeatureParameters(voxel=0.0)
    )
    on_wire = f.take(f.p[:, 2] > 0.1)
    assert len(on_wire) == 400
    assert np.isfinite(on_wire.q).all()
    # Normals of a line are any; what they regress on is bounded, all the same.
    assert np.abs(on_wire.r).max() < 1.0


def test_a_cloud_far_from_the_origin_is_the_same_cloud():
    points = shapes.torus(0.2, 0.08, 15000, np.random.default_rng(0))
    plain = FeatureParameters(voxel=0.0)
    near, far = (
        compute_features(PointCloud.read(points + shift), plain) for shift in (0.0, 1000.0)
    )
    np.testing.assert_allclose(far.r, near.r, atol=1e-6)
    np.testing.assert_array_equal(far.rim, near.rim)
    np.testing.assert_allclose(far.normal, near.normal, atol=1e-6)


def test_as_many_neighbours_as_asked_are_enough():
    # Two clusters, of 6 and of 5 points: a point counts as its own neighbour.
    rng = np.random.default_rng(0)
    six, five = rng.uniform(0.0, 0.01, (6, 3)), rng.uniform(0.0, 0.01, (5, 3)) + 1.0
    f = compute_features(PointCloud.read(np.vstack([six, five])), FeatureParameters(voxel=0.0))
    assert len(f) == 6
    np.testing.assert_array_equal(np.sort(f.p, axis=0), np.sort(six, axis=0))
    both = compute_features(
        PointCloud.read(np.vstack([six, five])), FeatureParameters(voxel=0.0, min_neighbours=5)
    )
    assert len(both) == 11


def test_the_radius_scales_the_descriptor_and_is_kept():
    points = shapes.sphere(0.2, 60000, np.random.default_rng(0))
    f = compute_features(PointCloud.read(points), FeatureParameters(rho=0.05, edge_saliency=0.7))
    assert (f.rho, f.edge_saliency) == (0.05, 0.7)
    assert np.mean(f.r) == pytest.approx(0.05 / 0.2, rel=0.03)


def test_features_of_a_raw_cloud_are_in_the_order_of_its_points():
    rng = np.random.default_rng(5)
    plate = np.column_stack([rng.uniform(-0.1, 0.1, (3000, 2)), np.zeros(3000)])
    stray = np.array([[0.5, 0.5, 0.5], [-0.5, 0.1, 0.0]])
    points = np.concatenate([plate, stray])[rng.permutation(3002)]
    f = compute_features(
        PointCloud.read(points, viewpoint=[0.0, 0.0, 1.0]), FeatureParameters(voxel=0.0)
    )
    np.testing.assert_array_equal(f.p, points[points[:, 2] + np.abs(points[:, 0]) < 0.2])
