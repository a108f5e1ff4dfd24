"""Strict reading of YAML files: every key is known, and the nearest known one is named where it is not."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array


def read_mapping(path: str | Path) -> dict[str, Any]:
    """Return the mapping of keys to values that a YAML file holds.

    Raises
    ------
    InputError
        If the file cannot be read, is not YAML, or holds something else than a mapping.
    """
    try:
        values = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read {path}: {error}") from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise InputError(f"{path} is not YAML: {' '.join(str(error).split())}") from error
    if not isinstance(values, dict):
        raise InputError(f"{path} should hold a mapping of keys to values, got {type(values).__name__}")
    return values


def check_keys(values: Any, where: str, *, required: Iterable[str] = (), optional: Iterable[str] = ()) -> None:
    """Check that `values` is a mapping with the required keys and no unknown ones.

    Raises
    ------
    InputError
        One line: which key is unknown and the nearest known one, or which is missing.
    """
    required = tuple(required)
    known = (*required, *optional)
    if not isinstance(values, dict):
        raise InputError(f"{where} should be a mapping with {', '.join(known)}, got {values!r}")
    for key in values:
        if key not in known:
            raise InputError(f"{where}: unknown key {key!r}{nearest(key, known)}; accepted: {', '.join(known)}")
    for key in required:
        if key not in values:
            raise InputError(f"{where}: the key {key!r} is missing; accepted: {', '.join(known)}")


def nearest(given: Any, known: Iterable[str]) -> str:
    """Return " (did you mean 'x'?)" for the known name nearest to what was given, or nothing where none is near."""
    close = difflib.get_close_matches(str(given), list(known), n=1)
    return f" (did you mean {close[0]!r}?)" if close else ""


def numbers(value: Any, shape: tuple[int, ...], what: str) -> Array:
    """Return `value` as a finite float array of `shape`; `()` is one number.

    Raises
    ------
    InputError
        If `value` is anything else; the message begins with `what`.
    """
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        array = np.empty(0)
    if array.shape != shape or not np.isfinite(array).all() or isinstance(value, bool):
        wanted = "a finite number" if shape == () else f"{' x '.join(map(str, shape))} finite numbers"
        raise InputError(f"{what} should be {wanted}, got {value!r}")
    return array


def number(value: Any, what: str) -> float:
    """Return `value` as one finite float, or raise InputError beginning with `what`."""
    return float(numbers(value, (), what))
