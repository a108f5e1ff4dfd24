"""Read LiDAR files, .las .laz and .e57, with optional libraries."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.cloud.raw_geometry import RawGeometry, invalid
from drake_aerial.errors import InputError


def read_lidar(path: Path) -> RawGeometry:
    """Return the points of a .las, .laz or .e57 file; several scans of an .e57 are joined.

    Raises
    ------
    InputError
        If the optional library is not installed, or the file cannot be read.
    """
    read = _read_e57 if path.suffix.lower() == ".e57" else _read_las
    try:
        points = read(path)
    except ImportError as error:
        library = "pye57" if path.suffix.lower() == ".e57" else "laspy[lazrs]"
        raise InputError(
            f"cannot read {path}: the library {library} is not installed; pip install '{library}'"
        ) from error
    except OSError:
        raise
    except Exception as error:  # the libraries raise errors of many types
        raise invalid(path, error) from error
    if len(points) == 0:
        raise InputError(f"{path} holds no points")
    return RawGeometry(points, None, str(path), str(path))


def _read_las(path: Path) -> np.ndarray:
    import laspy

    with laspy.open(path) as reader:
        if reader.header.point_count == 0:
            return np.zeros((0, 3))
        if path.suffix.lower() == ".las" and reader.header.point_count > path.stat().st_size:
            raise ValueError(f"{reader.header.point_count} points do not fit into the file")
        cloud = reader.read()
    if len(cloud.points) < reader.header.point_count:
        raise ValueError(
            f"{reader.header.point_count} points declared, {len(cloud.points)} present"
        )
    return np.stack([cloud.x, cloud.y, cloud.z], axis=1)


def _read_e57(path: Path) -> np.ndarray:
    import pye57

    file: Any = pye57.E57(str(path))
    scans = []
    for k in range(file.scan_count):
        scan = file.read_scan(k, ignore_missing_fields=True)
        scans.append(np.stack([scan[f"cartesian{axis}"] for axis in "XYZ"], axis=1))
    return np.concatenate(scans) if scans else np.zeros((0, 3))
