"""One trial of a study: what a worker is told, how it flies it, and what it hands back."""

from __future__ import annotations

import hashlib
import json
import threading
import time
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from drake_aerial._version import __version__
from drake_aerial.choices import Belief
from drake_aerial.contacts.solutions import ContactSolutions, Solution
from drake_aerial.errors import InputError, JobError
from drake_aerial.geometry import Array, transform
from drake_aerial.simulation.trial_result import TrialResult
from drake_aerial.study.conditions import Condition
from drake_aerial.study.contacts import cached_scan, check_version, place
from drake_aerial.study.plan import Arm
from drake_aerial.study.seeds import seed_of

SCHEMA = "drake_aerial/study_record"
VERSION = 1
NOT_FLOWN = "not_flown"

_EVERY = 5
"""Of the 10 ms samples of a flight, every fifth is kept."""
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

Record = dict[str, Any]
Series = dict[str, Array]


@dataclass(frozen=True, eq=False)
class TrialTask:
    """What a worker needs to fly one trial.

    Attributes
    ----------
    key : str
        Hash of everything the trial's result depends on.
    condition : Condition
    method, belief, inertia : str
    contacts : ContactSolutions
        With the one solution that is flown, as transferred.
    solution : int or None
        Its rank among those flown; None where it is not.
    rank : int or None
        Its rank among the contacts; None if there are none.
    trial : int
        From 0.
    seed : int
        The plan's.
    obstacles : tuple of str
        Why it is not flown, if it is not.
    version : str
        Of the package that asks.
    """

    key: str
    condition: Condition
    method: str
    belief: Belief
    inertia: str
    contacts: ContactSolutions | None
    solution: int | None
    rank: int | None
    trial: int
    seed: int
    obstacles: tuple[str, ...] = ()
    version: str = __version__

    @property
    def name(self) -> str:
        """What messages call it."""
        return f"{self.condition.name} {self.method} {self.belief} {self.inertia} solution {self.rank} trial {self.trial}"

    @property
    def group(self) -> str:
        """Trials of a group are flown by one diagram."""
        return f"{self.condition.name}-{self.method}-{self.belief}-{self.inertia}-{self.rank}"

    @property
    def cost(self) -> float:
        """What it takes to fly it, relative to others: simulated seconds, more of them for each further quadrotor."""
        if self.solution is None or self.contacts is None:
            return 0.0
        return self.condition.trajectory.duration * (0.7 + 0.3 * len(self.contacts[0].X_SG.p))


@dataclass(frozen=True, eq=False)
class FlownTrial:
    """What a trial gave.

    Attributes
    ----------
    record : dict
        One line of records.jsonl.
    series : dict of arrays
        Empty if nothing was flown.
    diagrams : int
        Diagrams that this process has built so far; Drake keeps them all.
    """

    record: Record
    series: Series
    diagrams: int


def plan_trials(
    arm: Arm,
    contacts: ContactSolutions | None,
    failure: str | None,
    *,
    seed: int,
    fingerprint: str,
    fly_infeasible: bool,
) -> list[TrialTask]:
    """Return the trials of an arm: the best feasible solutions, each so often, and one task for every better one that is not flown.

    Parameters
    ----------
    arm : Arm
    contacts : ContactSolutions or None
        What was found; None with the `failure` that was reported instead.
    failure : str or None
    seed : int
        The plan's.
    fingerprint : str
        Of the condition's files.
    fly_infeasible : bool
        Whether solutions are flown that something speaks against.
    """
    configuration = {
        "version": __version__,
        "condition": {k: v for k, v in arm.condition.to_dict().items() if k != "title"},
        "files": fingerprint,
        "method": arm.method,
        "belief": arm.belief,
        "inertia": arm.inertia,
        "seed": seed,
    }

    def task(
        found: Solution | None, solution: int | None, trial: int, obstacles: tuple[str, ...]
    ) -> TrialTask:
        rank = None if found is None else found.rank
        own = {**configuration, "rank": rank, "trial": trial, "flown": solution is not None}
        key = hashlib.sha256(json.dumps(own, sort_keys=True).encode()).hexdigest()[:24]
        flown = None
        if found is not None and contacts is not None:
            fields = {
                name: getattr(contacts, name)
                for name in ("method", "seed", "skill", "cloud", "timing")
            }
            flown = ContactSolutions(**fields, solutions=(found,))
        return TrialTask(
            key,
            arm.condition,
            arm.method,
            arm.belief,
            arm.inertia,
            flown,
            solution,
            rank,
            trial,
            seed,
            obstacles,
        )

    if contacts is None:
        return [task(None, None, 0, (failure or "no contacts were found",))]
    payload = arm.condition.carried(arm.inertia)
    tasks, flown = [], 0
    for found in contacts.solutions:
        if flown == arm.solutions:
            break
        obstacles = tuple(map(str, place(found, payload).obstacles))
        if obstacles and not fly_infeasible:
            tasks.append(task(found, None, 0, obstacles))
            continue
        flown += 1
        tasks += [task(found, flown, trial, obstacles) for trial in range(arm.trials)]
    return tasks


