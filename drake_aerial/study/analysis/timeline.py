"""The recorded series of a group's flights on one time axis, 0 being the start of what is scored (the circle)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drake_aerial.geometry import Array
from drake_aerial.io.archives import load_archive
from drake_aerial.study.analysis.statistics import Record, by_solution, flown

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
        """Return completed flights over the scored time that all of them have, one (m_k, T') array a solution."""
        rows, solution = self.values[name][self.completed], self.solution[self.completed]
        scored = (self.time >= 0.0) & np.isfinite(rows).all(axis=0)
        return (
            [rows[solution == rank][:, scored] for rank in np.unique(solution)]
            if scored.any()
            else []
        )


def read_timeline(
    folder: Path, records: Sequence[Record], phases: Mapping[str, tuple[float, float]] | None = None
) -> Timeline:
    """Return the flights of one group over time.

    Parameters
    ----------
    folder : Path
        The study's; the series are in `series/<key>.npz`.
    records : sequence of dict
        Of the group.
    phases : mapping, optional
        Name to (start, end) [s] of the trajectory's phases; without them time starts at the first phase after the lift.
    """
    phases = phases or {}
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
    starts = [_start(phases, series) for _, _, series in flights]
    first = min(
        series["time"][_carried(series)] - start for (_, _, series), start in zip(flights, starts)
    )
    last = max(series["time"][-1] - start for (_, _, series), start in zip(flights, starts))
    time = STEP * np.arange(np.floor(first / STEP), np.ceil(last / STEP) + 1)
    values = {
        name: np.array(
            [_resample(time, series, start, name) for (_, _, series), start in zip(flights, starts)]
        )
        for name in PANELS
    }
    completed = np.array([record["outcome"] == "completed" for _, record, _ in flights])
    return Timeline(
        time,
        values,
        np.array([rank for rank, _, _ in flights]),
        completed,
        {name: (begin - starts[0], end - starts[0]) for name, (begin, end) in phases.items()},
        missing,
    )


def _read(path: Path) -> dict[str, Array] | None:
    try:
        data = load_archive(path, "a flight's series")
        series = {name: np.asarray(data[name], float) for name in ("time", "phase", *PANELS)}
    except (TypeError, ValueError, KeyError, IndexError):
        return None
    for name in ("thrust", "moment"):
        # A flight's quadrotors count alike; a moment by its length.
        value = np.linalg.norm(series[name], axis=2) if series[name].ndim == 3 else series[name]
        series[name] = value.mean(axis=1) if value.ndim == 2 else value
    return series if len(series["time"]) else None


def _carried(series: dict[str, Array]) -> int:
    """Index of the first sample of the lift."""
    return int(np.argmax(series["phase"] >= 2)) if (series["phase"] >= 2).any() else 0


def _start(phases: Mapping[str, tuple[float, float]], series: dict[str, Array]) -> float:
    if "circle" in phases:
        return float(phases["circle"][0])
    flying = series["phase"] >= len(_TAKE_OFF)
    return float(series["time"][np.argmax(flying)])


def _resample(time: Array, series: dict[str, Array], start: float, name: str) -> Array:
    lifted = slice(_carried(series), None)
    values = np.interp(
        time, series["time"][lifted] - start, series[name][lifted], left=np.nan, right=np.nan
    )
    return values
