"""The folder of a study: one line per finished trial, appended whole, and what lies beside it."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from drake_aerial._version import __version__
from drake_aerial.errors import InputError
from drake_aerial.io.files import replacing, write_text
from drake_aerial.io.strict_yaml import mapping_from_json, read_json, read_mapping
from drake_aerial.study.plan import StudyPlan
from drake_aerial.study.trials import SCHEMA, VERSION, FlownTrial, Record

RECORDS = "records.jsonl"
PLAN = "study.yaml"
TIMING = "timing.json"
_LOCK = ".lock"
_NEEDED = ("key", "condition", "method", "belief", "inertia", "rank", "trial", "outcome", "metrics")


def read_records(folder: str | Path) -> tuple[list[Record], list[str]]:
    """Return the records of a study, in the file's order, and a complaint for every line that is none.

    A line that is damaged, of another schema, or a repetition is left out; a study that goes on flies its trial again.

    Raises
    ------
    InputError
        If the file is there and cannot be read.
    """
    path = Path(folder) / RECORDS
    try:
        lines = path.read_bytes().split(b"\n") if path.exists() else []
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    records: list[Record] = []
    complaints: list[str] = []
    known: set[str] = set()
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        record, complaint = _record(line)
        if record is not None and record["key"] in known:
            complaint = f"repeats the trial {record['key']}"
        if record is None or complaint:
            complaints.append(f"{path.name} line {number} {complaint}; left out")
            continue
        known.add(record["key"])
        records.append(record)
    return records, complaints


def _record(line: bytes) -> tuple[Record | None, str]:
    try:
        values = mapping_from_json(line, "the line")
    except InputError:
        return None, "is damaged or cut short"
    if (values.get("schema"), values.get("version")) != (
        SCHEMA,
        VERSION,
    ):
        return None, f"is no record of schema {SCHEMA} version {VERSION}"
    missing = [key for key in _NEEDED if key not in values]
    return (None, f"has no {missing[0]!r}") if missing else (values, "")


class StudyFolder:
    """A study's folder while a campaign writes to it; `opened` makes one.

    Attributes
    ----------
    path : Path
    """

    def __init__(self, path: Path):
        self.path = path

    @classmethod
    @contextmanager
    def opened(cls, path: str | Path, plan: StudyPlan) -> Iterator[StudyFolder]:
        """Yield the folder, made if missing, for this plan alone and for one campaign at a time.

        Raises
        ------
        InputError
            If it holds another study, another campaign is writing to it, or it cannot be made.
        """
        folder = cls(Path(path))
        try:
            (folder.path / "series").mkdir(parents=True, exist_ok=True)
            lock = os.open(folder.path / _LOCK, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            raise InputError(f"cannot write in {path}: {error.strerror or error}") from error
        try:
            try:
                # Held by the process, not by the file: whoever is killed lets go.
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                raise InputError(
                    f"another study is writing to {path}; wait for it, or give another folder (--out)"
                ) from error
            folder._claim(plan)
            folder._mend()
            yield folder
        finally:
            os.close(lock)

    def _claim(self, plan: StudyPlan) -> None:
        path = self.path / PLAN
        ours = json.loads(json.dumps(plan.to_dict()))
        if not path.exists():
            if (self.path / RECORDS).exists():
                raise InputError(
                    f"{self.path} has records and no {PLAN}; give another folder (--out)"
                )
            write_text(path, yaml.safe_dump(ours, sort_keys=False, width=120))
            return
        difference = _difference(read_mapping(path), ours, "")
        if difference is not None:
            raise InputError(
                f"{self.path} holds another study: {difference}; give another folder (--out), or the same plan"
            )

    def _mend(self) -> None:
        """Cut off a last line without an end: its writer was killed, and its trial is flown again."""
        path = self.path / RECORDS
        if not path.exists():
            return
        data = path.read_bytes()
        whole = data.rfind(b"\n") + 1
        if whole != len(data):
            with open(path, "r+b") as file:
                file.truncate(whole)

    def append(self, flown: FlownTrial) -> None:
        """Write a trial's series, then its line: whoever reads the line finds the series.

        Raises
        ------
        InputError
            If the disk takes no more.
        """
        key = flown.record["key"]
        line = json.dumps(flown.record, allow_nan=False).encode() + b"\n"
        if flown.series:
            with replacing(self.path / "series" / f"{key}.npz") as temporary:
                arrays: dict[str, Any] = dict(flown.series)
                np.savez_compressed(temporary, **arrays)
        path = self.path / RECORDS
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

    def sort(self, keys: Sequence[str]) -> None:
        """Put the records into the order of `keys`; nothing is done while one is missing or a line is damaged."""
        records, complaints = read_records(self.path)
        by_key = {record["key"]: record for record in records}
        if complaints or set(by_key) != set(keys) or list(by_key) == list(keys):
            return
        text = "".join(json.dumps(by_key[key], allow_nan=False) + "\n" for key in keys)
        write_text(self.path / RECORDS, text)

    def note_timing(
        self, transfers: dict[str, dict[str, float]], session: dict[str, Any] | None = None
    ) -> None:
        """Add what transfers took, and a session's time, to timing.json."""
        path = self.path / TIMING
        try:
            known = read_json(path)
            known = {"transfers": dict(known["transfers"]), "sessions": list(known["sessions"])}
        except (ValueError, KeyError, TypeError):
            known = {"transfers": {}, "sessions": []}
        known["transfers"] |= transfers
        if session is not None:
            known["sessions"].append(session)
        write_text(path, json.dumps(known, indent=1) + "\n")


def _difference(theirs: Any, ours: Any, where: str) -> str | None:
    """Return the first place where two plans differ, in words, or None."""
    if isinstance(theirs, dict) and isinstance(ours, dict):
        for key in (*ours, *(k for k in theirs if k not in ours)):
            found = _difference(
                theirs.get(key), ours.get(key), f"{where}.{key}" if where else str(key)
            )
            if found is not None:
                return found
        return None
    if isinstance(theirs, list) and isinstance(ours, list) and len(theirs) == len(ours):
        for k, (a, b) in enumerate(zip(theirs, ours)):
            label = b.get("name", k + 1) if isinstance(b, dict) else k + 1
            found = _difference(a, b, f"{where} {label}")
            if found is not None:
                return found
        return None
    if theirs == ours:
        return None
    if where == "package_version":
        return f"it was flown by version {theirs}, this is {__version__}"
    return f"{where} is {_short(theirs)} there, {_short(ours)} now"


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."
