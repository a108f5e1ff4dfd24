"""Strict reading of YAML and JSON: bounded in size and depth, every key known.

An unknown key is refused together with the nearest known one.
"""

import difflib
import json
import re
import reprlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

MOST_VALUES = 100_000
"""Largest number of values in a YAML file, counted after its aliases are expanded."""
MOST_LEVELS = 50
"""Largest depth of nested lists and mappings in a YAML or JSON document."""
MOST_BYTES = 2**25
"""Largest size of a YAML or JSON document [bytes]."""
_MOST_DIGITS = 1000
_REPR = reprlib.Repr()
_REPR.maxlevel, _REPR.maxstring, _REPR.maxother, _REPR.maxlong = 3, 100, 100, 60


class _Loader(yaml.SafeLoader):
    """Safe loader that refuses duplicate keys, self-references and exponential aliases.

    Aliases are counted while the document is composed, before any value is made of it.
    """

    def __init__(self, stream: str):
        super().__init__(stream)
        self.values = 0
        self.sizes: dict[int, int] = {}  # of complete nodes, by id

    def compose_node(self, parent: Any, index: Any) -> Any:
        before, alias = self.values, self.check_event(yaml.events.AliasEvent)
        node: Any = super().compose_node(parent, index)
        if alias and id(node) not in self.sizes:
            raise InputError("contains itself")
        self.values += self.sizes[id(node)] if alias else 1
        if self.values > MOST_VALUES:
            raise InputError(f"stands for more than {MOST_VALUES:,} values")
        self.sizes.setdefault(id(node), self.values - before)
        # A number in base 60 (1:59:59:...) takes quadratic time in its length.
        if node.tag.endswith((":int", ":float")) and len(node.value) > _MOST_DIGITS:
            raise InputError(f"has a number of more than {_MOST_DIGITS:,} digits")
        return node

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        known: set[str] = set()
        for key in (key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            if key in known:
                raise InputError(f"has the key {shown(key)} twice")
            known.add(key)
        mapping: dict[Any, Any] = super().construct_mapping(node, deep=deep)
        return mapping


# YAML 1.1 reads 5e3, which has no decimal point, as text.
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"[-+]?(?:(?:\d+\.?\d*|\.\d+)[eE][-+]?\d+|inf)$"),
    list("-+.0123456789i"),
)


def read_mapping(path: str | Path) -> dict[str, Any]:
    """Return the mapping of keys to values in a YAML file.

    Raises
    ------
    InputError
        If the file cannot be read, is not YAML, does not hold a mapping, or is too large: more
        than `MOST_BYTES`, `MOST_VALUES` or `MOST_LEVELS`.
    """
    text = _read_text(path)
    try:
        values = yaml.load(text, _Loader)
    except InputError as error:
        raise InputError(f"{path} {error}") from error
    except (yaml.YAMLError, ValueError, TypeError, RecursionError, OverflowError) as error:
        raise InputError(
            f"{path} is not YAML: {shown(' '.join(str(error).split()), 300)}"
        ) from error
    return _mapping(values, str(path))


def read_json(path: str | Path) -> dict[str, Any]:
    """Return the object in a JSON file as a mapping.

    Raises
    ------
    InputError
        If the file cannot be read, is not JSON, does not hold an object, or is too large.
    """
    return mapping_from_json(_read_text(path), str(path))


def mapping_from_json(text: str | bytes, where: str) -> dict[str, Any]:
    """Return the object in a JSON text as a mapping.

    Parameters
    ----------
    text : str or bytes
    where : str
        Where the text is from; errors begin with it.

    Raises
    ------
    InputError
        If the text is not JSON, does not hold an object, or is too large.
    """
    if len(text) > MOST_BYTES:
        raise InputError(f"{where} is longer than {MOST_BYTES:,} bytes")
    try:
        values = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{where} is not JSON: {shown(str(error), 300)}") from error
    return _mapping(values, where)


def _read_text(path: str | Path) -> str:
    try:
        with open(path, "rb") as file:
            data = file.read(MOST_BYTES + 1)
        if len(data) > MOST_BYTES:
            raise InputError(f"{path} is longer than {MOST_BYTES:,} bytes")
        return data.decode("utf-8")
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"cannot read {path}: {error}") from error


def _mapping(values: Any, where: str) -> dict[str, Any]:
    if not isinstance(values, dict):
        raise InputError(
            f"{where} must hold a mapping of keys to values, got {type(values).__name__}"
        )
    level: list[Any] = [values]
    for _ in range(MOST_LEVELS):
        level = [
            part
            for value in level
            for part in (value.values() if isinstance(value, dict) else value)
            if isinstance(part, (dict, list, tuple))
        ]
    if level:
        raise InputError(f"{where} is nested more than {MOST_LEVELS} levels deep")
    return values


def shown(value: Any, length: int = 120) -> str:
    """Return a value as messages show it: its repr, shortened in the middle.

    If a length is given, a text is shown without quotes.
    """
    try:
        text = value if isinstance(value, str) and length != 120 else _REPR.repr(value)
    except ValueError:  # a whole number of thousands of digits
        text = f"a {type(value).__name__}"
    return text if len(text) <= length else f"{text[: length // 2]} ... {text[-length // 3 :]}"


def check_keys(
    values: Any, *, required: Iterable[str] = (), optional: Iterable[str] = (), where: str = ""
) -> None:
    """Check that `values` is a mapping with the required keys and no unknown ones.

    Parameters
    ----------
    values : mapping
    required, optional : names
    where : str
        Beginning of errors.

    Raises
    ------
    InputError
        In one line: which key is unknown and the nearest known one, or which is missing.
    """
    required = tuple(required)
    known = (*required, *optional)
    if not isinstance(values, dict):
        raise InputError(f"{where}must be a mapping of keys to values, got {shown(values)}")
    accepted = f"accepted: {', '.join(known)}"
    for key in values:
        if key not in known:
            raise InputError(f"{where}unknown key {shown(key)}{nearest(key, known)}; {accepted}")
    for key in required:
        if key not in values:
            raise InputError(f"{where}the key {key!r} is missing; {accepted}")


def nearest(given: Any, known: Iterable[str]) -> str:
    """Return " (did you mean 'x'?)" with the nearest known name, or "" if none is near."""
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
        raise InputError(f"{what} must be {wanted}, got {shown(value)}")
    return array
