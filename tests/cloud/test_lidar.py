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
