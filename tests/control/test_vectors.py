import numpy as np

from drake_aerial.control.vectors import cross, skew, vee


def test_products_are_numpys_own():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 5, 4, 3))
    np.testing.assert_allclose(cross(a, b), np.cross(a, b), atol=1e-15)
    np.testing.assert_allclose(cross(a, b[0, 0]), np.cross(a, b[0, 0]), atol=1e-15)
    np.testing.assert_allclose((skew(a) @ b[..., None])[..., 0], np.cross(a, b), atol=1e-15)


def test_vee_takes_the_antisymmetric_part():
    rng = np.random.default_rng(1)
    v, M = rng.normal(size=(6, 3)), rng.normal(size=(6, 3, 3))
    symmetric = M + M.mT
    np.testing.assert_allclose(vee(skew(v) + symmetric), v, atol=1e-15)
