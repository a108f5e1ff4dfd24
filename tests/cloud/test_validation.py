import numpy as np
import pytest
import trimesh

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.cloud.validation import rounding_step
from drake_aerial.errors import InputError

BOX = PointCloud.read(trimesh.creation.box([0.6, 0.4, 0.2]), samples=3000).points
MAP = np.array([836419.84, 818050.75, 4.9])


def test_map_coordinates_in_32_bits_are_refused():
    rounded = (BOX + MAP).astype(np.float32)
    assert rounding_step(rounded.astype(float)) == 0.0625
    with pytest.raises(
        InputError, match=r"8\.36e\+05 m are 32-bit floats, rounded to steps of 0\.062 m; subtract"
    ):
        PointCloud.read(rounded)


@pytest.mark.parametrize(
    "points",
    [
        BOX + MAP,
        BOX.astype(np.float32),
        (BOX + [1000, 0, 0]).astype(np.float32),
        np.round(20 * BOX),
    ],
)
def test_other_coordinates_are_precise_enough(points):
    assert PointCloud.read(points).points.shape == BOX.shape


@pytest.mark.parametrize(
    ("factor", "names"),
    [
        (1000.0, ["600 m", "millimetres (then it is 0.6 m)"]),
        (100.0, ["60 m", "centimetres (then it is 0.6 m)", "inches"]),
    ],
)
def test_clouds_that_are_too_large_are_refused_with_their_likely_units(factor, names):
    with pytest.raises(InputError) as caught:
        PointCloud.read(BOX * factor)
    for name in names:
        assert name in str(caught.value)


def test_large_clouds_are_noted():
    cloud = PointCloud.read(BOX / 0.0254)
    assert [str(a.kind) for a in cloud.assumptions] == ["units"]
    assert "23.6 m large" in cloud.assumptions[0].text
    assert "inches (then it is 0.6 m)" in cloud.assumptions[0].text
    assert cloud.to_record()["assumptions"] == [
        {"kind": "units", "text": cloud.assumptions[0].text}
    ]


def test_clean_clouds_have_no_assumptions():
    cloud = PointCloud.read(BOX)
    assert cloud.assumptions == ()
    assert "assumptions" not in cloud.to_record()


def test_faces_that_use_few_vertices_are_ignored():
    mesh = trimesh.Trimesh(BOX, [[0, 1, 2]], process=False)
    cloud = PointCloud.read(mesh)
    np.testing.assert_array_equal(cloud.points, BOX)
    assert [str(a.kind) for a in cloud.assumptions] == ["faces"]
    assert "only 3 of 3000 vertices" in cloud.assumptions[0].text
