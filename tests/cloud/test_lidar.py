import sys

import numpy as np
import pytest

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.cloud.readers import read_geometry
from drake_aerial.errors import InputError

laspy = pytest.importorskip("laspy")
# Map coordinates, which 32-bit floats would round to 6 cm.
P = np.random.default_rng(0).uniform(-0.5, 0.5, (300, 3)) + [836419.84, 818050.75, 4.9]


@pytest.mark.parametrize("version", ["1.2", "1.4"])
@pytest.mark.parametrize("point_format", [0, 3])
def test_files_that_laspy_wrote(tmp_path, version, point_format):
    las = laspy.create(point_format=point_format, file_version=version)
    las.header.offsets, las.header.scales = P.min(axis=0), [1e-4] * 3
    las.x, las.y, las.z = P.T
    las.write(tmp_path / "scan.las")
    np.testing.assert_allclose(read_geometry(tmp_path / "scan.las").points, P, atol=6e-5)
    cloud = PointCloud.read(tmp_path / "scan.las")
    assert len(cloud) == 300
    assert cloud.extent.max() < 1.0


def test_damaged_files_are_refused(tmp_path):
    las = laspy.create()
    las.x, las.y, las.z = P.T - P.min()
    las.write(tmp_path / "scan.las")
    data = (tmp_path / "scan.las").read_bytes()
    for damaged in (b"LASF" + b"\0" * 400, b"no lidar", data[:-100], data[:100]):
        (tmp_path / "scan.las").write_bytes(damaged)
        with pytest.raises(InputError, match="not a valid LAS file"):
            read_geometry(tmp_path / "scan.las")


@pytest.mark.parametrize(("suffix", "library"), [(".las", "laspy"), (".e57", "pye57")])
def test_without_the_library_the_message_names_it(tmp_path, monkeypatch, suffix, library):
    monkeypatch.setitem(sys.modules, library, None)
    path = tmp_path / f"scan{suffix}"
    path.write_bytes(b"LASF")
    with pytest.raises(InputError, match=f"the library {library}.* is not installed; pip install"):
        read_geometry(path)


def write_e57(path, *scans):
    """Write an E57 by pye57; a scan is its points, rotation (w, x, y, z) and translation."""
    pye57 = pytest.importorskip("pye57")
    with pye57.E57(str(path), mode="w") as file:
        for points, rotation, translation in scans:
            data = {f"cartesian{axis}": points[:, k].copy() for k, axis in enumerate("XYZ")}
            file.write_scan_raw(
                data, rotation=np.array(rotation, float), translation=np.array(translation, float)
            )
    return path


IDENTITY = (1.0, 0.0, 0.0, 0.0)


def test_map_coordinates_by_the_pose_of_an_e57_keep_their_precision(tmp_path):
    # pye57 writes 32-bit points; their scan's translation is of 64 bits.
    centre = P.mean(axis=0)
    path = write_e57(tmp_path / "scan.e57", (P - centre, IDENTITY, centre))
    np.testing.assert_allclose(read_geometry(path).points, P, rtol=0, atol=1e-6)
    cloud = PointCloud.read(path)
    assert len(cloud) == 300
    assert cloud.extent.max() < 1.0


def test_map_coordinates_of_32_bits_in_an_e57_are_refused(tmp_path):
    path = write_e57(tmp_path / "scan.e57", (P, IDENTITY, (0, 0, 0)))
    with pytest.raises(InputError, match=r"are 32-bit floats, rounded to steps of 0.06"):
        PointCloud.read(path)


def test_the_scans_of_an_e57_are_joined_in_one_frame(tmp_path):
    local = P - P.mean(axis=0)
    quarter = (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))  # about z: x to y, y to -x
    path = write_e57(
        tmp_path / "scan.e57",
        (local[:100], IDENTITY, (0, 0, 0)),
        (local[100:], quarter, (1.0, 2.0, 3.0)),
    )
    x, y, z = local[100:].T
    expected = np.concatenate([local[:100], np.stack([1 - y, 2 + x, 3 + z], axis=1)])
    np.testing.assert_allclose(read_geometry(path).points, expected, rtol=0, atol=1e-6)


def test_damaged_e57_files_are_refused(tmp_path):
    path = write_e57(tmp_path / "scan.e57", (P, IDENTITY, (0, 0, 0)))
    data = path.read_bytes()
    for damaged in (b"ASTM-E57", b"no lidar", data[:-500], data[:100]):
        path.write_bytes(damaged)
        with pytest.raises(InputError, match="not a valid E57 file") as caught:
            read_geometry(path)
        assert "\n" not in str(caught.value)
