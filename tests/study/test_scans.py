from dataclasses import replace

import numpy as np
import pytest

from drake_aerial import InputError, PointCloud
from drake_aerial.study.conditions import Condition
from drake_aerial.study.scans import scan, write_scan

BOX = Condition("A", "box_68x61x28", demonstration="flat", points=4000)


def test_full_scans_see_all_sides_and_top_scans_the_top_alone():
    full = scan(BOX, 1).points
    assert len(full) == 4000
    assert np.allclose(full.min(axis=0), [-0.34, -0.305, -0.14], atol=0.005)
    top = scan(replace(BOX, view="top"), 1)
    assert np.allclose(top.points[:, 2], 0.14, atol=0.006)
    assert np.std(top.points[:, 2]) == pytest.approx(0.001, rel=0.1)
    assert top.viewpoint[2] > 1.0
    # The top's share of the whole surface.
    assert len(top) == pytest.approx(
        4000 * 0.68 * 0.61 / (2 * (0.68 * 0.61 + 0.28 * (0.68 + 0.61))), rel=0.02
    )


def test_partial_scans_hide_what_the_camera_does_not_see():
    cloud = scan(replace(BOX, view="partial", viewpoint=(0.0, -2.0, 1.0), scan_noise=0.0), 1)
    assert cloud.points[:, 2].min() < -0.13
    assert not (cloud.points[cloud.points[:, 2] < 0.13][:, 1] > 0.0).any()


def test_scans_repeat_and_differ_by_their_seed():
    assert np.array_equal(scan(BOX, 5).points, scan(BOX, 5).points)
    assert not np.array_equal(scan(BOX, 5).points, scan(BOX, 6).points)


def test_a_bunny_has_no_top_face():
    with pytest.raises(InputError, match="level top face"):
        scan(Condition("E", "bunny", demonstration="flat", view="top"), 0)


def test_a_written_scan_is_the_scan_read(tmp_path):
    cloud = scan(replace(BOX, view="top"), 2)
    write_scan(tmp_path / "scans" / "A.npz", cloud)
    again = PointCloud.read(tmp_path / "scans" / "A.npz")
    assert again.sha256 == cloud.sha256
