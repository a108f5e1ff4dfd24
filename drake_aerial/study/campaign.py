"""Run a study: contacts first, then every trial that has no record yet."""

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.errors import InputError, one_line
from drake_aerial.study.contacts import (
    SPARE,
    ContactTask,
    FoundContacts,
    cached_scan,
    cached_skill,
    find_contacts,
)
from drake_aerial.study.executors import Executor, open_executor
from drake_aerial.study.plan import StudyPlan
from drake_aerial.study.records import read_records, sort_records
from drake_aerial.study.scans import write_scan
from drake_aerial.study.study_folder import StudyFolder
from drake_aerial.study.trial_tasks import TrialTask, plan_trials
from drake_aerial.study.trials import FlownTrial, fly_trial

Progress = Callable[[float, str], None]
_Found = dict[str, tuple[ContactSolutions | None, str | None]]


@dataclass(frozen=True)
class StudySummary:
    """The result of `run_study`.

    Attributes
    ----------
    folder : Path
    planned, found, flown : int
        Records of the plan, records that existed before, and records that were added.
    outcomes : dict
        Number of records by outcome.
    errors : tuple of str
        One line for every transfer or trial that raised an unexpected error; it has no record.
    complaints : tuple of str
        One line for every damaged line of the records.
    wall_s, cpu_s : float
        Duration of the call, and processor time of all flights [s].
    """

    folder: Path
    planned: int
    found: int
    flown: int
    outcomes: dict[str, int]
    errors: tuple[str, ...]
    complaints: tuple[str, ...]
    wall_s: float
    cpu_s: float

    def to_dict(self) -> dict[str, Any]:
        """Return the summary as plain values."""
        return {
            **vars(self),
            "folder": str(self.folder),
            "errors": list(self.errors),
            "complaints": list(self.complaints),
        }

    def __str__(self) -> str:
        ends = ", ".join(
            f"{count} {outcome.replace('_', ' ')}"
            for outcome, count in sorted(self.outcomes.items())
        )
        before = f" ({self.found} of them before)" if self.found else ""
        return (
            f"{self.found + self.flown} of {self.planned} records{before}: {ends or 'none'}\n"
            f"{self.wall_s:.0f} s, flights {self.cpu_s:.0f} CPU s -> {self.folder}"
        )


