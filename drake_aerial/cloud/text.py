"""Read points from text files: .xyz .txt .csv .pts .asc, with any usual delimiter."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from drake_aerial.cloud.coordinate_names import coordinate_names
from drake_aerial.cloud.raw_geometry import RawGeometry, invalid
from drake_aerial.errors import InputError

_COMMENT = ("#", "//", "%", "!")


def read_text(path: Path) -> RawGeometry:
    """Return the points of a text file with one point a line.

    Columns are separated by commas, semicolons, tabs or blanks; with semicolons, numbers may have
    a decimal comma. A line of names selects the columns x, y, z; otherwise the first three are
    taken. A first line of one whole number (.pts) is the number of points.

    Raises
    ------
    InputError
        If a line is not numbers, has too few columns, or the file has no points.
    """
    text = path.read_bytes().decode("utf-8-sig", errors="replace")
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith(_COMMENT)
    ]
    declared = None
    if lines and re.fullmatch(r"\s*\d+\s*", lines[0][1]):
        declared = int(lines.pop(0)[1])
    if not lines:
        raise InputError(f"{path} holds no points")
    delimiter = _delimiter(lines[0][1])
    columns = (0, 1, 2)
    names = [name.strip().strip('"') for name in lines[0][1].split(delimiter)]
    if not any(_is_number(name, delimiter) for name in names):
        found = coordinate_names([re.sub(r"\s*[\[(].*", "", name) for name in names])
        if found is None:
            raise invalid(path, f"no columns x, y, z, only {', '.join(names)[:80]}")
        plain = [re.sub(r"\s*[\[(].*", "", name) for name in names]
        columns = (plain.index(found[0]), plain.index(found[1]), plain.index(found[2]))
        lines.pop(0)
        if not lines:
            raise InputError(f"{path} holds no points")
        delimiter = delimiter if delimiter is not None else _delimiter(lines[0][1])
    if declared is not None and declared > len(lines):
        raise InputError(
            f"cannot read {path}: the file is cut short: {declared} points declared, "
            f"{len(lines)} present"
        )
    points = np.array([_row(path, number, line, delimiter, columns) for number, line in lines])
    return RawGeometry(points, None, str(path), str(path))


def _delimiter(line: str) -> str | None:
    """Return the delimiter of a line; None for blanks and tabs."""
    return next((mark for mark in (";", ",") if mark in line), None)


def _is_number(word: str, delimiter: str | None) -> bool:
    try:
        float(word.replace(",", ".") if delimiter == ";" else word)
    except ValueError:
        return word == ""
    return True


def _row(
    path: Path, number: int, line: str, delimiter: str | None, columns: tuple[int, int, int]
) -> list[float]:
    words = line.split(delimiter)
    if delimiter == ";":
        words = [word.replace(",", ".") for word in words]
    try:
        # An empty cell is a point without a value there.
        return [float(words[k].strip().strip('"') or "nan") for k in columns]
    except IndexError as error:
        raise invalid(path, f"line {number} has {len(words)} columns, three are needed") from error
    except ValueError as error:
        raise invalid(path, f"line {number} is not numbers: {line.strip()[:40]!r}") from error
