"""The scan of a contacts.json is found where its path says, or beside it, by its points."""

import numpy as np
import pytest

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.scan_lookup import find_scan
from drake_aerial.errors import InputError


@pytest.fixture
def points():
    return np.random.default_rng(0).uniform(-0.3, 0.3, (500, 3))


@pytest.fixture
def record(points, tmp_path):
    """The record of a cloud whose file is deleted again."""
    np.save(tmp_path / "scan.npy", points)
    cloud = PointCloud.read(tmp_path / "scan.npy", viewpoint=[0.0, 0.0, 2.0], up=[0.0, 1.0, 0.0])
    (tmp_path / "scan.npy").unlink()
    return cloud.to_record()


@pytest.mark.parametrize("place", ["as it stands", "relative", "file name alone"])
def test_the_scan_is_found_by_path_relative_path_or_name(place, points, record, tmp_path):
    folder = tmp_path / "moved"
    (folder / "scans").mkdir(parents=True)
    if place == "relative":
        record["path"] = "scans/scan.npy"
    target = {
        "as it stands": tmp_path / "scan.npy",
        "relative": folder / "scans" / "scan.npy",
        "file name alone": folder / "scan.npy",
    }[place]
    np.save(target, points)
    found = find_scan(record, folder)
    assert found.path == str(target)
    assert (found.points == points).all()
    assert found.viewpoint.tolist() == [0.0, 0.0, 2.0]
    assert found.up.tolist() == [0.0, 1.0, 0.0]


def test_another_cloud_of_the_same_name_does_not_hide_the_right_one(points, record, tmp_path):
    folder = tmp_path / "moved"
    folder.mkdir()
    np.save(tmp_path / "scan.npy", points + 0.1)
    np.save(folder / "scan.npy", points)
    assert (find_scan(record, folder).points == points).all()


def test_messages_tell_what_is_missing(points, record, tmp_path):
    with pytest.raises(InputError, match=r"scan .*scan\.npy .* not found, also not beside"):
        find_scan(record, tmp_path)
    np.save(tmp_path / "scan.npy", points + 0.1)
    with pytest.raises(InputError, match=r"scan\.npy is not the scan .* its points differ"):
        find_scan(record, tmp_path)
    with pytest.raises(InputError, match="do not name a scan file"):
        find_scan({"path": None}, tmp_path)
