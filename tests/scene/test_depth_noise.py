"""The noise of a depth camera: grows with the square of depth, in steps, with gaps at jumps."""

import numpy as np
import pytest

from drake_aerial import InputError
from drake_aerial.scene.depth_noise import DepthNoise

EXACT = DepthNoise(inverse_depth=0.0, quantum=0.0, flying=0.0, shadow_u=0.0, shadow_v=0.0)


def wall(depth, shape=(120, 160)):
    return np.full(shape, depth)


def step(near=1.0, far=1.5):
    """Return an image whose left half is nearer."""
    image = wall(far)
    image[:, :80] = near
    return image


def test_noise_grows_with_the_square_of_depth():
    noise = DepthNoise(quantum=0.0)
    sigma = [noise.applied(wall(z), np.random.default_rng(0)).std() / z**2 for z in (0.6, 1.2, 2.4)]
    np.testing.assert_allclose(sigma, noise.inverse_depth, rtol=0.02)


def test_depths_come_in_steps_of_inverse_depth():
    image = DepthNoise().applied(wall(1.0), np.random.default_rng(0))
    steps = 1.0 / image / DepthNoise().quantum
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    # About 3 mm at 1 m.
    values = np.unique(image)
    assert np.diff(values).min() == pytest.approx(0.00285, rel=0.05)


def test_without_noise_the_image_is_exact():
    np.testing.assert_allclose(EXACT.applied(step(), np.random.default_rng(0)), step())


def test_the_same_generator_gives_the_same_image_and_leaves_the_input():
    image = step()
    a, b = (DepthNoise().applied(image, np.random.default_rng(3)) for _ in range(2))
    np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(image, step())


def test_gaps_are_on_the_far_side_of_a_jump_and_as_wide_as_stated():
    noise = DepthNoise(inverse_depth=0.0, quantum=0.0, flying=0.0, shadow_u=6.0)
    image = noise.applied(step(), np.random.default_rng(0))
    lost = image == 0.0
    assert not lost[:, :80].any()
    # The whole part of an exponential variable of mean m is 1 / (exp(1 / m) - 1) on average.
    assert lost.sum(axis=1).mean() == pytest.approx(1.0 / np.expm1(1.0 / 6.0), rel=0.3)


def test_flying_pixels_lie_between_the_two_depths():
    noise = DepthNoise(inverse_depth=0.0, quantum=0.0, flying=1.0, shadow_u=0.0, shadow_v=0.0)
    image = noise.applied(step(), np.random.default_rng(0))
    beside = image[:, 80]
    assert (beside > 1.0).all()
    assert (beside < 1.5).all()
    np.testing.assert_allclose(np.delete(image, 80, axis=1), np.delete(step(), 80, axis=1))


def test_grazing_surfaces_and_depths_out_of_range_are_lost():
    v = np.arange(120)[:, None]
    # Inverse depth is linear in the pixel on a plane; its slope times f z is the angle's tangent.
    steep = np.repeat(1.0 / (1.0 + v * np.tan(np.deg2rad(85.0)) / 525.0), 160, axis=1)
    assert (EXACT.applied(steep, np.random.default_rng(0))[1:10] == 0.0).all()
    assert (EXACT.applied(wall(9.0), np.random.default_rng(0)) == 0.0).all()
    assert (EXACT.applied(wall(np.inf), np.random.default_rng(0)) == 0.0).all()


def test_an_image_of_another_shape_is_refused():
    with pytest.raises(InputError, match=r"shape \(H, W\), got \(2, 2, 1\)"):
        DepthNoise().applied(np.ones((2, 2, 1)), np.random.default_rng(0))
