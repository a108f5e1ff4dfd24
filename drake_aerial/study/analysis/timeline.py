"""The recorded series of a group's flights on one time axis; 0 is the start of the circle."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drake_aerial.geometry import Array
from drake_aerial.study.analysis.groups import by_solution
from drake_aerial.study.records import Record
from drake_aerial.study.study_folder import StudyFolder

STEP = 0.05
"""Step of the time axis [s]."""

PANELS = ("position_error", "velocity_error", "attitude_error", "thrust", "moment", "tilt")
_TAKE_OFF = ("ground", "tensioning", "lifting")
_LIFT = 2
"""Index of the phase in which the payload leaves the ground."""

Series = dict[str, Array]
Phases = Mapping[str, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Timeline:
    """The flights of one group over time.

    Attributes
    ----------
    time : (T,) array
        From the lift on [s]; 0 at the start of the circle.
    values : dict of (F, T) arrays
        By the names in `PANELS`, SI units; thrust and the length of the moment are means over the
        quadrotors. NaN before a flight's lift and after its end.
    solution : (F,) int array
        Rank of the solution of each flight.
    completed : (F,) bool array
    phases : dict
        (start, end) [s] on this axis, by name.
    missing : int
        Number of flights whose series could not be read.
    """

    time: Array
    values: dict[str, Array]
    solution: np.ndarray
    completed: np.ndarray
    phases: dict[str, tuple[float, float]]
    missing: int

    def clusters(self, name: str) -> list[Array]:
        """Return the completed flights of each solution (m_k, T'), from the start of the circle.

        The T' times are those that all completed flights have.
        """
        rows, solution = self.values[name][self.completed], self.solution[self.completed]
        scored = (self.time >= 0.0) & np.isfinite(rows).all(axis=0)
        if not scored.any():
            return []
        return [rows[solution == rank][:, scored] for rank in np.unique(solution)]


def read_timeline(folder: StudyFolder, records: Sequence[Record], phases: Phases) -> Timeline:
    """Return the flights of one group over time.

    Parameters
    ----------
    folder : StudyFolder
    records : sequence of dict
        Records of the group.
    phases : mapping
        (start, end) [s] of the trajectory's phases, by name; if there is no circle among them, time
        starts with the first phase after the lift.
    """
    flights: list[tuple[int, Record, Series]] = []
    missing = 0
    for rank, members in by_solution(records).items():
        for record in members:
            series = _read(folder, record["key"])
            if series is None:
                missing += 1
            else:
                flights.append((rank, record, series))
    if not flights:
        empty = {name: np.zeros((0, 0)) for name in PANELS}
        return Timeline(np.zeros(0), empty, np.zeros(0, int), np.zeros(0, bool), {}, missing)
    shifted = [_shifted(series, phases) for _, _, series in flights]
    first = min(series["time"][0] for _, series in shifted)
    last = max(series["time"][-1] for _, series in shifted)
    time = STEP * np.arange(np.floor(first / STEP), np.ceil(last / STEP) + 1)
    values = {
        name: np.array(
            [
                np.interp(time, series["time"], series[name], left=np.nan, right=np.nan)
                for _, series in shifted
            ]
        )
        for name in PANELS
    }
    start = shifted[0][0]
    return Timeline(
        time,
        values,
        np.array([rank for rank, _, _ in flights]),
        np.array([record["outcome"] == "completed" for _, record, _ in flights]),
        {name: (begin - start, end - start) for name, (begin, end) in phases.items()},
        missing,
    )


def _read(folder: StudyFolder, key: str) -> Series | None:
    """Return the series of a flight, or None if they cannot be read."""
    data = folder.series(key)
    try:
        series = {name: np.asarray(data[name], float) for name in ("time", "phase", *PANELS)}  # type: ignore[index]
    except (TypeError, ValueError, KeyError):
        return None
    # Mean over the quadrotors; of a moment, its length.
    thrust, moment = series["thrust"], series["moment"]
    if moment.ndim == 3:
        moment = np.linalg.norm(moment, axis=2)
    series["thrust"] = thrust.mean(axis=1) if thrust.ndim == 2 else thrust
    series["moment"] = moment.mean(axis=1) if moment.ndim == 2 else moment
    return series if len(series["time"]) else None


def _shifted(series: Series, phases: Phases) -> tuple[float, Series]:
    """Return the time at which the circle starts [s], and the series from the lift on, shifted."""
    phase = series["phase"]
    if "circle" in phases:
        start = float(phases["circle"][0])
    else:
        start = float(series["time"][np.argmax(phase >= len(_TAKE_OFF))])
    # argmax is 0 if the payload never left the ground.
    lifted = slice(int(np.argmax(phase >= _LIFT)), None)
    shifted = {name: series[name][lifted] for name in PANELS}
    return start, {**shifted, "time": series["time"][lifted] - start}
