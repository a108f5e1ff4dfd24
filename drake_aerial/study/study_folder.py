"""Folder of a study: unreadable files give warnings; one study at a time may write."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from drake_aerial._version import __version__
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.io.archives import load_archive
from drake_aerial.io.files import replacing, write_text
from drake_aerial.io.strict_yaml import read_json, read_mapping
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.study.plan import StudyPlan
from drake_aerial.study.records import RECORDS, Record, append_record, cut_unfinished_line

PLAN = "study.yaml"
TIMING = "timing.json"
_LOCK = ".lock"


class StudyFolder:
    """The files of a study beside its records.

    Reading gives None for a missing file; a file that cannot be read adds a line to `warnings`.

    Parameters
    ----------
    path : str or Path

    Attributes
    ----------
    path : Path
    warnings : list of str
        One line per file that could not be read.
    """

    def __init__(self, path: str | Path):
        self.path = Path(path)
        self.warnings: list[str] = []

    def contacts_path(self, name: str) -> Path:
        """Return the contacts file of an arm, by "<condition>-<method>"."""
        return self.path / "contacts" / f"{name}.json"

    def scan_path(self, condition: str) -> Path:
        """Return the scan file of a condition."""
        return self.path / "scans" / f"{condition}.npz"

    def skill_path(self, demonstration: str) -> Path:
        """Return the skill file of a demonstration."""
        return self.path / "skills" / f"{Path(demonstration).stem}.npz"

    def series_path(self, key: str) -> Path:
        """Return the time series file of a trial."""
        return self.path / "series" / f"{key}.npz"

    @cached_property
    def plan(self) -> dict[str, Any]:
        """The content of study.yaml; empty if it cannot be read."""
        path = self.path / PLAN
        if not path.exists():
            self.warn(f"{PLAN} is missing: conditions are described by their names alone")
            return {}
        try:
            return read_mapping(path)
        except InputError as error:
            self.warn(str(error))
            return {}

    @property
    def conditions(self) -> dict[str, dict[str, Any]]:
        """Conditions of the plan by name, in the plan's order."""
        listed = self.plan.get("conditions") or []
        return {str(c["name"]): dict(c) for c in listed if isinstance(c, Mapping) and "name" in c}

    def title(self, condition: str) -> str:
        """Return the title of a condition, or its name."""
        known = self.conditions.get(condition, {})
        return str(known.get("title") or known.get("description") or condition)

    def phases(self, condition: str) -> dict[str, tuple[float, float]]:
        """Return (start, end) [s] of the phases of a condition's trajectory, by name."""
        from drake_aerial.references.trajectory_files import read_trajectory, trajectory_from_dict

        given = self.conditions.get(condition, {}).get("trajectory")
        try:
            trajectory = (
                trajectory_from_dict(given)
                if isinstance(given, dict)
                else read_trajectory(str(given))
            )
        except InputError:
            return {}
        return {phase.name: (phase.start, phase.end) for phase in trajectory.phases}

    def contacts(self, condition: str, method: str) -> ContactSolutions | None:
        """Return the contacts of a method, as transferred."""
        return self._read(self.contacts_path(f"{condition}-{method}"), ContactSolutions.read)

    def scan(self, condition: str) -> PointCloud | None:
        """Return the scan of a condition."""
        from drake_aerial.study.scans import read_scan_file

        return self._read(self.scan_path(condition), read_scan_file)

    def skill(self, condition: str) -> ContactSkill | None:
        """Return the skill that was learnt for a condition."""
        demonstration = self.conditions.get(condition, {}).get("demonstration")
        if demonstration is None:
            return None
        return self._read(self.skill_path(str(demonstration)), ContactSkill.load)

    def series(self, key: str) -> dict[str, Array] | None:
        """Return the time series of a trial; no warning if it cannot be read."""
        try:
            return load_archive(self.series_path(key), "a flight's series")
        except InputError:
            return None

    def timing(self) -> dict[str, Any]:
        """Return the content of timing.json: `transfers` by name and a list of `sessions`."""
        try:
            content = read_json(self.path / TIMING)
            return {**content, "transfers": dict(content["transfers"])}
        except (ValueError, KeyError, TypeError):
            return {"transfers": {}, "sessions": []}

    def warn(self, text: str) -> None:
        """Add a warning, with paths relative to the folder."""
        text = text.replace(f"{self.path}/", "")
        if text not in self.warnings:
            self.warnings.append(text)

    def _read(self, path: Path, read: Any) -> Any:
        if not path.exists():
            return None
        try:
            return read(path)
        except InputError as error:
            self.warn(str(error))
            return None

    @contextmanager
    def opened_for(self, plan: StudyPlan) -> Iterator[StudyFolder]:
        """Make the folder if missing and lock it, for this plan and for one process at a time.

        Raises
        ------
        InputError
            If it holds another study, another study is writing to it, or it cannot be made.
        """
        try:
            self.series_path("").parent.mkdir(parents=True, exist_ok=True)
            lock = os.open(self.path / _LOCK, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            raise InputError(f"cannot write in {self.path}: {error.strerror or error}") from error
        try:
            try:
                # The system releases the lock of a killed process.
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                raise InputError(
                    f"another study is writing to {self.path}; wait for it, or give another folder "
                    "(--out)"
                ) from error
            self._check_plan(plan)
            cut_unfinished_line(self.path)
            yield self
        finally:
            os.close(lock)

    def _check_plan(self, plan: StudyPlan) -> None:
        """Write study.yaml, or compare it with the plan."""
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
                f"{self.path} holds another study: {difference}; "
                "give another folder (--out), or the same plan"
            )

    def append(self, record: Record, series: Mapping[str, Array]) -> None:
        """Write the series of a trial, then its record, so that each record has its series.

        Raises
        ------
        InputError
            If a file cannot be written.
        """
        if series:
            with replacing(self.series_path(record["key"])) as temporary:
                arrays: dict[str, Any] = dict(series)
                np.savez_compressed(temporary, **arrays)
        append_record(self.path, record)

    def add_timing(
        self, transfers: Mapping[str, Any], session: dict[str, Any] | None = None
    ) -> None:
        """Add the times of transfers, and of a session, to timing.json."""
        known = self.timing()
        known["transfers"] |= transfers
        if session is not None:
            known["sessions"] = [*known.get("sessions", ()), session]
        write_text(self.path / TIMING, json.dumps(known, indent=1) + "\n")


def _difference(theirs: Any, ours: Any, where: str) -> str | None:
    """Return the first place where two plans differ, in words, or None."""
    if isinstance(theirs, dict) and isinstance(ours, dict):
        keys = dict.fromkeys((*ours, *theirs))
        parts = [
            (theirs.get(key), ours.get(key), f"{where}.{key}" if where else key) for key in keys
        ]
    elif isinstance(theirs, list) and isinstance(ours, list) and len(theirs) == len(ours):
        labels = [
            own.get("name", k) if isinstance(own, dict) else k for k, own in enumerate(ours, 1)
        ]
        parts = [(a, b, f"{where} {label}") for a, b, label in zip(theirs, ours, labels)]
    elif theirs == ours:
        return None
    elif where == "package_version":
        return f"it was flown by version {theirs}, this is {__version__}"
    else:
        return f"{where} is {_short(theirs)} there, {_short(ours)} now"
    differences = (_difference(*part) for part in parts)
    return next((difference for difference in differences if difference is not None), None)


def _short(value: Any) -> str:
    text = json.dumps(value, default=str)
    return text if len(text) <= 60 else text[:57] + "..."
