"""Re-read the scan that a result's record names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.scene.bags import is_bag, read_bag
from drake_aerial.scene.depth_image import FORMATS, read_depth_image


def read_recorded_scan(record: Mapping[str, Any], path: str | Path) -> PointCloud:
    """Return the cloud in the file or bag `path`, read with the record of `PointCloud.to_record`.

    The record's topic is used if `path` is a bag, its camera if that is a bag or an image: the
    scan may have been saved in another format.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    up = record.get("up") or (0.0, 0.0, 1.0)
    if is_bag(Path(path)):
        return read_bag(
            path,
            record.get("topic"),
            viewpoint=record.get("viewpoint"),
            up=up,
            camera=record.get("camera"),
        )
    if record.get("camera") is not None and Path(path).suffix.lower() in FORMATS:
        return read_depth_image(path, record["camera"], up=up)
    return PointCloud.read(path, viewpoint=record.get("viewpoint"), up=up)
