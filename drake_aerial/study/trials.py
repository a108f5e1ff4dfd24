"""One trial of a study: the flight of a task, as a record and its time series."""

from __future__ import annotations

import json
import threading
import time
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from drake_aerial.contacts.solutions import Solution
from drake_aerial.errors import InputError, JobError
from drake_aerial.geometry import Array, transform
from drake_aerial.plant.payload import Payload
from drake_aerial.simulation.trial_result import TrialResult
from drake_aerial.study.contacts import Placed, cached_scan, check_version, place
from drake_aerial.study.records import SCHEMA, VERSION, Record
from drake_aerial.study.seeds import seed_of
from drake_aerial.study.trial_tasks import TrialTask

if TYPE_CHECKING:
    from drake_aerial.simulation.flight import Flight

NOT_FLOWN = "not_flown"
_SAMPLING = 5
"""Every fifth of a flight's 10 ms samples is kept."""
_NOT_METRICS = (
    "schema",
    "version",
    "outcome",
    "outcome_reason",
    "outcome_time_s",
    "timing",
    "seed",
    "configuration",
    "phases",
)


@dataclass(frozen=True, eq=False)
class FlownTrial:
    """The result of a trial.

    Attributes
    ----------
    record : dict
        One line of records.jsonl.
    series : dict of arrays
        See `panel_series`; empty if nothing was flown.
    diagrams : int
        Number of diagrams that this process has built; Drake keeps them all.
    """

    record: Record
    series: dict[str, Array]
    diagrams: int


class _FlightCache:
    """The last prepared flight of this process, and the number of flights prepared."""

    key: ClassVar[str | None] = None
    flight: ClassVar[Flight | None] = None
    diagrams: ClassVar[int] = 0


# The threads of a worker share the diagram.
_one_flight = threading.Lock()


def fly_trial(task: TrialTask) -> FlownTrial:
    """Fly one trial; a solution that cannot be flown gets a record with the reason.

    Raises
    ------
    InputError
        If the sender has another version of the package.
    """
    check_version(task.version)
    with _one_flight:
        record, series = _fly(task)
        return FlownTrial(record, series, _FlightCache.diagrams)


def _fly(task: TrialTask) -> tuple[Record, dict[str, Array]]:
    """Return the record and the series of a trial."""
    record = _empty_record(task)
    if task.contacts is None:
        return record, {}
    payload = task.condition.payload_with(task.inertia)
    placed = place(task.contacts[0], payload)
    record |= _contact_fields(task.contacts[0], placed, payload)
    if task.solution is None:
        return record, {}
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        flight = _prepare(task, placed.solution, payload)
    except (InputError, JobError) as error:
        record["outcome_reason"] = " ".join(str(error).split())
        return record, {}
    result = flight.run(record["seed"])
    metrics = result.metrics
    record |= {
        "outcome": metrics["outcome"],
        "outcome_reason": metrics["outcome_reason"] or None,
        "outcome_time_s": metrics["outcome_time_s"],
        "metrics": {key: value for key, value in metrics.items() if key not in _NOT_METRICS},
        "timing": {
            "wall_s": round(time.perf_counter() - wall, 3),
            "cpu_s": round(time.process_time() - cpu, 3),
            **metrics["timing"],
        },
    }
    return record, panel_series(result)


def _empty_record(task: TrialTask) -> Record:
    """Return the record of a trial that was not flown."""
    return {
        "schema": SCHEMA,
        "version": VERSION,
        "key": task.key,
        "condition": task.condition.name,
        "method": task.method,
        "belief": task.belief,
        "inertia": task.inertia,
        "solution": task.solution,
        "rank": task.rank,
        "trial": task.trial,
        "seed": seed_of(task.seed, "flight", task.trial),
        "feasible": False,
        "reasons": list(task.obstacles),
        "moved_m": [],
        "contact": None,
        "outcome": NOT_FLOWN,
        "outcome_reason": "; ".join(task.obstacles) or None,
        "outcome_time_s": None,
        "metrics": None,
        "timing": {},
    }


def _contact_fields(found: Solution, placed: Placed, payload: Payload) -> Record:
    """Return the fields of a record that describe its contact, in the scan's frame S."""
    p_SG = placed.solution.X_SG.p
    p_SC = transform(payload.X_SP, payload.com)
    centre = p_SG.mean(axis=0)
    return {
        "feasible": found.feasible,
        "reasons": [str(reason) for reason in found.reasons],
        "moved_m": placed.moved.tolist(),
        "contact": {
            "centre_S": centre.tolist(),
            "positions_S": p_SG.tolist(),
            "com_S": p_SC.tolist(),
            "off_com_m": float(np.linalg.norm((centre - p_SC)[:2])),
        },
    }


def _prepare(task: TrialTask, solution: Solution, payload: Payload) -> Flight:
    """Return the flight of a task's group; the last one is kept."""
    from drake_aerial.simulation.station_parameters import StationParameters
    from drake_aerial.simulation.trial import prepare_flight

    key = json.dumps([task.group, task.seed, asdict(task.condition)], default=str)
    if _FlightCache.key != key or _FlightCache.flight is None:
        _FlightCache.key = _FlightCache.flight = None
        assert task.contacts is not None
        _FlightCache.flight = prepare_flight(
            replace(task.contacts, solutions=(solution,)),
            payload=payload,
            solution=solution.rank,
            cloud=cached_scan(task.condition, task.seed),
            belief=task.belief,
            controller=task.condition.controller,
            trajectory=task.condition.trajectory,
            cable=task.condition.cable,
            noise=task.condition.flight_noise,
            parameters=StationParameters(air=None),
            # Methods do not know the true centre of mass: an unbalanced payload is flown and fails.
            force=True,
        )
        _FlightCache.diagrams += 1
        _FlightCache.key = key
    return _FlightCache.flight


def panel_series(result: TrialResult) -> dict[str, Array]:
    """Return the time series of a flight for the report, at 20 Hz and in single precision.

    Returns
    -------
    dict of arrays
        `time` [s], `position_error` [m], `velocity_error` [m/s], `attitude_error` and `tilt` [rad],
        all (T,); `phase` (T,) int; `thrust` and `tension` (T, n) [N]; `moment` (T, n, 3) [N m].
    """
    series = {name: values[::_SAMPLING] for name, values in result.series.items()}
    position = np.linalg.norm(series["payload_position"] - series["reference_position"], axis=1)
    velocity = np.linalg.norm(series["payload_velocity"] - series["reference_velocity"], axis=1)
    panels = {"time": series["time"], "position_error": position, "velocity_error": velocity}
    panels |= {
        name: series[name] for name in ("attitude_error", "tilt", "thrust", "moment", "tension")
    }
    return {
        **{name: np.asarray(values, dtype=np.float32) for name, values in panels.items()},
        "phase": np.asarray(series["phase"], dtype=np.int8),
    }
