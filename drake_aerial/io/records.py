"""Records: frozen dataclasses whose fields state type and range, checked by pydantic.

The string below a field is its meaning; `defaults` prints it.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from functools import cache, wraps
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, get_args

from annotated_types import Ge, Gt, Le, Len, Lt
from pydantic import (
    AfterValidator,
    AllowInfNan,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Strict,
    Tag,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic.dataclasses import dataclass as checked_dataclass

from drake_aerial.errors import InputError
from drake_aerial.io.strict_yaml import check_keys, nearest, read_mapping, shown

Kind = TypeVar("Kind")
Number = Annotated[float, Strict(), AllowInfNan(False)]
"""A finite number."""
Positive = Annotated[Number, Gt(0)]
NonNegative = Annotated[Number, Ge(0)]
PositiveOrInfinite = Annotated[float, Strict(), Gt(0)]
"""A positive number or infinity, `.inf` in YAML."""
Vector = tuple[Number, Number, Number]
Whole = Annotated[int, Strict(), BeforeValidator(lambda given: _whole(given))]
Count = Annotated[Whole, Ge(1)]
Flag = Annotated[bool, Strict()]
Name = Annotated[
    str, BeforeValidator(lambda given: str(given) if isinstance(given, (int, float)) else given)
]
"""A text; YAML reads some unquoted texts as numbers."""
OneOrMany = Annotated[
    Annotated[Kind, Tag("one")]
    | Annotated[Sequence[Kind], Len(1), AfterValidator(tuple), Tag("many")],
    Discriminator(
        lambda given: (
            "many" if isinstance(given, Sequence) and not isinstance(given, str) else "one"
        )
    ),
]
"""One value for all, or a sequence with one entry each."""

_CONFIG = ConfigDict(extra="forbid", use_attribute_docstrings=True, arbitrary_types_allowed=True)
_SIGNS: dict[Any, str] = {Gt: ">", Ge: ">=", Lt: "<", Le: "<="}
_BOUNDS = ("greater_than", "greater_than_equal", "less_than", "less_than_equal")
_SENTENCES = {
    "float_type": "must be a number",
    "finite_number": "must be a finite number",
    "dataclass_type": "must be a mapping of keys to values",
    "tuple_type": "must be a list",
    "int_type": "must be a whole number",
    "bool_type": "must be true or false",
    "string_type": "must be a text",
    "missing": "must have more entries",
    "too_short": "must have at least {min_length} entry",
    "too_long": "must have at most {max_length} entries",
}

if TYPE_CHECKING:
    from dataclasses import dataclass as record
else:

    def record(**keywords: Any) -> Any:
        """Return a decorator that makes a dataclass whose constructor checks types and ranges.

        The constructor raises InputError for a bad value, and TypeError for an unknown or missing
        argument. Arrays and NumPy scalars are stored as tuples and plain numbers.

        Parameters
        ----------
        **keywords
            As for `dataclasses.dataclass`.
        """

        def make(cls: Any) -> Any:
            cls._from_document = model_validator(mode="before")(classmethod(_from_document))
            made = checked_dataclass(cls, config=_CONFIG, **keywords)
            construct = made.__init__

            @wraps(construct)
            def __init__(self: Any, *values: Any, **given: Any) -> None:
                try:
                    construct(self, *values, **given)
                except ValidationError as error:
                    raise _constructor_error(made, error) from None

            made.__init__ = __init__
            return made

        return make


def _whole(given: Any) -> Any:
    """Return 3.0 and NumPy's integers as int, and other values unchanged."""
    if isinstance(given, float) and given.is_integer():
        return int(given)
    return int(given) if isinstance(given, Integral) and not isinstance(given, bool) else given


def is_record(kind: Any) -> bool:
    """Return whether a type is a record."""
    return isinstance(kind, type) and hasattr(kind, "__pydantic_fields__")


def read_record(kind: type[Kind], path: str | Path) -> Kind:
    """Return the record of a YAML file whose keys are the fields' names.

    A key that is left out has its default. Where a field is itself a record, its value is a
    mapping, or the name of a YAML file relative to this one.

    Parameters
    ----------
    kind : type
        A record, or a union of records that differ in their field `kind`.
    path : str or Path

    Raises
    ------
    InputError
        In one line: for an unreadable file, an unknown or missing key (with the nearest known
        one), or a value of another type or outside its range.
    """
    return record_from_mapping(kind, read_mapping(path), str(path), Path(path).parent)


def record_from_mapping(
    kind: type[Kind], values: Any, where: str, folder: Path | None = None
) -> Kind:
    """Return the record of a mapping of plain values.

    Parameters
    ----------
    kind : type
        A record, or a union of records that differ in their field `kind`.
    values : mapping
    where : str
        What the values are, or the file they are from; errors begin with it.
    folder : Path, optional
        Folder of the files that the values name; without one, no files are read.

    Raises
    ------
    InputError
        As `read_record` does.
    """
    record = _of_kind(kind, values, where)
    try:
        return _adapter(record).validate_python(values, context={"folder": folder})
    except ValidationError as error:
        raise InputError(f"{where}: {_sentence(record, error)}") from None


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


