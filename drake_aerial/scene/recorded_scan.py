"""Re-read the scan that a result's record names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.scene.bags import is_bag, read_bag
from drake_aerial.scene.depth_image import FORMATS, read_depth_image
from drake_aerial.scene.object_choice import recorded_object


def read_recorded_scan(record: Mapping[str, Any], path: str | Path) -> PointCloud:
    """Return the cloud in the file or bag `path`, read with the record of `PointCloud.to_record`.

    The record's topic is used if `path` is a bag, its camera if that is a bag or an image: the
    scan may have been saved in another format. For an object of a scene, the scene is found again
    and the same object is taken.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    found = record.get("object")
    if found is not None:
        return recorded_object(_whole(record, path, found.get("scene_up")), found)
    return _whole(record, path, record.get("up") or (0.0, 0.0, 1.0))


def _whole(record: Mapping[str, Any], path: str | Path, up: ArrayLike | None) -> PointCloud:
    viewpoint = record.get("viewpoint")
    if is_bag(Path(path)):
        return read_bag(
            path, record.get("topic"), viewpoint=viewpoint, up=up, camera=record.get("camera")
        )
    if record.get("camera") is not None and Path(path).suffix.lower() in FORMATS:
        return read_depth_image(path, record["camera"], up=up)
    return PointCloud.read(path, viewpoint=viewpoint, up=up)
