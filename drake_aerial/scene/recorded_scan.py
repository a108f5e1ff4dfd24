"""Read the scan again that a result's record names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.scene.depth_image import read_depth_image


def read_recorded_scan(record: dict[str, Any], path: str | Path) -> PointCloud:
    """Return the cloud in the file `path` as the record of `PointCloud.to_record` read it.

    Raises
    ------
    InputError
        If the file cannot be read, or its points are not those of the record.
    """
    up = record.get("up", (0.0, 0.0, 1.0))
    if record.get("camera") is not None:
        cloud = read_depth_image(path, record["camera"], up=up)
    else:
        cloud = PointCloud.read(path, viewpoint=record.get("viewpoint"), up=up)
    if record.get("sha256") and cloud.sha256 != record["sha256"]:
        raise InputError(f"the scan {path} is not the one of the contacts: its points differ")
    return cloud
