import numpy as np
from scipy.spatial.transform import Rotation

from drake_aerial import geometry as g

RNG = np.random.default_rng(0)
N = 500
Q = g.random_rotation(RNG, N)
V = RNG.standard_normal((N, 3))
Z = np.array([0.0, 0.0, 1.0])


def scipy_rotation(q):
    """scipy orders x, y, z, w."""
    return Rotation.from_quat(np.roll(np.asarray(q), -1, axis=-1))


def same_rotation(a, b, tolerance=1e-12):
    np.testing.assert_allclose(np.abs(np.sum(np.asarray(a) * b, axis=-1)), 1.0, atol=tolerance)


def from_scipy(rotation):
    return np.roll(rotation.as_quat(), 1, axis=-1)


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def test_multiply_and_conjugate():
    other = Q[::-1]
    same_rotation(g.quat_multiply(Q, other), from_scipy(scipy_rotation(Q) * scipy_rotation(other)))
    same_rotation(g.quat_conjugate(Q), from_scipy(scipy_rotation(Q).inv()))


def test_rotate_and_matrix():
    np.testing.assert_allclose(g.rotate(Q, V), scipy_rotation(Q).apply(V), atol=1e-13)
    np.testing.assert_allclose(g.matrix_from_quat(Q), scipy_rotation(Q).as_matrix(), atol=1e-13)
    # One rotation of many vectors, and many rotations of one vector.
    np.testing.assert_allclose(g.rotate(Q[0], V), scipy_rotation(Q[0]).apply(V), atol=1e-13)
    np.testing.assert_allclose(g.rotate(Q, Z), scipy_rotation(Q).as_matrix()[:, :, 2], atol=1e-13)
    for i in range(3):
        np.testing.assert_allclose(
            g.axis_of(Q, i), scipy_rotation(Q).as_matrix()[:, :, i], atol=1e-13
        )


def test_matrix_to_quaternion_everywhere():
    # Half turns about the axes, and nearly so, are where a single formula breaks down.
    near = np.array([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [1, 0, 0, 0]], float)
    q = g.quat_normalize(np.concatenate([Q, near, near + 1e-9 * RNG.standard_normal(near.shape)]))
    got = g.quat_from_matrix(g.matrix_from_quat(q))
    same_rotation(got, q)
    assert np.all(got[:, 0] >= 0)


def test_exponential_and_logarithm():
    rotvec = np.concatenate([V, 1e-9 * V, np.zeros((1, 3)), unit(V) * (np.pi - 1e-6)])
    same_rotation(g.quat_exp(rotvec), from_scipy(Rotation.from_rotvec(rotvec)))
    np.testing.assert_allclose(g.quat_log(Q), scipy_rotation(Q).as_rotvec(), atol=1e-12)
    np.testing.assert_allclose(g.quat_log(-Q), g.quat_log(Q), atol=1e-12)
    small = 1e-9 * V
    np.testing.assert_allclose(g.quat_log(g.quat_exp(small)), small, rtol=1e-6, atol=1e-20)
    np.testing.assert_allclose(g.quat_log([1.0, 0, 0, 0]), np.zeros(3))


def test_about_axis_and_angle():
    angle = RNG.uniform(-3, 3, N)
    same_rotation(
        g.quat_about_axis(unit(V), angle),
        from_scipy(Rotation.from_rotvec(unit(V) * angle[:, None])),
    )
    np.testing.assert_allclose(g.rotation_angle(Q), scipy_rotation(Q).magnitude(), atol=1e-12)
    np.testing.assert_allclose(g.rotation_angle(-Q), g.rotation_angle(Q), atol=1e-14)


def test_skew_and_cross():
    other = V[::-1]
    np.testing.assert_allclose(g.cross(V, other), np.cross(V, other), atol=1e-14)
    np.testing.assert_allclose(
        np.einsum("nij,nj->ni", g.skew(V), other), np.cross(V, other), atol=1e-14
    )


def test_perpendicular():
    directions = np.concatenate([unit(V), np.eye(3), -np.eye(3)])
    x = g.perpendicular(directions)
    np.testing.assert_allclose(np.sum(x * directions, axis=1), 0.0, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(x, axis=1), 1.0, atol=1e-14)