def run_study(
    plan: StudyPlan | str | Path,
    out: str | Path,
    *,
    workers: int = 0,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> StudySummary:
    """Run a study; resume it if it was interrupted.

    The folder holds study.yaml (the plan), contacts, scans, skills, one line of records.jsonl per
    trial and its time series, each written when the trial ends. If a run is killed at any point,
    the same call resumes it. The records depend on the plan only, not on the workers.

    Parameters
    ----------
    plan : StudyPlan, path or name
        "paper" is the published study.
    out : path
        Folder of the study.
    workers : int
        Number of processes; 0 runs in this process. A script that uses processes needs
        ``if __name__ == "__main__":``.
    scheduler : str, optional
        Address of a Dask scheduler, instead of local processes; its workers need the package and
        the plan's files.
    progress : callable, optional
        Called with the fraction done and a text.

    Returns
    -------
    StudySummary
        Its `errors` are defects; their trials have no records.

    Raises
    ------
    InputError
        If the plan is invalid, or the folder holds another study or records of other inputs.
    JobError
        If the cluster is lost; the same call resumes the study.

    Examples
    --------
    >>> import tempfile
    >>> from drake_aerial import Condition, StudyPlan, run_study
    >>> from drake_aerial.references.trajectory import HoverTrajectory
    >>> from drake_aerial.study.plan import Flights
    >>> hover = HoverTrajectory(hover_time=1.0)
    >>> contacts = (("middle", ((0.0, 0.0, 0.14),)),)
    >>> held = Condition("held", "box_68x68x28", trajectory=hover, contacts=contacts)
    >>> plan = StudyPlan("small", (held,), (Flights(("held",), ("task",), solutions=1, trials=2),))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     run_study(plan, folder).outcomes
    {'completed': 2}
    """
    plan = plan if isinstance(plan, StudyPlan) else StudyPlan.read(plan)
    with (
        StudyFolder(out).opened_for(plan) as folder,
        open_executor(workers, scheduler) as executor,
    ):
        report = progress or (lambda fraction, what: None)
        return _run(plan, folder, executor, report, {"workers": scheduler or workers})


def _run(
    plan: StudyPlan,
    folder: StudyFolder,
    executor: Executor,
    report: Progress,
    session: dict[str, Any],
) -> StudySummary:
    """Run a study in its folder; `session` is added to timing.json."""
    began = time.perf_counter()
    errors: list[str] = []
    _write_inputs(plan, folder)
    tasks = _plan_trials(plan, _find_contacts(plan, folder, executor, report, errors))
    done = _recorded(folder, tasks, complete=not errors)
    flown = _fly_trials(tasks, done, folder, executor, report, errors)
    sort_records(folder.path, [task.key for task in tasks])
    wall = time.perf_counter() - began
    folder.add_timing({}, {"wall_s": round(wall, 1), "flights": flown, **session})
    records, complaints = read_records(folder.path)
    return StudySummary(
        folder=folder.path,
        planned=len(tasks),
        found=len(done),
        flown=flown,
        outcomes=dict(Counter(record["outcome"] for record in records)),
        errors=tuple(errors),
        complaints=tuple(complaints),
        wall_s=wall,
        cpu_s=sum(record.get("timing", {}).get("cpu_s", 0.0) for record in records),
    )


def _write_inputs(plan: StudyPlan, folder: StudyFolder) -> None:
    """Write the scan and the skill of each condition beside the records."""
    for condition in plan.conditions:
        path = folder.scan_path(condition.name)
        if not path.exists():
            write_scan(path, cached_scan(condition, plan.seed))
        if condition.demonstration is not None:
            path = folder.skill_path(condition.demonstration)
            if not path.exists():
                cached_skill(condition.demonstration).save(path)


def _find_contacts(
    plan: StudyPlan, folder: StudyFolder, executor: Executor, report: Progress, errors: list[str]
) -> _Found:
    """Return contacts, or the transfer's error, by name; from their files or computed now."""
    wanted: dict[str, ContactTask] = {}
    for arm in plan.arms():
        top = arm.solutions + SPARE
        if arm.contacts in wanted:
            top = max(top, wanted[arm.contacts].top)
        wanted[arm.contacts] = ContactTask(arm.condition, arm.method, plan.seed, top)
    missing = [task for name, task in wanted.items() if not folder.contacts_path(name).exists()]
    found: _Found = {}
    times = {}
    for count, (task, result) in enumerate(executor.run(find_contacts, missing), 1):
        report(0.0, f"contacts {count}/{len(missing)}")
        if not isinstance(result, FoundContacts):
            errors.append(f"contacts {task.name}: {type(result).__name__}: {one_line(result)}")
            continue
        times[task.name] = {"wall_s": round(result.wall_s, 3), "cpu_s": round(result.cpu_s, 3)}
        found[task.name] = (None, result.failure)
        if result.contacts is not None:
            result.contacts.write(folder.contacts_path(task.name))
    if times:
        folder.add_timing(times)
    # Read new contacts from their files too, so that a resumed study flies the same numbers.
    for name in wanted:
        if folder.contacts_path(name).exists():
            found[name] = (ContactSolutions.read(folder.contacts_path(name)), None)
    return found


def _plan_trials(plan: StudyPlan, found: _Found) -> list[TrialTask]:
    fingerprints = {condition.name: condition.fingerprint() for condition in plan.conditions}
    return [
        task
        for arm in plan.arms()
        if arm.contacts in found
        for task in plan_trials(
            arm,
            *found[arm.contacts],
            seed=plan.seed,
            fingerprint=fingerprints[arm.condition.name],
            fly_infeasible=plan.fly_infeasible,
        )
    ]


def _recorded(folder: StudyFolder, tasks: list[TrialTask], *, complete: bool) -> set[str]:
    """Return the keys of the records; raise InputError if some belong to no task."""
    done = {record["key"] for record in read_records(folder.path)[0]}
    foreign = done - {task.key for task in tasks}
    if foreign and complete:
        raise InputError(
            f"{folder.path} holds {len(foreign)} records of another study, such as "
            f"{min(foreign)}: a payload, a demonstration or the contacts changed; "
            "give another folder (--out)"
        )
    return done


def _fly_trials(
    tasks: list[TrialTask],
    done: set[str],
    folder: StudyFolder,
    executor: Executor,
    report: Progress,
    errors: list[str],
) -> int:
    """Fly the trials without a record, write their records, and return their number."""
    waiting = [task for task in tasks if task.key not in done]
    clock = _ProgressClock(tasks, waiting, report)
    flown = 0
    for task, result in executor.run(fly_trial, waiting):
        if isinstance(result, FlownTrial):
            folder.append(result.record, result.series)
            flown += 1
        else:
            errors.append(f"{task.name}: {type(result).__name__}: {one_line(result)}")
        clock.advance(task)
    return flown


class _ProgressClock:
    """Reports progress and the time left, from the rate so far and the cost of each trial."""

    def __init__(self, tasks: list[TrialTask], waiting: list[TrialTask], report: Progress):
        flights = [task for task in tasks if task.cost > 0.0]
        self._count = len(flights)
        self._whole = sum(task.cost for task in flights)
        self._left = sum(task.cost for task in waiting)
        self._flown = self._count - sum(task.cost > 0.0 for task in waiting)
        self._spent = 0.0
        self._report = report
        self._began = time.perf_counter()
        self._tell()

    def advance(self, task: TrialTask) -> None:
        """Count a trial that has ended."""
        self._left -= task.cost
        self._spent += task.cost
        self._flown += task.cost > 0.0
        self._tell()

    def _tell(self) -> None:
        what = f"flight {self._flown}/{self._count}"
        if self._spent > 0.0:
            seconds = self._left * (time.perf_counter() - self._began) / self._spent
            what += f", {seconds / 60:.0f} min left" if seconds >= 90 else f", {seconds:.0f} s left"
        self._report(1.0 - self._left / self._whole if self._whole else 1.0, what)
