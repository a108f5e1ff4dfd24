"""Strict reading of YAML model files: unknown keys are refused, and the nearest known one is suggested."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from drake_aerial.errors import InputError


def read_mapping(path: Path, allowed: Iterable[str], required: Iterable[str] = ()) -> dict[str, Any]:
    """Return the mapping in a YAML file, after checking its keys.

    Parameters
    ----------
    path : Path
        The file.
    allowed, required : iterable of str
        Known keys, and those among them that must be given.

    Raises
    ------
    InputError
        If the file cannot be read, is not a mapping, misses a required key or has an unknown one.
    """
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read {path}: {error}") from error
    except yaml.YAMLError as error:
        raise InputError(f"{path} is not YAML: {' '.join(str(error).split())}") from error
    if not isinstance(data, dict):
        raise InputError(f"{path} holds a {type(data).__name__}; a mapping of keys to values is accepted")
    check_keys(data, allowed, required, str(path))
    return data


def check_keys(data: dict[str, Any], allowed: Iterable[str], required: Iterable[str], where: str) -> None:
    """Raise InputError if `data` has a key outside `allowed` or misses one of `required`."""
    known = list(allowed)
    for key in data:
        if key not in known:
            close = difflib.get_close_matches(str(key), known, n=1, cutoff=0.0)
            hint = f" (did you mean {close[0]!r}?)" if close else ""
            raise InputError(f"{where}: unknown key {key!r}{hint}; accepted: {', '.join(known)}")
    for key in required:
        if key not in data:
            raise InputError(f"{where}: key {key!r} is missing")


def numbers(value: Any, shape: tuple[int, ...], what: str) -> np.ndarray:
    """Return `value` as a finite float array of `shape`, or raise InputError naming `what`."""
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != shape or not np.isfinite(array).all():
        wanted = "a finite number" if shape == () else f"finite numbers of shape {shape}"
        raise InputError(f"{what} is {value!r}; {wanted} accepted")
    return array
