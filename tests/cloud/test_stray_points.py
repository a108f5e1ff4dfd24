import numpy as np
import pytest

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.cloud.stray_points import stray_points
from tests.features import cloud_shapes as shapes

RNG = np.random.default_rng(0)
PLATE = shapes.plane([0.6, 0.4], 5000, np.random.default_rng(1))


@pytest.mark.parametrize(
    "stray",
    [
        np.array([[0, 0, 0.5]]),
        np.array([[5.0, 0, 0], [0, -7.0, 0], [0, 0, 1e6], [1e30, 0, 0]]),
        np.full((2000, 3), [1.3, -0.9, 0.9]),  # invalid pixels, carried to the world
        RNG.normal([0, 0, 1.0], 0.01, (20, 3)),
    ],
)
def test_points_far_from_the_rest_are_stray(stray):
    points = np.concatenate([PLATE, stray])
    order = RNG.permutation(len(points))
    found = stray_points(points[order])
    np.testing.assert_array_equal(found, order >= len(PLATE))
    cloud = PointCloud.read(points)
    np.testing.assert_array_equal(cloud.points, PLATE)
    assert cloud.dropped_points == len(stray)
    assert [str(a.kind) for a in cloud.assumptions] == ["dropped"]
    assert f"{len(stray)} of {len(points)} points" in cloud.assumptions[0].text


def test_zeros_at_the_origin_are_stray():
    points = np.concatenate([PLATE + [0, 0, 1.0], np.zeros((900, 3))])
    assert len(PointCloud.read(points)) == len(PLATE)


@pytest.mark.parametrize(
    "points",
    [
        PLATE,
        np.repeat(PLATE, 3, axis=0),
        np.concatenate([PLATE, PLATE + [0, 0, 0.8]]),  # two things
        np.concatenate([PLATE, np.full((500, 3), PLATE[7])]),  # repeated points on the surface
        PLATE[:100],
        RNG.uniform(-1, 1, (300, 3)),
        np.outer(np.linspace(0, 1, 500), [1.0, 0, 0]),
        np.zeros((500, 3)),
    ],
)
def test_surfaces_have_no_stray_points(points):
    assert not stray_points(points).any()


def test_the_hash_is_that_of_the_points_as_read():
    # Contacts that were found on a scan before stray points were dropped still find it.
    points = np.concatenate([PLATE, [[0, 0, 0.5]]])
    assert PointCloud.read(points).sha256 != PointCloud.read(PLATE).sha256
