"""records.jsonl of a study: one line per finished trial, appended as a whole."""

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from drake_aerial.errors import InputError
from drake_aerial.io.files import write_text
from drake_aerial.io.strict_yaml import mapping_from_json

RECORDS = "records.jsonl"
SCHEMA = "drake_aerial/study_record"
VERSION = 1
_REQUIRED = (
    "key",
    "condition",
    "method",
    "belief",
    "inertia",
    "rank",
    "trial",
    "outcome",
    "metrics",
)

Record = dict[str, Any]


def read_records(folder: str | Path) -> tuple[list[Record], list[str]]:
    """Return the records of a study, in the file's order, and a warning per invalid line.

    A line that is damaged, of another schema, or a repetition is left out; a resumed study flies
    its trial again.

    Raises
    ------
    InputError
        If the file exists and cannot be read.
    """
    path = Path(folder) / RECORDS
    try:
        lines = path.read_bytes().split(b"\n") if path.exists() else []
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    records: dict[str, Record] = {}
    warnings = []
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        record, fault = _parse(line)
        if record is not None and record["key"] in records:
            fault = f"repeats the trial {record['key']}"
        if record is None or fault:
            warnings.append(f"{path.name} line {number} {fault}; left out")
        else:
            records[record["key"]] = record
    return list(records.values()), warnings


def _parse(line: bytes) -> tuple[Record | None, str]:
    """Return the record of a line, or None and what is wrong with it."""
    try:
        values = mapping_from_json(line, "the line")
    except InputError:
        return None, "is damaged or cut short"
    if (values.get("schema"), values.get("version")) != (SCHEMA, VERSION):
        return None, f"is not a record of schema {SCHEMA} version {VERSION}"
    missing = [key for key in _REQUIRED if key not in values]
    return (None, f"has no {missing[0]!r}") if missing else (values, "")


def append_record(folder: Path, record: Record) -> None:
    """Append a line to the records of a study and wait until it is on the disk.

    Raises
    ------
    InputError
        If the file cannot be written, for instance because the disk is full.
    ValueError
        If a value is NaN or infinite.
    """
    line = json.dumps(record, allow_nan=False).encode() + b"\n"
    path = folder / RECORDS
    try:
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
        try:
            if os.write(file, line) != len(line):
                raise OSError("the disk is full")
            os.fsync(file)
        finally:
            os.close(file)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror or error}") from error


def cut_unfinished_line(folder: Path) -> None:
    """Cut off a last line without a line end, which a killed study leaves."""
    path = folder / RECORDS
    if not path.exists():
        return
    data = path.read_bytes()
    finished = data.rfind(b"\n") + 1
    if finished != len(data):
        with open(path, "r+b") as file:
            file.truncate(finished)


def sort_records(folder: Path, keys: Sequence[str]) -> None:
    """Write the records in the order of `keys`, if all are there and no line is damaged."""
    records, warnings = read_records(folder)
    by_key = {record["key"]: record for record in records}
    if warnings or set(by_key) != set(keys) or list(by_key) == list(keys):
        return
    text = "".join(json.dumps(by_key[key], allow_nan=False) + "\n" for key in keys)
    write_text(folder / RECORDS, text)
