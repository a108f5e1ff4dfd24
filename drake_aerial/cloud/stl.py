"""Read STL files, ASCII and binary.

Written here because trimesh refuses binary files with bytes after the last triangle.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from drake_aerial.cloud.raw_geometry import RawGeometry, cut_short, invalid
from drake_aerial.errors import InputError

_HEADER = 84
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


def read_stl(path: Path) -> RawGeometry:
    """Return the vertices (three for each triangle) and triangles of an STL file.

    Raises
    ------
    InputError
        If the file is not a valid STL file, is cut short, or has no triangles.
    """
    data = path.read_bytes()
    # Binary headers may begin with "solid" too.
    text = data[:1000].lstrip().lower().startswith(b"solid") and b"\0" not in data[:1000]
    points = _ascii(path, data) if text else _binary(path, data)
    if len(points) == 0:
        raise InputError(f"{path} holds no triangles")
    faces = np.arange(len(points), dtype=np.int64).reshape(-1, 3)
    return RawGeometry(points, faces, str(path), str(path))


def _ascii(path: Path, data: bytes) -> np.ndarray:
    corners = _VERTEX.findall(data)
    if len(corners) % 3 or not re.search(rb"\bend\s?solid\b", data, re.IGNORECASE):
        raise cut_short(path, f"no line 'endsolid' after {len(corners) // 3} triangles")
    if not corners and re.search(rb"\bfacet\b", data, re.IGNORECASE):
        raise invalid(path, "its facets have no vertices")
    try:
        return np.array(corners, dtype="S").astype(np.float64).reshape(-1, 3)
    except ValueError as error:
        raise invalid(path, error) from error


def _binary(path: Path, data: bytes) -> np.ndarray:
    if len(data) < _HEADER:
        raise invalid(path, f"it has {len(data)} bytes; a binary header has {_HEADER}")
    count = int(np.frombuffer(data, "<u4", 1, _HEADER - 4)[0])
    present = (len(data) - _HEADER) // _TRIANGLE.itemsize
    if present < count:
        # Text of another kind gives a random count.
        if b"\0" not in data[:1000]:
            raise invalid(path, "it begins with neither 'solid' nor a binary header")
        raise cut_short(path, f"{count} triangles declared, {present} present")
    table = np.frombuffer(data, _TRIANGLE, count, _HEADER)
    return table["corners"].reshape(-1, 3).astype(np.float64)
