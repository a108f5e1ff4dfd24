"""What a record says of itself: its fields with their types, defaults and meanings.

A record is a frozen dataclass or a NamedTuple. A field's meaning is the string below it, or its entry in the section "Attributes"
or "Parameters" of the class's docstring.
"""

from __future__ import annotations

import ast
import dataclasses
import inspect
import re
import textwrap
from functools import cache
from typing import Annotated, Any, NamedTuple, get_type_hints

MISSING = dataclasses.MISSING

Unbounded = Annotated[float, "may be infinite"]
"""A number that may be infinite, `.inf` in YAML; a plain `float` may not."""


class RecordField(NamedTuple):
    """One field of a record.

    Attributes
    ----------
    name : str
    kind : Any
        Its annotation, resolved.
    default : Any
        `MISSING` where there is none.
    meaning : str
        On one line, with units; empty where the class says nothing, or where it says it of the field before.
    """

    name: str
    kind: Any
    default: Any
    meaning: str


def is_record(kind: Any) -> bool:
    """Return whether a type is a dataclass or a NamedTuple."""
    return isinstance(kind, type) and (
        dataclasses.is_dataclass(kind)
        or (issubclass(kind, tuple) and hasattr(kind, "_field_defaults"))
    )


def record_fields(cls: type) -> tuple[RecordField, ...]:
    """Return the fields of a record in their order."""
    kinds, meanings = get_type_hints(cls, include_extras=True), _meanings(cls)
    if dataclasses.is_dataclass(cls):
        defaults = {
            f.name: f.default if f.default_factory is MISSING else f.default_factory()
            for f in dataclasses.fields(cls)
            if f.init
        }
    else:
        names, given = cls._fields, cls._field_defaults  # type: ignore[attr-defined]
        defaults = {name: given.get(name, MISSING) for name in names}
    return tuple(
        RecordField(n, kinds[n], default, meanings.get(n, "")) for n, default in defaults.items()
    )


def summary(cls: type) -> str:
    """Return the first paragraph of a record's docstring, on one line."""
    return " ".join((inspect.getdoc(cls) or "").split("\n\n")[0].split())


@cache
def _meanings(cls: type) -> dict[str, str]:
    """Return what is said of each field; of fields described together, at the first one."""
    meanings: dict[str, str] = {}
    for base in reversed(cls.__mro__[:-1]):
        if is_record(base):
            meanings |= _listed(inspect.getdoc(base) or "") | _below(base)
    return meanings


def _below(cls: type) -> dict[str, str]:
    """Return the strings that stand below fields."""
    found = {}
    (tree,) = ast.parse(textwrap.dedent(inspect.getsource(cls))).body
    assert isinstance(tree, ast.ClassDef)
    for field, after in zip(tree.body, tree.body[1:], strict=False):
        if (
            isinstance(field, ast.AnnAssign)
            and isinstance(field.target, ast.Name)
            and isinstance(after, ast.Expr)
        ):
            text = getattr(after.value, "value", None)
            if isinstance(text, str):
                found[field.target.id] = " ".join(text.split())
    return found


def _listed(docstring: str) -> dict[str, str]:
    """Return the entries of the section "Attributes" or "Parameters"."""
    section = re.search(
        r"^(?:Attributes|Parameters)\n-+\n(.*?)(?=^\S[^\n]*\n---|\Z)", docstring, re.M | re.S
    )
    if section is None:
        return {}
    found: dict[str, str] = {}
    for entry in re.finditer(
        r"^(\w[\w, ]*?)(?: : [^\n]*)?\n((?:[ ]+[^\n]*\n?|\n)*)", section[1] + "\n", re.M
    ):
        names = entry[1].split(", ")
        found[names[0]] = ("" if len(names) == 1 else ", ".join(names) + ": ") + " ".join(
            entry[2].split()
        )
    return found
