"""Strict reading of YAML files: every key is known, and the nearest known one is named where it is not."""

from __future__ import annotations

import difflib
import reprlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

LARGEST = 100_000
"""How many values a file may stand for."""
_REPR = reprlib.Repr()
_REPR.maxlevel, _REPR.maxstring, _REPR.maxother, _REPR.maxlong = 3, 100, 100, 60


class _Loader(yaml.SafeLoader):
    """Takes a key that stands twice for a mistake, where YAML's own loader lets the last one win."""

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        known: set[str] = set()
        for key in (key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            if key in known:
                raise InputError(f"has the key {shown(key)} twice")
            known.add(key)
        mapping: dict[Any, Any] = super().construct_mapping(node, deep=deep)
        return mapping


def read_mapping(path: str | Path) -> dict[str, Any]:
    """Return the mapping of keys to values that a YAML file holds.

    Raises
    ------
    InputError
        If the file cannot be read, is not YAML, or holds something else than a mapping.
    """
    try:
        values = yaml.load(Path(path).read_text(encoding="utf-8"), _Loader)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read {path}: {error}") from error
        _check_size(values, {})
    except InputError as error:
        raise InputError(f"{path} {error}") from error
    except (yaml.YAMLError, ValueError, TypeError, RecursionError, OverflowError) as error:
        raise InputError(
            f"{path} is not YAML: {shown(' '.join(str(error).split()), 300)}"
        ) from error
    if not isinstance(values, dict):
        raise InputError(
            f"{path} should hold a mapping of keys to values, got {type(values).__name__}"
        )
    return values


def _check_size(value: Any, known: dict[int, int]) -> int:
    """Return into how many values a value expands, or raise InputError: aliases can make a short file stand for billions."""
    if not isinstance(value, (dict, list, tuple, set)):
        return 1
    if id(value) in known:
        if known[id(value)] < 0:
            raise InputError("contains itself")
        return known[id(value)]
    known[id(value)] = -1
    parts = [*value, *value.values()] if isinstance(value, dict) else value
    size = 1 + sum(_check_size(part, known) for part in parts)
    if size > LARGEST:
        raise InputError(f"stands for more than {LARGEST:,} values")
    known[id(value)] = size
    return size


def shown(value: Any, length: int = 120) -> str:
    """Return a value as messages show it: its repr (a text as it is, if a length is asked for), cut short in the middle."""
    try:
        text = value if isinstance(value, str) and length != 120 else _REPR.repr(value)
    except ValueError:  # a whole number of thousands of digits
        text = f"a {type(value).__name__}"
    return text if len(text) <= length else f"{text[: length // 2]} ... {text[-length // 3 :]}"


def check_keys(
    values: Any, where: str, *, required: Iterable[str] = (), optional: Iterable[str] = ()
) -> None:
    """Check that `values` is a mapping with the required keys and no unknown ones.

    Raises
    ------
    InputError
        One line: which key is unknown and the nearest known one, or which is missing.
    """
    required = tuple(required)
    known = (*required, *optional)
    if not isinstance(values, dict):
        raise InputError(
            f"{where} should be a mapping with {', '.join(known)}, got {shown(values)}"
        )
    for key in values:
        if key not in known:
            raise InputError(
                f"{where}: unknown key {shown(key)}{nearest(key, known)}; accepted: {', '.join(known)}"
            )
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
        wanted = (
            "a finite number" if shape == () else f"{' x '.join(map(str, shape))} finite numbers"
        )
        raise InputError(f"{what} should be {wanted}, got {shown(value)}")
    return array


def number(value: Any, what: str) -> float:
    """Return `value` as one finite float, or raise InputError beginning with `what`."""
    return float(numbers(value, (), what))
