"""Read PCD files: ASCII, binary and compressed, with fields of any type, size and count.

Written here because Open3D reads fields of 8 bytes as zeros and refuses names in capitals.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_aerial.cloud.coordinate_names import coordinate_names
from drake_aerial.cloud.raw_geometry import RawGeometry, cut_short, invalid
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

_KEYS = (
    *("VERSION", "FIELDS", "COLUMNS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT"),
    *("VIEWPOINT", "POINTS", "DATA"),
)
_TYPES = {"F": "f", "I": "i", "U": "u"}


def read_pcd(path: Path) -> RawGeometry:
    """Return the points of a PCD file, and its viewpoint if that is not the default.

    `VIEWPOINT` is the sensor's pose. PCL and Open3D write the identity where they do not know it.

    Raises
    ------
    InputError
        If the file is not a valid PCD file, is cut short, or has no points.
    """
    header, body = _header(path, path.read_bytes())
    fields = header.get("FIELDS") or header.get("COLUMNS")
    if not fields:
        raise invalid(path, "its header has no FIELDS")
    names = coordinate_names(fields)
    if names is None:
        raise invalid(path, f"no fields x, y, z, only {', '.join(fields)}")
    counts = [_whole(path, "COUNT", word) for word in header.get("COUNT", ["1"] * len(fields))]
    sizes = [_whole(path, "SIZE", word) for word in header.get("SIZE", ["4"] * len(fields))]
    kinds = [word.upper() for word in header.get("TYPE", ["F"] * len(fields))]
    if not len(counts) == len(sizes) == len(kinds) == len(fields):
        raise invalid(path, "FIELDS, SIZE, TYPE and COUNT have different lengths")
    count = _count(path, header)
    if count == 0:
        raise InputError(f"{path} holds no points")
    # Fields may share a name, such as "_" for padding: numpy's need their own.
    try:
        columns = [
            (f"{k}", f"<{_TYPES[kind]}{size}", (repeat,))
            for k, (kind, size, repeat) in enumerate(zip(kinds, sizes, counts, strict=True))
        ]
        dtype = np.dtype(columns)
    except (KeyError, TypeError, ValueError) as error:
        given = " ".join(f"{kind}{size}" for kind, size in zip(kinds, sizes, strict=True))
        raise invalid(path, f"TYPE and SIZE {given} are not known") from error
    at = [fields.index(name) for name in names]
    if any(counts[k] != 1 for k in at):
        raise invalid(path, "COUNT of x, y and z must be 1")
    storage = header["DATA"][0].lower() if header["DATA"] else ""
    readers = {"ascii": _ascii, "binary": _binary, "binary_compressed": _compressed}
    # pypcd4 spells the last name in its own way.
    read = (readers | {"binaryscompressed": _compressed}).get(storage)
    if read is None:
        raise invalid(path, f"DATA {storage!r} is not known")
    points = read(path, body, dtype, count, at)
    return RawGeometry(points, None, str(path), str(path), _viewpoint(path, header))


def _header(path: Path, data: bytes) -> tuple[dict[str, list[str]], bytes]:
    """Return the words of every header line by its key, and the bytes after the header."""
    header: dict[str, list[str]] = {}
    at = 0
    while "DATA" not in header:
        end = data.find(b"\n", at)
        if end < 0:
            raise invalid(path, "its header has no line DATA")
        words = data[at:end].decode("latin-1").split()
        at = end + 1
        if not words or words[0].startswith("#"):
            continue
        if words[0].upper() not in _KEYS:
            raise invalid(path, f"header line {' '.join(words)[:60]!r} is not known")
        header[words[0].upper()] = words[1:]
    return header, data[at:]


def _whole(path: Path, key: str, word: str) -> int:
    if not word.isdecimal():
        raise invalid(path, f"{key} must be whole numbers, got {word[:20]!r}")
    return int(word)


def _count(path: Path, header: dict[str, list[str]]) -> int:
    """Return the number of points: POINTS, or WIDTH times HEIGHT in files that lack it."""
    if header.get("POINTS"):
        return _whole(path, "POINTS", header["POINTS"][0])
    if not header.get("WIDTH"):
        raise invalid(path, "its header has neither POINTS nor WIDTH")
    height = header.get("HEIGHT") or ["1"]
    return _whole(path, "WIDTH", header["WIDTH"][0]) * _whole(path, "HEIGHT", height[0])


def _viewpoint(path: Path, header: dict[str, list[str]]) -> Array | None:
    """Return the sensor's position, or None for the identity pose, which says nothing."""
    if not header.get("VIEWPOINT"):
        return None
    try:
        pose = np.array(header["VIEWPOINT"], dtype=np.float64)
    except ValueError as error:
        raise invalid(path, "VIEWPOINT must be seven numbers") from error
    if pose.shape not in ((7,), (3,)) or not np.isfinite(pose).all():
        raise invalid(path, "VIEWPOINT must be seven numbers")
    identity = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    return None if np.array_equal(pose, identity[: len(pose)]) else pose[:3]


