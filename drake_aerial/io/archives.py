"""NumPy's files from strangers: no pickled objects, and never more memory than a file may honestly need."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from drake_aerial.errors import InputError

LARGEST = 2**30
"""What the arrays of one file may take [bytes]; an archive of kilobytes can ask for terabytes."""

Arrays = dict[str, np.ndarray]


def load_arrays(path: str | Path) -> np.ndarray | Arrays:
    """Return the array of an .npy file, or all those of an .npz archive by name.

    Raises
    ------
    InputError
        In one line: if the file is missing or unreadable, holds pickled objects, is damaged or cut short, or asks for more than
        `LARGEST` bytes.
    """
    path = Path(path)
    try:
        with open(path, "rb") as file:
            if file.read(2) != b"PK":
                file.seek(0)
                return _read(file, path.stat().st_size, str(path))
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            if sum(member.file_size for member in members) > LARGEST:
                raise InputError(
                    f"{path} unpacks to more than {LARGEST / 2**30:g} GiB, which is not read"
                )
            arrays = {}
            for member in members:
                with archive.open(member) as content:
                    data = content.read(LARGEST)
                arrays[member.filename.removesuffix(".npy")] = _read(
                    io.BytesIO(data), len(data), str(path)
                )
            return arrays
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    except (
        Exception
    ) as error:  # zipfile and numpy raise some ten kinds of errors, by kind of damage
        reason = " ".join(str(error).split()) or type(error).__name__
        kind = path.suffix[1:].upper() or "NPY"
        raise InputError(
            f"cannot read {path}: not a valid {kind} file, or cut short ({reason})"
        ) from error


def load_archive(path: str | Path, what: str) -> Arrays:
    """Return the arrays of an .npz archive by name, as `load_arrays` does; `what` it should be is said of a bare array.

    Raises
    ------
    InputError
        As `load_arrays`, and for a bare array.
    """
    arrays = load_arrays(path)
    if not isinstance(arrays, dict):
        raise InputError(f"{path} is not {what} (an .npz archive): it holds one bare array")
    return arrays


def _read(file: BinaryIO | io.BytesIO, size: int, label: str) -> np.ndarray:
    """Return the array of an open .npy file of `size` bytes, once its header was seen to promise no more than that."""
    version = np.lib.format.read_magic(file)
    read_header: Any = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    shape, _, kind = read_header.get(version, np.lib.format.read_array_header_2_0)(file)
    if kind.hasobject:
        raise InputError(f"{label} holds pickled objects, which are not read")
    if int(np.prod([int(n) for n in shape], dtype=object)) * kind.itemsize > size:
        raise ValueError(f"an array of shape {shape} is longer than the file")
    file.seek(0)
    return np.lib.format.read_array(file, allow_pickle=False)