def fly_trial(task: TrialTask) -> FlownTrial:
    """Fly one trial; a solution that cannot be flown gives a record that says so.

    Raises
    ------
    InputError
        If the package here is of another version.
    """
    check_version(task.version)
    # A worker of several threads flies one trial at a time: they share the diagram.
    with _ONE_AT_A_TIME:
        return _fly(task)


_ONE_AT_A_TIME = threading.Lock()


class _Hangar:
    """The flight that this process flew last, and how many it has prepared."""

    group: tuple[str, str] | None = None
    flight: Any = None
    diagrams = 0


def _fly(task: TrialTask) -> FlownTrial:
    seed = seed_of(task.seed, "flight", task.trial)
    record: Record = {
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
        "seed": seed,
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
    if task.contacts is None:
        return FlownTrial(record, {}, _Hangar.diagrams)
    payload = task.condition.carried(task.inertia)
    found = task.contacts[0]
    placed = place(found, payload)
    positions = placed.solution.X_SG.p
    com = transform(payload.X_SP, payload.com)
    centre = positions.mean(axis=0)
    record |= {
        "feasible": found.feasible,
        "reasons": [str(reason) for reason in found.reasons],
        "moved_m": placed.moved.tolist(),
    }
    record["contact"] = {
        "centre_S": centre.tolist(),
        "positions_S": positions.tolist(),
        "com_S": com.tolist(),
        "off_com_m": float(np.linalg.norm((centre - com)[:2])),
    }
    if task.solution is None:
        return FlownTrial(record, {}, _Hangar.diagrams)
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        flight = _flight(task, placed.solution, payload)
    except (InputError, JobError) as error:
        record["outcome_reason"] = " ".join(str(error).split())
        return FlownTrial(record, {}, _Hangar.diagrams)
    result: TrialResult = flight.run(seed)
    metrics = result.metrics
    record["outcome"] = metrics["outcome"]
    record["outcome_reason"] = metrics["outcome_reason"] or None
    record["outcome_time_s"] = metrics["outcome_time_s"]
    record["metrics"] = {key: value for key, value in metrics.items() if key not in _NOT_METRICS}
    record["timing"] = {
        "wall_s": round(time.perf_counter() - wall, 3),
        "cpu_s": round(time.process_time() - cpu, 3),
        **metrics["timing"],
    }
    return FlownTrial(record, panel_series(result), _Hangar.diagrams)


def _flight(task: TrialTask, solution: Solution, payload: Any) -> Any:
    """Return the flight of a task's group, prepared now or for the trial before."""
    from drake_aerial.simulation.trial import prepare_flight

    group = (task.group, json.dumps([task.seed, asdict(task.condition)], default=str))
    if _Hangar.group != group:
        _Hangar.group = _Hangar.flight = None
        assert task.contacts is not None
        fields = {
            name: getattr(task.contacts, name)
            for name in ("method", "seed", "skill", "cloud", "timing")
        }
        flight = prepare_flight(
            ContactSolutions(**fields, solutions=(solution,)),
            payload=payload,
            solution=solution.rank,
            cloud=cached_scan(task.condition, task.seed),
            belief=task.belief,
            controller=task.condition.controller,
            trajectory=task.condition.trajectory,
            cable=task.condition.cable,
            noise=task.condition.flight_noise,
            # The methods do not know the true centre of mass: what cannot hang by it is flown, and fails.
            force=True,
        )
        _Hangar.diagrams += 1
        _Hangar.group, _Hangar.flight = group, flight
    return _Hangar.flight


def panel_series(result: TrialResult) -> Series:
    """Return what the report's panels show of a flight, at 20 Hz and in single precision.

    Returns
    -------
    dict of arrays
        time, position_error, velocity_error, attitude_error, tilt (T,) [s, m, m/s, rad, rad], phase (T,) int, thrust, tension (T, n) [N],
        moment (T, n, 3) [N m].
    """
    series = {name: values[::_EVERY] for name, values in result.series.items()}
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
