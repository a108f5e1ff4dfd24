"""Read the geometry of a cloud or mesh from a file or an object."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.cloud.lidar import read_lidar
from drake_aerial.cloud.obj import read_obj
from drake_aerial.cloud.objects import OBJECTS, from_array, from_object
from drake_aerial.cloud.pcd import read_pcd
from drake_aerial.cloud.ply import read_ply
from drake_aerial.cloud.raw_geometry import RawGeometry
from drake_aerial.cloud.stl import read_stl
from drake_aerial.cloud.text import read_text
from drake_aerial.errors import InputError
from drake_aerial.io.archives import load_arrays


def read_geometry(source: Any) -> RawGeometry:
    """Return the points, and triangles if any, of a file or object.

    Parameters
    ----------
    source : path, array or object
        See `SOURCES`.

    Raises
    ------
    InputError
        If the source is of another kind, or cannot be read.
    """
    if isinstance(source, str | Path):
        return _read_file(Path(source))
    geometry = from_object(source)
    if geometry is None:
        raise InputError(
            f"cannot read a point cloud from a {type(source).__name__}; give {SOURCES}"
        )
    return geometry


def _read_file(path: Path) -> RawGeometry:
    suffix = path.suffix.lower()
    if not os.path.exists(path):
        raise InputError(f"no such file: {path}")
    if not os.path.isfile(path):
        raise InputError(f"{path} is not a file; give {SOURCES}")
    if suffix in (".png", ".tif", ".tiff", ".exr"):
        raise InputError(
            f"{path} is an image; a depth image needs its intrinsics: --camera camera.yaml, "
            "or drake_aerial.read_depth_image"
        )
    if suffix in (".mcap", ".db3", ".bag"):
        raise InputError(f"{path} is a bag; read it with drake_aerial.read_scan")
    if suffix not in _READERS:
        given = f"format {suffix!r}" if suffix else "no file extension"
        raise InputError(f"cannot read {path}: {given}; accepted formats are {' '.join(FORMATS)}")
    try:
        if path.stat().st_size == 0:
            raise InputError(f"{path} is empty (0 bytes)")
        return _READERS[suffix](path)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error


def _read_numpy(path: Path) -> RawGeometry:
    values = load_arrays(path)
    if isinstance(values, dict):
        if "points" not in values:
            held = ", ".join(values) or "nothing"
            raise InputError(f"{path} has no array named 'points'; it holds: {held}")
        values = values["points"]
    return from_array(np.asarray(values), str(path), str(path))


_READERS: dict[str, Callable[[Path], RawGeometry]] = {
    ".ply": read_ply,
    ".pcd": read_pcd,
    ".obj": read_obj,
    ".stl": read_stl,
    ".npz": _read_numpy,
    ".npy": _read_numpy,
    **dict.fromkeys((".xyz", ".txt", ".csv", ".pts", ".asc"), read_text),
    **dict.fromkeys((".las", ".laz", ".e57"), read_lidar),
}
FORMATS = tuple(_READERS)
SOURCES = f"a file ({' '.join(FORMATS)}), {OBJECTS}"
