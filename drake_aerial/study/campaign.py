"""Run a study: contacts first, then every trial that has no record yet."""

from __future__ import annotations

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
from drake_aerial.study.plan import StudyPlan
from drake_aerial.study.records import StudyFolder, read_records
from drake_aerial.study.scans import write_scan
from drake_aerial.study.trials import FlownTrial, TrialTask, fly_trial, plan_trials
from drake_aerial.study.workers import Workers, hired

Progress = Callable[[float, str], None]
_Found = dict[str, tuple[ContactSolutions | None, str | None]]


@dataclass(frozen=True)
class StudySummary:
    """What a campaign did.

    Attributes
    ----------
    folder : Path
    planned, found, flown : int
        Records that the plan makes, that were there already, and that were added.
    outcomes : dict
        Number of records by outcome.
    errors : tuple of str
        One line for every trial or transfer that failed for another reason than its physics; it has no record.
    complaints : tuple of str
        One line for every damaged line of the records.
    wall_s, cpu_s : float
        Of this campaign, and of all its flights [s].
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
    """Run a study, or what is left of one that was interrupted.

    Everything is kept in `out`: study.yaml (the plan), contacts, scans, skills, and one line of records.jsonl and a file of
    series for every trial, written as it ends. Whoever is killed when, the same call goes on where it stopped; the records
    depend on the plan alone, not on the workers.

    Parameters
    ----------
    plan : StudyPlan, path or name
        "paper" is the published study.
    out : path
        A folder.
    workers : int
        0: in this process; otherwise so many processes. A script that asks for processes needs the usual
        ``if __name__ == "__main__":``.
    scheduler : str, optional
        Address of a Dask scheduler, instead of local processes; its workers need the package and the plan's files.
    progress : callable, optional
        Called with the fraction done and how much is left.

    Returns
    -------
    StudySummary
        Its `errors` are to be looked at: they are defects, and their trials have no records.

    Raises
    ------
    InputError
        For a bad plan, or a folder that holds another study or records that this one does not make.
    JobError
        If the cluster is lost; the same call goes on.

    Examples
    --------
    >>> import tempfile
    >>> from drake_aerial import Condition, StudyPlan, run_study
    >>> from drake_aerial.references.trajectory import HoverTrajectory
    >>> from drake_aerial.study.plan import Flights
    >>> middle = ("middle", ((0.0, 0.0, 0.14),))
    >>> held = Condition("held", "box_68x68x28", trajectory=HoverTrajectory(hover_time=1.0), contacts=(middle,))
    >>> plan = StudyPlan("small", (held,), (Flights(("held",), ("task",), solutions=1, trials=2),))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     run_study(plan, folder).outcomes
    {'completed': 2}
    """
    plan = plan if isinstance(plan, StudyPlan) else StudyPlan.read(plan)
    report = progress or (lambda fraction, what: None)
    began = time.perf_counter()
    with StudyFolder.opened(out, plan) as folder, hired(workers, scheduler) as staff:
        errors: list[str] = []
        _write_inputs(plan, folder)
        found = _contacts(plan, folder, staff, report, errors)
        tasks = _trials(plan, found)
        records, complaints = read_records(folder.path)
        done = {record["key"] for record in records}
        foreign = done - {task.key for task in tasks}
        if foreign and not errors:
            raise InputError(
                f"{folder.path} holds {len(foreign)} records that this study does not make, such as {min(foreign)}: "
                "a payload, a demonstration or the contacts changed; give another folder (--out)"
            )
        waiting = [task for task in tasks if task.key not in done]
        clock = _Clock(tasks, waiting, report)
        flown = 0
        for task, result in staff.run(fly_trial, waiting):
            if isinstance(result, FlownTrial):
                folder.append(result)
                flown += 1
            else:
                errors.append(f"{task.name}: {type(result).__name__}: {one_line(result)}")
            clock.passed(task)
        folder.sort([task.key for task in tasks])
        wall = time.perf_counter() - began
        folder.note_timing(
            {}, {"wall_s": round(wall, 1), "flights": flown, "workers": scheduler or workers}
        )
        records, complaints = read_records(folder.path)
    return StudySummary(
        folder=Path(out),
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
    """Leave what the methods were shown beside the records: scans and skills."""
    for condition in plan.conditions:
        path = folder.path / "scans" / f"{condition.name}.npz"
        if not path.exists():
            write_scan(path, cached_scan(condition, plan.seed))
        if condition.demonstration is not None:
            path = folder.path / "skills" / f"{Path(condition.demonstration).stem}.npz"
            if not path.exists():
                cached_skill(condition.demonstration).save(path)


def _contacts(
    plan: StudyPlan, folder: StudyFolder, staff: Workers, report: Progress, errors: list[str]
) -> _Found:
    """Return the contacts by name, from their files or found now, with the reason where there are none."""
    wanted: dict[str, ContactTask] = {}
    for arm in plan.arms():
        top = arm.solutions + SPARE
        if arm.contacts in wanted:
            top = max(top, wanted[arm.contacts].top)
        wanted[arm.contacts] = ContactTask(arm.condition, arm.method, plan.seed, top)
    paths = {name: folder.path / "contacts" / f"{name}.json" for name in wanted}
    missing = [task for name, task in wanted.items() if not paths[name].exists()]
    found: _Found = {}
    times: dict[str, dict[str, float]] = {}
    for count, (task, result) in enumerate(staff.run(find_contacts, missing)):
        report(0.0, f"contacts {count + 1}/{len(missing)}")
        if not isinstance(result, FoundContacts):
            errors.append(f"contacts {task.name}: {type(result).__name__}: {one_line(result)}")
            continue
        times[task.name] = {"wall_s": round(result.wall_s, 3), "cpu_s": round(result.cpu_s, 3)}
        found[task.name] = (None, result.failure)
        if result.contacts is not None:
            result.contacts.write(paths[task.name])
    if times:
        folder.note_timing(times)
    # Read back even if just found, so that a campaign that goes on flies the very same numbers.
    for name, path in paths.items():
        if path.exists():
            found[name] = (ContactSolutions.read(path), None)
    return found


def _trials(plan: StudyPlan, found: _Found) -> list[TrialTask]:
    fingerprints = {condition.name: condition.fingerprint() for condition in plan.conditions}
    tasks: list[TrialTask] = []
    for arm in plan.arms():
        if arm.contacts in found:
            contacts, failure = found[arm.contacts]
            tasks += plan_trials(
                arm,
                contacts,
                failure,
                seed=plan.seed,
                fingerprint=fingerprints[arm.condition.name],
                fly_infeasible=plan.fly_infeasible,
            )
    return tasks


class _Clock:
    """Says how much is done and how long the rest will take, at the rate so far, every trial weighed by what it costs."""

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

    def passed(self, task: TrialTask) -> None:
        """Take note that a trial has ended."""
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
