"""Records as YAML: all their fields, with what each means as a comment."""

from __future__ import annotations

import json
import math
import re
import textwrap
from typing import Any, get_args

import yaml

from drake_aerial.io.typed_yaml.record_fields import (
    MISSING,
    Unbounded,
    is_record,
    record_fields,
    summary,
)

_WIDTH = 110


def record_to_mapping(record: Any) -> dict[str, Any]:
    """Return a record as nested mappings and lists of plain values, which `record_from_mapping` reads."""
    return {f.name: _plain(getattr(record, f.name)) for f in record_fields(type(record))}


def record_to_yaml(record: Any) -> str:
    """Return a record as YAML that `read_record` reads back to an equal one, with the fields' meanings as comments.

    A record that may be left out, and is, stands as a comment, ready to be taken in.
    """
    return "\n".join([*_wrapped(summary(type(record))), "", *_lines(record)]) + "\n"


def _plain(value: Any) -> Any:
    if is_record(type(value)):
        return record_to_mapping(value)
    return [_plain(entry) for entry in value] if isinstance(value, (list, tuple)) else value


def _lines(record: Any, comments: bool = True) -> list[str]:
    """Return the lines of a record's fields."""
    lines: list[str] = []
    for field in record_fields(type(record)):
        value = getattr(record, field.name)
        nested = _nested(value)
        line = f"{field.name}:" if nested else f"{field.name}: {_flow(value)}"
        # In YAML None is called null.
        meaning = re.sub(r"\bNone\b", "null", field.meaning) if comments else ""
        if meaning and field.kind == Unbounded:
            meaning += " (.inf is infinite)"
        if meaning and len(line) + len(meaning) + 4 <= _WIDTH:
            lines.append(f"{line}  # {meaning}")
        else:
            lines += [*_wrapped(meaning), line]
        lines += [f"  {nested_line}" for nested_line in nested]
        if comments and value is None:
            lines += _left_out(field.name, field.kind)
    return lines


def _nested(value: Any) -> list[str]:
    """Return the lines of a value that takes several: a record, or a list of records; none for others."""
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
        fields = record_fields(record)
        if any(f.default is MISSING for f in fields):
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
            return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
        # YAML takes 1e-09, which lacks a point, for a text.
        return re.sub(r"^(-?\d+)e", r"\1.0e", repr(float(value)))
    text = str(value)
    return text if not isinstance(value, str) or yaml.safe_load(text) == text else json.dumps(text)


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(
        text, _WIDTH, initial_indent="# ", subsequent_indent="# ", break_on_hyphens=False
    )
