"""Read untrusted NumPy files: no pickled objects, and a limit on their memory."""

import zipfile
from pathlib import Path

import numpy as np

from drake_aerial.errors import InputError

LARGEST = 2**30
"""Largest size of the arrays of one archive [bytes]; kilobytes can unpack to terabytes."""

Arrays = dict[str, np.ndarray]


def load_arrays(path: str | Path) -> np.ndarray | Arrays:
    """Return the array of an .npy file, or all arrays of an .npz archive by name.

    Raises
    ------
    InputError
        In one line: if the file is missing or unreadable, holds pickled objects, is damaged or cut
        short, or unpacks to more than `LARGEST` bytes.
    """
    path = Path(path)
    try:
        if zipfile.is_zipfile(path):
            with zipfile.ZipFile(path) as archive:
                size = sum(member.file_size for member in archive.infolist())
            if size > LARGEST:
                raise InputError(f"{path} must unpack to at most {LARGEST:,} bytes, got {size:,}")
        content = np.load(path, allow_pickle=False)
        if isinstance(content, np.ndarray):
            return content
        with content:
            return {name: np.asarray(content[name]) for name in content}
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    except Exception as error:  # zipfile and numpy raise some ten kinds of errors
        reason = " ".join(str(error).split()) or type(error).__name__
        reason = reason.replace("allow_pickle=False", "pickled objects are refused")
        kind = path.suffix[1:].upper() or "NPY"
        raise InputError(
            f"cannot read {path}: not a valid {kind} file, or cut short ({reason})"
        ) from error


def load_archive(path: str | Path, what: str) -> Arrays:
    """Return the arrays of an .npz archive by name.

    Parameters
    ----------
    path : str or Path
    what : str
        What the archive must be, for the error: "a skill".

    Raises
    ------
    InputError
        As `load_arrays`, and for a bare array.
    """
    arrays = load_arrays(path)
    if not isinstance(arrays, dict):
        raise InputError(f"{path} must be {what} (an .npz archive), got one bare array")
    return arrays
