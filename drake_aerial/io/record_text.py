"""Records as YAML: all their fields, each with its meaning and range as a comment."""

import dataclasses
import inspect
import json
import math
import re
import textwrap
from typing import Any, get_args

import yaml

from drake_aerial.io.records import is_record, range_text

_WIDTH = 100


def record_to_mapping(record: Any) -> dict[str, Any]:
    """Return a record as nested mappings and lists, which `record_from_mapping` reads."""
    return {f.name: _plain(getattr(record, f.name)) for f in dataclasses.fields(record) if f.init}


def record_to_yaml(record: Any) -> str:
    """Return a record as YAML that `read_record` reads back to an equal one, with comments.

    A record that may be left out, and is, stands as a comment that shows its keys.
    """
    first = (inspect.getdoc(type(record)) or "").split("\n\n")[0]
    return "\n".join([*_wrapped(" ".join(first.split())), "", *_lines(record)]) + "\n"


def field_comment(record: Any, name: str) -> str:
    """Return a field's meaning and range, as "Mass [kg]. Must be > 0."."""
    field = record.__pydantic_fields__[name]
    meaning, bounds = " ".join((field.description or "").split()), range_text(field)
    return f"{meaning} Must be {bounds}." if bounds else meaning


def _plain(value: Any) -> Any:
    if is_record(type(value)):
        return record_to_mapping(value)
    return [_plain(entry) for entry in value] if isinstance(value, (list, tuple)) else value


def _lines(record: Any, comments: bool = True) -> list[str]:
    """Return the lines of a record's fields."""
    lines: list[str] = []
    for field in dataclasses.fields(record):
        value = getattr(record, field.name)
        nested = _nested(value)
        line = f"{field.name}:" if nested else f"{field.name}: {_flow(value)}"
        # In YAML None is called null.
        comment = re.sub(r"\bNone\b", "null", field_comment(record, field.name)) if comments else ""
        if comment and len(line) + len(comment) + 4 <= _WIDTH:
            lines.append(f"{line}  # {comment}")
        else:
            lines += [*_wrapped(comment), line]
        lines += [f"  {nested_line}" for nested_line in nested]
        if comments and value is None:
            lines += _left_out(field.name, record.__pydantic_fields__[field.name].annotation)
    return lines


def _nested(value: Any) -> list[str]:
    """Return the lines of a record or a list of records; none for other values."""
    if is_record(type(value)):
        return _lines(value)
    if isinstance(value, (list, tuple)) and value and is_record(type(value[0])):
        entries = [_lines(entry, comments=False) for entry in value]
        return [
            ("- " if i == 0 else "  ") + line for lines in entries for i, line in enumerate(lines)
        ]
    return []


def _left_out(name: str, kind: Any) -> list[str]:
    """Return, as comments, the record that a field may hold."""
    for record in filter(is_record, get_args(kind)):
        fields = dataclasses.fields(record)
        if any(f.default is f.default_factory is dataclasses.MISSING for f in fields):
            return [f"# {name}: {{{', '.join(f'{f.name}: ...' for f in fields)}}}"]
        return [f"# {line}" for line in (f"{name}:", *(f"  {line}" for line in _lines(record())))]
    return []


def _flow(value: Any) -> str:
    """Return a value on one line."""
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_flow, value))}]"
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            return ".inf" if value > 0 else "-.inf"
        # Other YAML readers read 1e-09, which has no decimal point, as text.
        return re.sub(r"^(-?\d+)e", r"\1.0e", repr(float(value)))
    text = str(value)
    return text if not isinstance(value, str) or yaml.safe_load(text) == text else json.dumps(text)


def _wrapped(text: str) -> list[str]:
    # No line break within "Must be > 0."
    text = re.sub(r"Must be .*$", lambda bounds: bounds[0].replace(" ", "\N{NO-BREAK SPACE}"), text)
    lines = textwrap.wrap(
        text, _WIDTH, initial_indent="# ", subsequent_indent="# ", break_on_hyphens=False
    )
    return [line.replace("\N{NO-BREAK SPACE}", " ") for line in lines]
