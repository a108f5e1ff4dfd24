"""Outward horizontal directions of surface features, and the saliency that gravity frames use."""

import numpy as np

from drake_aerial.features.horizontal_direction import (
    gravity_saliency,
    horizontal_direction,
    outward_direction,
)
from tests.features.made_features import five_features


def test_outward_is_across_a_rim_and_along_the_normal_elsewhere():
    f = five_features()
    np.testing.assert_allclose(outward_direction(f)[:4], f.normal[:4], atol=1e-12)
    np.testing.assert_allclose(outward_direction(f)[4], [-1, 0, 0], atol=1e-12)


def test_horizontal_directions_have_unit_length_and_keep_their_horizontal_part():
    t, length = horizontal_direction(five_features())
    np.testing.assert_allclose(length, [1.0, 0.6, 0.15, 0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(t, [[0, -1], [1, 0], [1, 0], [1, 0], [-1, 0]], atol=1e-12)


def test_gravity_saliency_vanishes_on_a_flat_top_and_counts_in_full_from_a_tilt_of_0_3():
    # The rim counts as an edge of saliency 2.
    np.testing.assert_allclose(
        gravity_saliency(five_features()), [0.5, 0.4, 0.4, 0.0, 2.0], atol=1e-12
    )
