"""The recorded series of a group's flights on one time axis, 0 being the start of what is scored (the circle)."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.geometry import Array
from drake_aerial.study.statistics import Record, by_solution, flown

STEP = 0.05
"""Of the time axis [s]."""

PANELS = ("position_error", "velocity_error", "attitude_error", "thrust", "moment", "tilt")
_TAKE_OFF = ("ground", "tensioning", "lifting")


@dataclass(frozen=True, eq=False)
class Timeline:
    """Flights of one group over time.

    Attributes
    ----------
    time : (T,) array
        [s], from the lift on; 0 at the start of the circle.
    values : dict of (F, T) arrays
        By the names in `PANELS`, SI units; thrust and length of the moment are means over the quadrotors. NaN where a flight
        is not there: before its lift, after its end.
    solution : (F,) int array
        Rank of the solution of each flight.
    completed : (F,) bool array
    phases : dict
        Name to (start, end) [s] on this axis.
    missing : int
        Flights whose series could not be read.
    """

    time: Array
    values: dict[str, Array]
    solution: np.ndarray
    completed: np.ndarray
    phases: dict[str, tuple[float, float]]
    missing: int

    def clusters(self, name: str) -> list[Array]:
        """Return completed flights over the scored time, one (m_k, T') array a solution; flights with gaps there are left out."""
        scored = (self.time >= 0.0) & (self.time <= self._scored_end() + 1e-9)
        rows = self.values[name][:, scored]
        whole = self.completed & np.isfinite(rows).all(axis=1)
        return [rows[whole & (self.solution == rank)] for rank in np.unique(self.solution[whole])]

    def _scored_end(self) -> float:
        # A sample less than what was flown: the last falls on either side of a step.
        return max((end for start, end in self.phases.values()), default=0.0) - STEP


def read_timeline(folder: Path, records: Sequence[Record]) -> Timeline:
    """Return the flights of one group over time.

    Parameters
    ----------
    folder : Path
        The study's; the series are in `series/<key>.npz`.
    records : sequence of dict
        Of the group.
    """
    flights, missing = [], 0
    for rank, members in by_solution(flown(records)).items():
        for record in members:
            series = _read(folder / "series" / f"{record['key']}.npz")
            if series is None:
                missing += 1
            else:
                flights.append((rank, record, series))
    if not flights:
        empty = {name: np.zeros((0, 0)) for name in PANELS}
        return Timeline(np.zeros(0), empty, np.zeros(0, int), np.zeros(0, bool), {}, missing)
    starts = [_start(record, series) for _, record, series in flights]
    first = min(series["time"][_carried(series)] - start for (_, _, series), start in zip(flights, starts))
    last = max(series["time"][-1] - start for (_, _, series), start in zip(flights, starts))
    time = STEP * np.arange(np.floor(first / STEP), np.ceil(last / STEP) + 1)
    values = {
        name: np.array([_resample(time, series, start, name) for (_, _, series), start in zip(flights, starts)])
        for name in PANELS
    }
    completed = np.array([record["outcome"] == "completed" for _, record, _ in flights])
    return Timeline(
        time, values, np.array([rank for rank, _, _ in flights]), completed, _phases(flights, starts), missing
    )


def _read(path: Path) -> dict[str, Array] | None:
    try:
        with np.load(path, allow_pickle=False) as data:
            series = {name: np.asarray(data[name], float) for name in ("time", "phase", *PANELS)}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    for name in ("thrust", "moment"):
        # A flight's quadrotors count alike; a moment by its length.
        value = np.linalg.norm(series[name], axis=2) if series[name].ndim == 3 else series[name]
        series[name] = value.mean(axis=1) if value.ndim == 2 else value
    return series if len(series["time"]) else None


def _carried(series: dict[str, Array]) -> int:
    """Index of the first sample of the lift."""
    return int(np.argmax(series["phase"] >= 2)) if (series["phase"] >= 2).any() else 0


def _start(record: Record, series: dict[str, Array]) -> float:
    phases = (record["metrics"] or {}).get("phases") or {}
    if "circle" in phases:
        return float(phases["circle"][0])
    later = [start for name, (start, _) in phases.items() if name not in _TAKE_OFF]
    return float(min(later)) if later else float(series["time"][0])


def _phases(flights: Sequence[Any], starts: Sequence[float]) -> dict[str, tuple[float, float]]:
    phases: dict[str, tuple[float, float]] = {}
    for (_, record, _), start in zip(flights, starts):
        for name, (begin, end) in ((record["metrics"] or {}).get("phases") or {}).items():
            if record["outcome"] == "completed" and name not in phases:
                phases[name] = (float(begin) - start, float(end) - start)
    return phases


def _resample(time: Array, series: dict[str, Array], start: float, name: str) -> Array:
    lifted = slice(_carried(series), None)
    values = np.interp(time, series["time"][lifted] - start, series[name][lifted], left=np.nan, right=np.nan)
    return values
