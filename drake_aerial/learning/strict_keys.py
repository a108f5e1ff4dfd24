"""Reading YAML mappings strictly: every key is known, every needed key is there."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array


def read_mapping(path: Path) -> dict[str, Any]:
    """Return the mapping that a YAML file holds.

    Raises
    ------
    InputError
        If the file cannot be read, is not YAML, or holds something else.
    """
    try:
        values = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read {path}: {error}") from error
    except yaml.YAMLError as error:
        raise InputError(f"{path} is not YAML: {' '.join(str(error).split())}") from error
    if not isinstance(values, dict):
        raise InputError(f"{path} should hold a mapping of keys to values, got {type(values).__name__}")
    return values


def strict(values: Any, where: str, *, required: Iterable[str], optional: Iterable[str] = ()) -> None:
    """Check that `values` is a mapping with the required keys and no unknown ones.

    Raises
    ------
    InputError
        One line: which key is unknown and the nearest known one, or which is missing.
    """
    required, known = tuple(required), (*required, *optional)
    if not isinstance(values, dict):
        raise InputError(f"{where} should be a mapping with {', '.join(known)}, got {values!r}")
    for key in values:
        if key not in known:
            near = difflib.get_close_matches(str(key), known, n=1, cutoff=0.0)
            raise InputError(f"{where}: unknown key {key!r}; did you mean {near[0]!r}? Accepted: {', '.join(known)}")
    for key in required:
        if key not in values:
            raise InputError(f"{where}: the key {key!r} is missing; accepted: {', '.join(known)}")


def numbers(value: Any, count: int, what: str) -> Array:
    """Return `count` finite numbers (count,).

    Raises
    ------
    InputError
        If `value` is anything else.
    """
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (count,) or not np.isfinite(array).all():
        raise InputError(f"{what} should be {count} finite number{'s' * (count > 1)}, got {value!r}")
    return array