def _stacked(table: NDArray[np.void], at: list[int]) -> Array:
    return np.stack([table[str(k)][:, 0].astype(np.float64) for k in at], axis=1)


def _ascii(path: Path, body: bytes, dtype: np.dtype, count: int, at: list[int]) -> Array:
    widths = [dtype[k].shape[0] for k in range(len(dtype.names or ()))]
    words = body.split()
    rows, rest = divmod(len(words), sum(widths))
    if rows < count:
        raise cut_short(path, f"{count} points declared, {rows} present")
    if rows > count or rest:
        raise invalid(path, f"it has more numbers than {count} points of {sum(widths)} fields")
    starts = np.cumsum([0, *widths])
    try:
        columns = [np.array(words[starts[k] :: sum(widths)]).astype(np.float64) for k in at]
    except ValueError as error:
        raise invalid(path, error) from error
    return np.stack(columns, axis=1)


def _binary(path: Path, body: bytes, dtype: np.dtype, count: int, at: list[int]) -> Array:
    present = len(body) // dtype.itemsize
    if present < count:
        raise cut_short(path, f"{count} points declared, {present} present")
    return _stacked(np.frombuffer(body, dtype, count), at)


def _compressed(path: Path, body: bytes, dtype: np.dtype, count: int, at: list[int]) -> Array:
    """Read LZF-compressed data, which are stored field by field."""
    if len(body) < 8:
        raise cut_short(path, "its compressed data have no size")
    packed, unpacked = (int(size) for size in np.frombuffer(body, "<u4", 2))
    if len(body) < 8 + packed:
        raise cut_short(path, f"{packed} compressed bytes declared, {len(body) - 8} present")
    if unpacked < dtype.itemsize * count:
        raise invalid(path, f"{count} points do not fit {unpacked} uncompressed bytes")
    data = _unpack(path, body[8 : 8 + packed], unpacked)
    starts = count * np.cumsum([0, *(dtype[k].itemsize for k in range(len(dtype.names or ())))])
    return np.stack(
        [np.frombuffer(data, dtype[k].base, count, int(starts[k])).astype(np.float64) for k in at],
        axis=1,
    )


def _unpack(path: Path, data: bytes, size: int) -> bytes:
    """Return LZF-compressed data of `size` bytes: runs of literals, and copies of earlier bytes."""
    out = bytearray()
    at, end = 0, len(data)
    try:
        while at < end and len(out) <= size:
            control = data[at]
            at += 1
            if control < 32:
                out += data[at : at + control + 1]
                at += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += data[at]
                at += 1
            begin = len(out) - ((control & 31) << 8) - data[at] - 1
            at += 1
            if begin < 0:
                raise IndexError
            length += 2
            copied = out[begin : begin + length]
            while len(copied) < length:  # a copy may overlap what it writes
                copied += copied[: length - len(copied)]
            out += copied
    except IndexError as error:
        raise invalid(path, "its compressed data are damaged") from error
    if len(out) != size:
        raise invalid(path, f"its data unpack to {len(out)} bytes, {size} declared")
    return bytes(out)
