"""The tasks of a study's trials: which solutions are flown, how often, under which key."""

import hashlib
import json
from dataclasses import dataclass, replace

from drake_aerial._version import __version__
from drake_aerial.choices import Belief
from drake_aerial.contacts.solutions import ContactSolutions, Solution
from drake_aerial.study.conditions import Condition
from drake_aerial.study.contacts import place
from drake_aerial.study.plan import Arm


@dataclass(frozen=True, eq=False)
class TrialTask:
    """The input of `fly_trial`.

    Attributes
    ----------
    key : str
        Hash of everything that the trial's result depends on.
    condition : Condition
    method, belief, inertia : str
    contacts : ContactSolutions or None
        With the one solution of the trial, as transferred.
    solution : int or None
        Its rank among the flown solutions; None if it is not flown.
    rank : int or None
        Its rank among the contacts; None if there are none.
    trial : int
        From 0.
    seed : int
        Master seed of the plan.
    obstacles : tuple of str
        Reasons why it is not flown.
    version : str
        Package version of the sender.
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
        """Name in messages."""
        return (
            f"{self.condition.name} {self.method} {self.belief} {self.inertia} "
            f"solution {self.rank} trial {self.trial}"
        )

    @property
    def group(self) -> str:
        """Name that tells which trials can be flown with one diagram."""
        return f"{self.condition.name}-{self.method}-{self.belief}-{self.inertia}-{self.rank}"

    @property
    def cost(self) -> float:
        """Relative computing time: simulated seconds, more for each further quadrotor."""
        if self.solution is None or self.contacts is None:
            return 0.0
        return self.condition.trajectory.duration * (0.7 + 0.3 * len(self.contacts[0].X_SG.p))


def plan_trials(
    arm: Arm,
    contacts: ContactSolutions | None,
    failure: str | None,
    *,
    seed: int,
    fingerprint: str,
    fly_infeasible: bool,
) -> list[TrialTask]:
    """Return the trials of an arm.

    The best feasible solutions have the arm's number of trials each. A better solution that is not
    flown has one task, so that it gets a record.

    Parameters
    ----------
    arm : Arm
    contacts : ContactSolutions or None
        Result of the transfer.
    failure : str or None
        Error of the transfer, if there are no contacts.
    seed : int
        Master seed of the plan.
    fingerprint : str
        Hash of the condition's files.
    fly_infeasible : bool
        Fly infeasible solutions too.
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
        return TrialTask(
            key=hashlib.sha256(json.dumps(own, sort_keys=True).encode()).hexdigest()[:24],
            condition=arm.condition,
            method=arm.method,
            belief=arm.belief,
            inertia=arm.inertia,
            contacts=None
            if contacts is None or found is None
            else replace(contacts, solutions=(found,)),
            solution=solution,
            rank=rank,
            trial=trial,
            seed=seed,
            obstacles=obstacles,
        )

    if contacts is None:
        return [task(None, None, 0, (failure or "no contacts were found",))]
    payload = arm.condition.payload_with(arm.inertia)
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