def test_frame_from_x_and_z():
    z = unit(V)
    x = unit(V[::-1])
    R = scipy_rotation(g.quat_from_xz(x, z)).as_matrix()
    np.testing.assert_allclose(R[:, :, 2], z, atol=1e-12)
    np.testing.assert_allclose(R[:, :, 1], np.cross(R[:, :, 2], R[:, :, 0]), atol=1e-12)
    # x is the unit vector nearest to the one given: both lie in a plane with z.
    assert np.all(np.sum(R[:, :, 0] * x, axis=1) > 0)
    np.testing.assert_allclose(np.sum(np.cross(z, x) * R[:, :, 0], axis=1), 0.0, atol=1e-12)


def test_smallest_rotation_between_vectors():
    a, b = unit(V), unit(V[::-1])
    q = g.quat_from_two_vectors(a, b)
    np.testing.assert_allclose(scipy_rotation(q).apply(a), b, atol=1e-12)
    between = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1))
    np.testing.assert_allclose(g.rotation_angle(q), between, atol=1e-9)
    for axis in np.eye(3):
        np.testing.assert_allclose(
            g.rotate(g.quat_from_two_vectors(axis, -axis), axis), -axis, atol=1e-9
        )
        same_rotation(g.quat_from_two_vectors(axis, axis), [1, 0, 0, 0])


def homogeneous(X):
    T = np.tile(np.eye(4), (*X.p.shape[:-1], 1, 1))
    T[..., :3, :3] = scipy_rotation(X.q).as_matrix()
    T[..., :3, 3] = X.p
    return T


def test_poses_compose_and_invert_as_matrices_do():
    X_AB, X_BC = g.Pose(V, Q), g.Pose(V[::-1] * 2, Q[::-1])
    np.testing.assert_allclose(
        homogeneous(X_AB @ X_BC), homogeneous(X_AB) @ homogeneous(X_BC), atol=1e-12
    )
    np.testing.assert_allclose(
        homogeneous(g.invert(X_AB)), np.linalg.inv(homogeneous(X_AB)), atol=1e-12
    )
    p_B = RNG.standard_normal((N, 3))
    expected = (homogeneous(X_AB) @ np.append(p_B, np.ones((N, 1)), axis=1)[..., None])[:, :3, 0]
    np.testing.assert_allclose(g.transform(X_AB, p_B), expected, atol=1e-12)
    # One pose broadcasts over many.
    one = X_AB.take(0)
    np.testing.assert_allclose(
        homogeneous(one @ X_BC), homogeneous(one) @ homogeneous(X_BC), atol=1e-12
    )
    np.testing.assert_allclose(g.transform(one, p_B)[3], g.transform(one, p_B[3]), atol=1e-14)


def test_identity():
    X = g.identity(4, 2)
    assert X.p.shape == (4, 2, 3)
    assert X.q.shape == (4, 2, 4)
    np.testing.assert_array_equal(g.transform(X, np.ones(3)), np.ones((4, 2, 3)))
    np.testing.assert_array_equal(g.identity().q, [1, 0, 0, 0])


def test_random_rotations_are_uniform():
    q = g.random_rotation(np.random.default_rng(1), 20000)
    assert q.shape == (20000, 4)
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, atol=1e-12)
    # Haar measure: the angle has density (1 - cos a) / pi, hence mean pi/2 + 2/pi.
    assert abs(g.rotation_angle(q).mean() - (np.pi / 2 + 2 / np.pi)) < 0.02
    assert np.abs(g.rotate(q, Z).mean(axis=0)).max() < 0.02


def test_products_are_numpys_own():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 5, 4, 3))
    np.testing.assert_allclose(g.small_cross(a, b), np.cross(a, b), atol=1e-15)
    np.testing.assert_allclose(g.small_cross(a, b[0, 0]), np.cross(a, b[0, 0]), atol=1e-15)
    np.testing.assert_allclose((g.skew(a) @ b[..., None])[..., 0], np.cross(a, b), atol=1e-15)


def test_vee_takes_the_antisymmetric_part():
    rng = np.random.default_rng(1)
    v, M = rng.normal(size=(6, 3)), rng.normal(size=(6, 3, 3))
    symmetric = M + M.mT
    np.testing.assert_allclose(g.vee(g.skew(v) + symmetric), v, atol=1e-15)
