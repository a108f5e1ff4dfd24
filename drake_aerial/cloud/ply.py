"""Read PLY files: ASCII and binary of both byte orders, with lists of any length in any element.

Written here because readers at hand refuse valid files (lists per vertex, mixed polygons, comments
that are not ASCII) or take seconds for each hundred thousand points. Longer than 300
lines, since the format has three encodings of rows of fixed and of varying length.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_aerial.cloud.coordinate_names import coordinate_names
from drake_aerial.cloud.polygons import Indices, triangulate
from drake_aerial.cloud.raw_geometry import RawGeometry, cut_short, invalid
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

_TYPES = {
    name: code
    for code, names in {
        "i1": ("char", "int8"),
        "u1": ("uchar", "uint8"),
        "i2": ("short", "int16"),
        "u2": ("ushort", "uint16"),
        "i4": ("int", "int32"),
        "u4": ("uint", "uint32"),
        "f4": ("float", "float32"),
        "f8": ("double", "float64"),
        "i8": ("int64", "long"),
        "u8": ("uint64", "ulong"),
    }.items()
    for name in names
}
_BYTE_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
# Characters of a number in an ASCII file.
_LONGEST = 100
_VERTEX = ("vertex", "vertices", "point", "points")
_FACE = ("face", "faces", "polygon", "polygons", "tristrips")
_CORNERS = ("vertex_indices", "vertex_index", "vertex_indexes", "indices")


@dataclass
class _Element:
    """An element of the header: its properties are (name, type, type of the list's count or "")."""

    name: str
    count: int
    properties: list[tuple[str, str, str]] = field(default_factory=list)


@dataclass
class _Columns:
    """The data of an element: scalars (N,) by name, and lists as (counts (N,), flat values)."""

    scalars: dict[str, NDArray[np.generic]] = field(default_factory=dict)
    lists: dict[str, tuple[Indices, NDArray[np.generic]]] = field(default_factory=dict)


def read_ply(path: Path) -> RawGeometry:
    """Return the points and triangles of a PLY file.

    Raises
    ------
    InputError
        If the file is not a valid PLY file, is cut short, or has no points.
    """
    data = path.read_bytes()
    elements, byte_order, body = _header(path, data)
    read = _read_ascii if byte_order == "" else _read_binary
    columns = read(path, elements, body, byte_order)
    vertex = next((name for name in columns if name in _VERTEX), None)
    if vertex is None:
        raise invalid(path, f"no element 'vertex', only {', '.join(columns) or 'none'}")
    names = coordinate_names(list(columns[vertex].scalars))
    if names is None:
        given = ", ".join(columns[vertex].scalars) or "none"
        raise invalid(path, f"no properties x, y, z of the vertices, only {given}")
    points = np.stack([columns[vertex].scalars[name].astype(np.float64) for name in names], axis=1)
    if len(points) == 0:
        raise InputError(f"{path} holds no points")
    return RawGeometry(points, _faces(path, columns, points), str(path), str(path))


def _header(path: Path, data: bytes) -> tuple[list[_Element], str, bytes]:
    """Return the elements, the byte order ("" for ASCII) and the bytes after the header."""
    if data[:3] != b"ply":
        raise invalid(path, "its first line is not 'ply'")
    end = re.search(rb"(?:\r\n|\r|\n)[ \t]*end_header[ \t]*", data)
    if end is None:
        raise invalid(path, "its header has no end_header")
    # The line ends are those of the first line: a binary body may begin with any byte.
    newline = re.match(rb"ply[ \t]*(\r\n|\r|\n)", data)
    length = len(newline[1]) if newline else 1
    elements: list[_Element] = []
    byte_order = None
    for line in re.split(r"\r\n|\r|\n", data[3 : end.start()].decode("latin-1")):
        words = line.split()
        if not words or words[0] in ("comment", "obj_info"):
            continue
        try:
            if words[0] == "format":
                byte_order = _BYTE_ORDERS[words[1]]
            elif words[0] == "element":
                elements.append(_Element(words[1], int(words[2])))
            elif words[0] == "property" and words[1] == "list":
                elements[-1].properties.append((words[4], _TYPES[words[3]], _TYPES[words[2]]))
            elif words[0] == "property":
                elements[-1].properties.append((words[2], _TYPES[words[1]], ""))
            else:
                raise ValueError
        except (KeyError, IndexError, ValueError) as error:
            raise invalid(path, f"header line {line.strip()[:60]!r} is not known") from error
    if byte_order is None:
        raise invalid(path, "its header has no format")
    if any(element.count < 0 for element in elements):
        raise invalid(path, "an element has a negative count")
    return elements, byte_order, data[end.end() + length :]


def _read_ascii(
    path: Path, elements: list[_Element], body: bytes, byte_order: str
) -> dict[str, _Columns]:
    words = body.split()
    found, at = {}, 0
    for element in elements:
        columns = found[element.name] = _Columns()
        if not any(counted for _, _, counted in element.properties):
            width = len(element.properties)
            if width == 0:
                continue
            _check_room(path, element, (len(words) - at) // width)
            table = _numbers(path, words[at : at + width * element.count])
            at += width * element.count
            for k, (name, _, _) in enumerate(element.properties):
                columns.scalars[name] = table[k::width]
            continue
        rows: dict[str, list[bytes]] = {name: [] for name, _, _ in element.properties}
        counts: dict[str, list[int]] = {name: [] for name, _, _ in element.properties}
        for row in range(element.count):
            for name, _, counted in element.properties:
                size = 1
                if counted:
                    size = _count(path, words, at, element, row)
                    counts[name].append(size)
                    at += 1
                rows[name] += words[at : at + size]
                at += size
            if at > len(words):
                _check_room(path, element, row)
        for name, _, counted in element.properties:
            values = _numbers(path, rows[name])
            if counted:
                columns.lists[name] = np.array(counts[name], dtype=np.int64), values
            else:
                columns.scalars[name] = values
    if at < len(words):
        raise invalid(path, f"it has {len(words) - at} more numbers than its header declares")
    return found


def _count(path: Path, words: list[bytes], at: int, element: _Element, row: int) -> int:
    if at >= len(words):
        _check_room(path, element, row)
    try:
        size = int(float(words[at]))
    except (ValueError, OverflowError) as error:
        raise invalid(path, f"{words[at][:20]!r} is not the length of a list") from error
    if size < 0:
        raise invalid(path, f"a list of element {element.name!r} has length {size}")
    return size


def _numbers(path: Path, words: list[bytes]) -> Array:
    if not words:
        return np.zeros(0)
    if max(map(len, words)) > _LONGEST:
        raise invalid(path, f"a number has more than {_LONGEST} characters")
    try:
        return np.array(words, dtype="S").astype(np.float64)
    except ValueError:
        # Windows writes nan(ind) and 1.#QNAN.
        odd = re.compile(rb"[-+]?(nan\(.*\)|1\.#\w+)$", re.IGNORECASE)
        try:
            return np.array([b"nan" if odd.match(word) else word for word in words]).astype(float)
        except ValueError as error:
            raise invalid(path, str(error)) from error


def _read_binary(
    path: Path, elements: list[_Element], body: bytes, byte_order: str
) -> dict[str, _Columns]:
    found, at = {}, 0
    for element in elements:
        columns, at = _fixed_rows(path, element, body, at, byte_order)
        found[element.name] = columns
    return found


def _fixed_rows(
    path: Path, element: _Element, body: bytes, at: int, byte_order: str
) -> tuple[_Columns, int]:
    """Read rows of one size: those without lists, and lists that are all as long as the first."""
    if not element.properties:
        return _Columns(), at
    sizes, offset = [], at
    for _, kind, counted in element.properties:
        size = 1
        if counted and element.count:
            count = np.dtype(byte_order + counted)
            if offset + count.itemsize > len(body):
                _check_room(path, element, 0)
            size = int(np.frombuffer(body, count, 1, offset)[0])
            if size < 0 or size > len(body):
                raise invalid(path, f"a list of element {element.name!r} has length {size}")
            offset += count.itemsize
        offset += size * np.dtype(kind).itemsize
        sizes.append(size)
    fields = []
    for k, (size, (_, kind, counted)) in enumerate(zip(sizes, element.properties, strict=True)):
        if counted:
            fields += [(f"n{k}", byte_order + counted), (f"v{k}", byte_order + kind, (size,))]
        else:
            fields.append((f"v{k}", byte_order + kind))
    dtype = np.dtype(fields)
    room = (len(body) - at) // max(dtype.itemsize, 1)
    table = np.frombuffer(body, dtype, min(element.count, room), at)
    lists = [k for k, (_, _, counted) in enumerate(element.properties) if counted]
    if not all((table[f"n{k}"] == sizes[k]).all() for k in lists):
        return _varying_rows(path, element, body, at, byte_order)
    _check_room(path, element, room)
    columns = _Columns()
    for k, (name, _, counted) in enumerate(element.properties):
        if counted:
            counts = np.full(element.count, sizes[k], dtype=np.int64)
            columns.lists[name] = counts, table[f"v{k}"].reshape(-1)
        else:
            columns.scalars[name] = table[f"v{k}"]
    return columns, at + dtype.itemsize * element.count


def _varying_rows(
    path: Path, element: _Element, body: bytes, at: int, byte_order: str
) -> tuple[_Columns, int]:
    """Read rows whose lists differ in length: find where each property begins, then gather."""
    _check_room(path, element, len(body) - at)
    order = "big" if byte_order == ">" else "little"
    layout = [
        (np.dtype(kind).itemsize, np.dtype(counted).itemsize if counted else 0)
        for _, kind, counted in element.properties
    ]
    begins = np.empty((element.count, len(layout)), dtype=np.int64)
    counts = np.ones((element.count, len(layout)), dtype=np.int64)
    for row in range(element.count):
        for k, (size, counted) in enumerate(layout):
            number = 1
            if counted:
                number = int.from_bytes(body[at : at + counted], order)  # type: ignore[arg-type]
                at += counted
            begins[row, k], counts[row, k] = at, number
            at += number * size
        if at > len(body):
            _check_room(path, element, row)
    raw = np.frombuffer(body, np.uint8)
    columns = _Columns()
    for k, (name, kind, is_list) in enumerate(element.properties):
        width, lengths = layout[k][0], counts[:, k]
        first = np.repeat(begins[:, k] - width * (np.cumsum(lengths) - lengths), lengths)
        places = first + width * np.arange(lengths.sum())
        values = raw[places[:, None] + np.arange(width)].view(byte_order + kind)[:, 0]
        if is_list:
            columns.lists[name] = lengths, values
        else:
            columns.scalars[name] = values
    return columns, at


def _check_room(path: Path, element: _Element, room: int) -> None:
    """Raise the error of a file that holds only `room` rows of an element, if that is too few."""
    if room < element.count:
        raise cut_short(
            path, f"{element.count} of element {element.name!r} declared, {room} present"
        )


def _faces(path: Path, columns: dict[str, _Columns], points: Array) -> Indices | None:
    """Return the triangles (F, 3) of the elements that hold polygons or strips."""
    faces = []
    for element, found in columns.items():
        name = next((name for name in _CORNERS if name in found.lists), None)
        if element not in _FACE or name is None:
            continue
        counts, values = found.lists[name]
        corners = values.astype(np.int64)
        if element == "tristrips":
            counts, corners = _strips(counts, corners)
        if len(corners) and (corners.min() < 0 or corners.max() >= len(points)):
            wrong = corners.max() if corners.min() >= 0 else corners.min()
            raise invalid(path, f"a face refers to vertex {wrong} of {len(points)}")
        triangles = triangulate(points, counts, corners)
        if triangles is not None:
            faces.append(triangles)
    return np.concatenate(faces) if faces else None


def _strips(counts: Indices, corners: Indices) -> tuple[Indices, Indices]:
    """Return triangles of triangle strips, which a corner of -1 ends; every other one is turned."""
    triangles = []
    for strip in np.split(corners, np.cumsum(counts)[:-1]):
        for part in np.split(strip, np.flatnonzero(strip < 0)):
            part = part[part >= 0]
            rows = np.stack([part[:-2], part[1:-1], part[2:]], axis=1) if len(part) > 2 else None
            if rows is not None:
                rows[1::2] = rows[1::2, ::-1]
                triangles.append(rows)
    flat = np.concatenate(triangles) if triangles else np.zeros((0, 3), dtype=np.int64)
    return np.full(len(flat), 3), flat.reshape(-1)