def _of_kind(kind: Any, values: Any, where: str) -> Any:
    """Return the record, or the one of a union whose `kind` the values name."""
    if is_record(kind):
        return kind
    named = {
        name: record
        for record in get_args(kind)
        for name in get_args(record.__pydantic_fields__["kind"].annotation)
    }
    given = values.get("kind") if isinstance(values, dict) else None
    if not isinstance(given, str) or given not in named:
        raise InputError(
            f"{where}: `kind` must be one of {', '.join(named)}, "
            f"got {shown(given)}{nearest(given, named)}"
        )
    return named[given]


def _from_document(cls: Any, given: Any, info: ValidationInfo) -> Any:
    """Check the keys of a mapping from a document, or read the file that stands in its place.

    Keys in the class's `RETIRED`, which old files have, are dropped.
    """
    folder = info.context and info.context["folder"]
    if isinstance(given, str) and folder:
        return dict(vars(read_record(cls, folder / given)))
    if isinstance(given, dict):
        given = {k: v for k, v in given.items() if k not in getattr(cls, "RETIRED", ())}
        known = cls.__pydantic_fields__
        required = [name for name, field in known.items() if field.is_required()]
        check_keys(
            given, required=required, optional=[name for name in known if name not in required]
        )
    return given


def _constructor_error(cls: Any, error: ValidationError) -> Exception:
    """Return a TypeError for arguments that do not fit the signature, else an InputError."""
    first = error.errors(include_url=False)[0]
    kind, where = first["type"], first["loc"]
    if kind.startswith("unexpected") or (kind == "missing" and len(where) == 1):
        problem = "misses the" if kind == "missing" else "got an unexpected keyword"
        if isinstance(where[0], int):
            problem = "got an unexpected positional"
        near = nearest(where[0], cls.__pydantic_fields__)
        return TypeError(f"{cls.__name__}() {problem} argument {where[0]!r}{near}")
    return InputError(_sentence(cls, error))


def _sentence(record: Any, error: ValidationError) -> str:
    """Return the first error as "`weights.position` must be >= 0, got -1.0"."""
    first = error.errors(include_url=False)[0]
    kind, given, context, where = first["type"], first["input"], first.get("ctx", {}), first["loc"]
    if where and isinstance(where[0], int):  # a positional argument
        where = (list(record.__pydantic_fields__)[where[0]], *where[1:])
    # A missing item is reported as an error of the list.
    path, field = _place(record, where[:-1] if kind == "missing" else where)
    name = f"`{path}`" if path else ""
    if kind == "value_error":
        return f"{name}: {context['error']}" if name else str(context["error"])
    choices: list[str] = []
    if kind in _BOUNDS:
        unit = re.search(r"\[([a-zA-Z].*?)\]", field.description or "")
        message = f"must be {range_text(field)}{f' {unit[1]}' if unit else ''}"
    elif kind == "literal_error":
        choices = re.findall(r"'([^']*)'", context["expected"])
        message = f"must be one of {', '.join(choices)}"
    else:
        message = _SENTENCES[kind].format(**context) if kind in _SENTENCES else first["msg"]
    return f"{name} {message}, got {shown(given)}{nearest(given, choices)}".strip()


def _place(record: Any, where: Sequence[str | int]) -> tuple[str, Any]:
    """Return a path of keys as "weights.position", and its field; names of types are left out."""
    path, field = "", None
    for part in where:
        if isinstance(part, int):
            path += f"[{part}]"
        elif part in record.__pydantic_fields__:
            path += f".{part}"
            field = record.__pydantic_fields__[part]
            record = next(filter(is_record, _leaves(field.annotation)), record)
    return path.lstrip("."), field


def range_text(field: Any) -> str:
    """Return the allowed range of a field, or of a list field's items: "> 0", "in (0, 1]"."""
    bounds = {
        type(leaf): f"{dataclasses.astuple(leaf)[0]:g}"
        for leaf in (*_leaves(field.annotation), *field.metadata)
        if isinstance(leaf, Gt | Ge | Lt | Le)
    }
    low, high = bounds.get(Gt, bounds.get(Ge)), bounds.get(Lt, bounds.get(Le))
    if low and high:
        return f"in {'(' if Gt in bounds else '['}{low}, {high}{')' if Lt in bounds else ']'}"
    return " and ".join(f"{_SIGNS[bound]} {number}" for bound, number in bounds.items())


def _leaves(kind: Any) -> list[Any]:
    """Return the types and the metadata that a type is made of."""
    parts = [*get_args(kind), *getattr(kind, "__metadata__", ())]
    return [leaf for part in parts for leaf in _leaves(part)] or [kind]
