"""Records from YAML: every key is known and every value has the type that the record's annotation says."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.io.strict_yaml import check_keys, nearest, read_mapping, shown
from drake_aerial.io.typed_yaml.record_fields import MISSING, Unbounded, is_record, record_fields

Record = TypeVar("Record")


def read_record(cls: type[Record], path: str | Path) -> Record:
    """Return the record of a YAML file whose keys are the fields' names; what is left out has its default.

    Where a field is itself a record, its value is a mapping, or the name of a file with one, relative to this file.

    Parameters
    ----------
    cls : type
        A record, or a union of records that differ in their field `kind`.
    path : str or Path

    Raises
    ------
    InputError
        In one line: for an unreadable file, an unknown or missing key (with the nearest known one), a value of another type, an
        impossible value.
    """
    return record_from_mapping(cls, read_mapping(path), str(path), Path(path).parent)


def record_from_mapping(
    cls: type[Record], values: Any, where: str, folder: Path | None = None
) -> Record:
    """Return the record that a mapping of plain values stands for.

    Parameters
    ----------
    cls : type
        A record, or a union of records that differ in their field `kind`.
    values : mapping
    where : str
        What the values are, or the file they are from; errors begin with it.
    folder : Path, optional
        Relative to which names of files are; without one, none are accepted.

    Raises
    ------
    InputError
        As `read_record` does.
    """
    return _value(cls, values, where, folder)


def _value(kind: Any, given: Any, where: str, folder: Path | None) -> Any:
    """Return what was given as a value of a type, or raise InputError."""
    origin = get_origin(kind)
    if is_record(kind):
        return _record(kind, given, where, folder)
    if kind == Unbounded:
        return _number(given, where, infinite=True)
    if origin is Annotated:
        return _value(get_args(kind)[0], given, where, folder)
    if origin in (Union, UnionType):
        return _one_of(get_args(kind), given, where, folder)
    if origin is Literal:
        if given not in get_args(kind):
            names = [str(choice) for choice in get_args(kind)]
            raise InputError(
                f"{where} should be {' or '.join(names)}, got {shown(given)}{nearest(given, names)}"
            )
        return given
    if origin is tuple or origin is Sequence:
        return _several(kind, given, where, folder)
    if kind is float:
        return _number(given, where)
    if kind is int:
        if not isinstance(given, int) or isinstance(given, bool):
            raise InputError(f"{where} should be a whole number, got {shown(given)}")
        return given
    if kind in (bool, str):
        if not isinstance(given, kind):
            raise InputError(
                f"{where} should be {'true or false' if kind is bool else 'a text'}, got {shown(given)}"
            )
        return given
    raise TypeError(f"{where}: records of YAML files hold no {kind}")


def _record(cls: type, given: Any, where: str, folder: Path | None) -> Any:
    if isinstance(given, str) and folder is not None:
        return read_record(cls, folder / given)
    fields = record_fields(cls)
    required = [f.name for f in fields if f.default is MISSING]
    check_keys(
        given, where, required=required, optional=[f.name for f in fields if f.name not in required]
    )
    values = {
        f.name: _value(f.kind, given[f.name], f"{where}: {f.name}", folder)
        for f in fields
        if f.name in given
    }
    try:
        return cls(**values)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def _one_of(kinds: tuple[Any, ...], given: Any, where: str, folder: Path | None) -> Any:
    if given is None and NoneType in kinds:
        return None
    kinds = tuple(kind for kind in kinds if kind is not NoneType)
    several = [kind for kind in kinds if get_origin(kind) in (tuple, Sequence)]
    single = [kind for kind in kinds if kind not in several]
    if several and (isinstance(given, list) or not single):
        return _value(several[0], given, where, folder)
    if len(single) == 1:
        return _value(single[0], given, where, folder)
    if isinstance(given, str) and folder is not None:
        path = folder / given
        return _one_of(kinds, read_mapping(path), str(path), path.parent)
    return _record(_of_kind(single, given, where), given, where, folder)


def _of_kind(records: list[type], given: Any, where: str) -> type:
    """Return the record whose `kind` was given."""
    kinds = {
        name: cls
        for cls in records
        for f in record_fields(cls)
        if f.name == "kind"
        for name in get_args(f.kind)
    }
    kind = given.get("kind") if isinstance(given, dict) else None
    if not isinstance(kind, str) or kind not in kinds:
        said = (
            f"got the kind {shown(kind)}{nearest(kind, kinds)}"
            if kind is not None
            else f"got {shown(given)}"
        )
        raise InputError(
            f"{where} should be a mapping with a kind, one of {', '.join(kinds)}; {said}"
        )
    return kinds[kind]


def _several(kind: Any, given: Any, where: str, folder: Path | None) -> tuple[Any, ...]:
    kinds = get_args(kind)
    if get_origin(kind) is Sequence:
        kinds = (*kinds, ...)
    if len(kinds) == 2 and kinds[1] is ...:
        if not isinstance(given, (list, tuple)) or not given:
            raise InputError(f"{where} should be a list, got {shown(given)}")
        kinds = (kinds[0],) * len(given)
    elif not isinstance(given, (list, tuple)) or len(given) != len(kinds):
        raise InputError(f"{where} should be a list of {len(kinds)}, got {shown(given)}")
    entries = enumerate(zip(kinds, given, strict=True), start=1)
    return tuple(_value(kind, entry, f"{where}, entry {i}", folder) for i, (kind, entry) in entries)


def _number(given: Any, where: str, infinite: bool = False) -> float:
    """Return a number; as a text too, since YAML takes 5e3, which lacks a point, for one."""
    try:
        value = np.nan if isinstance(given, bool) else float(given)
    except (TypeError, ValueError, OverflowError):
        value = np.nan
    if np.isnan(value) or (np.isinf(value) and not infinite):
        raise InputError(
            f"{where} should be a {'' if infinite else 'finite '}number, got {shown(given)}"
        )
    return value
