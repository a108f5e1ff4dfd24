import numpy as np
import pytest

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.features.sampling_distance import sampling_distance
from drake_aerial.features.surface_features import compute_features


def lines(along, across):
    """Points on lines: `along` metres apart on a line, lines `across` metres apart."""
    x, y = np.meshgrid(np.arange(-0.3, 0.3, along), np.arange(-0.3, 0.3, across))
    return np.c_[x.ravel(), y.ravel(), 0 * x.ravel()]


@pytest.mark.parametrize(("along", "across"), [(0.01, 0.01), (0.005, 0.02), (0.003, 0.04)])
def test_the_distance_is_the_one_across_scan_lines(along, across):
    turn, _ = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))
    for points in (lines(along, across), lines(along, across) @ turn):
        assert sampling_distance(points, 0.03) == pytest.approx(across, rel=0.15)


def test_sparse_scans_are_noted_or_refused():
    assert compute_features(PointCloud.read(lines(0.01, 0.01))).assumptions == ()
    noted = compute_features(PointCloud.read(lines(0.01, 0.018))).assumptions
    assert [str(a.kind) for a in noted] == ["spacing"]
    assert "neighbouring points are 1.8 cm apart, 1.5 cm or less are better" in noted[0].text
    with pytest.raises(InputError, match=r"too sparse: neighbouring points are 2.2 cm apart"):
        compute_features(PointCloud.read(lines(0.01, 0.022)))


def test_a_scan_in_another_unit_is_told_so():
    with pytest.raises(
        InputError, match=r"sparse: .* the cloud is 29.9 m large; are .* or centimetres"
    ):
        compute_features(PointCloud.read(lines(0.003, 0.003) * 50))
