"""The plan of a study: conditions, and the flights on them by method, belief and inertia."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any

from annotated_types import Ge, Len
from pydantic import BeforeValidator

from drake_aerial._version import __version__
from drake_aerial.choices import METHODS, Belief, Method
from drake_aerial.errors import InputError
from drake_aerial.io import model_files
from drake_aerial.io.records import Count, Flag, Name, Whole, record, record_from_mapping
from drake_aerial.io.strict_yaml import check_keys, nearest, read_mapping
from drake_aerial.study.conditions import NOT_SHARED, Condition, Inertia

_LISTS = ("conditions", "methods", "beliefs", "inertias")
# YAML reads the belief `true` as a truth value.
BeliefName = Annotated[Belief, BeforeValidator(lambda given: "true" if given is True else given)]


@record(frozen=True)
class Flights:
    """Part of a plan: every combination of conditions, methods, beliefs and inertias."""

    conditions: Annotated[tuple[Name, ...], Len(1)]
    """Names of conditions."""
    methods: tuple[Method, ...] = ()
    """Methods of transfer; a condition with given contacts has its labels instead, which are all
    flown."""
    beliefs: Annotated[tuple[BeliefName, ...], Len(1)] = ("below_contact",)
    """Beliefs of the controller."""
    inertias: Annotated[tuple[Inertia, ...], Len(1)] = ("table",)
    """Inertias of the payload: table, mesh or file."""
    solutions: Count = 5
    """Number of the best solutions that are flown."""
    trials: Count = 10
    """Flights of each solution."""

    def __post_init__(self) -> None:
        for key in _LISTS:
            _no_doubles(getattr(self, key), f"`{key}`")

    def to_dict(self) -> dict[str, Any]:
        """Return the part as a mapping of plain values."""
        lists = {key: list(getattr(self, key)) for key in _LISTS}
        return {**lists, "solutions": self.solutions, "trials": self.trials}


@dataclass(frozen=True)
class Arm:
    """Flights of one method on one condition, under one belief, with one inertia."""

    condition: Condition
    method: str
    belief: Belief
    inertia: str
    solutions: int
    trials: int

    @property
    def contacts(self) -> str:
        """Name of the arm's contacts; arms that differ in belief or inertia share them."""
        return f"{self.condition.name}-{self.method}"


@record(frozen=True)
class StudyPlan:
    """A study: the same plan and version give the same records.

    Examples
    --------
    >>> from drake_aerial import StudyPlan
    >>> plan = StudyPlan.read("paper")
    >>> [condition.name for condition in plan.conditions]
    ['A', 'A_full', 'B', 'B_centroid', 'C', 'D', 'E', 'F', 'G', 'H']
    """

    name: Name
    """Name of the study; the file's name by default in a file."""
    conditions: tuple[Condition, ...]
    """Conditions in the report's order."""
    flights: Annotated[tuple[Flights, ...], Len(1)]
    """What is flown how often."""
    description: Name = ""
    """Description in the report."""
    seed: Annotated[Whole, Ge(0)] = 0
    """Master seed, from which all others derive."""
    fly_infeasible: Flag = False
    """True to fly solutions that are marked infeasible too, if the simulation can start."""

    @classmethod
    def read(cls, name_or_path: str | Path) -> StudyPlan:
        """Return the plan of a YAML file, or a shipped one by its name ("paper").

        The file has `conditions` (a list; keys as in `Condition`), `flights` (a list; keys as in
        `Flights`) and, optionally, `name`, `description`, `seed`, `fly_infeasible` and `defaults`
        (keys that all conditions share). The study.yaml of a study is such a file.

        Raises
        ------
        InputError
            For a missing file, an unknown key or name (the nearest known one is named), or a value
            outside its range.
        """
        path = model_files.find("studies", name_or_path)
        values = {"name": path.stem, **read_mapping(path)}
        values.pop("package_version", None)
        shared = values.pop("defaults", None) or {}
        known = [f.name for f in fields(Condition) if f.name not in NOT_SHARED]
        check_keys(shared, optional=known, where=f"{path}: `defaults`: ")
        if isinstance(values.get("conditions"), list):
            values["conditions"] = [_with_shared(entry, shared) for entry in values["conditions"]]
        return record_from_mapping(cls, values, str(path), path.parent)

    def __post_init__(self) -> None:
        names = tuple(condition.name for condition in self.conditions)
        _no_doubles(names, "`conditions`")
        stems: dict[str, str] = {}
        for condition in self.conditions:
            if condition.demonstration is not None:
                stem = Path(condition.demonstration).stem
                if stems.setdefault(stem, condition.demonstration) != condition.demonstration:
                    raise InputError(
                        f"demonstrations must have different names, got {stem!r} twice: "
                        f"{stems[stem]}, {condition.demonstration}"
                    )
        transferred = {condition.name for condition in self.conditions if not condition.contacts}
        for part in self.flights:
            for name in part.conditions:
                if name not in names:
                    raise InputError(
                        f"`flights`: conditions must be among {', '.join(names)}, "
                        f"got {name!r}{nearest(name, names)}"
                    )
            if not part.methods and transferred & {*part.conditions}:
                raise InputError(
                    f"`flights`: methods must be one or more of {', '.join(METHODS)}, got none"
                )

    def to_dict(self) -> dict[str, Any]:
        """Return the plan as the mapping that is written to study.yaml."""
        return {
            "name": self.name,
            "description": self.description,
            "package_version": __version__,
            "seed": self.seed,
            "fly_infeasible": self.fly_infeasible,
            "conditions": [condition.to_dict() for condition in self.conditions],
            "flights": [part.to_dict() for part in self.flights],
        }

    def chosen(
        self,
        *,
        conditions: Iterable[str] | None = None,
        methods: Iterable[str] | None = None,
        beliefs: Iterable[str] | None = None,
        solutions: int | None = None,
        trials: int | None = None,
        seed: int | None = None,
        fly_infeasible: bool | None = None,
    ) -> StudyPlan:
        """Return a part of the plan, or the plan with other numbers; None changes nothing.

        Parameters
        ----------
        conditions, methods, beliefs : names, optional
            Names to keep, of those in the plan. Conditions with given contacts have no methods.
        solutions, trials : int, optional
            Replace every number in the plan.
        seed : int, optional
            Master seed.
        fly_infeasible : bool, optional
            Fly infeasible solutions too.

        Raises
        ------
        InputError
            If the plan does not have a name, or no flights are left.
        """
        given = {c.name for c in self.conditions if c.contacts}
        kept = _kept(conditions, [c.name for c in self.conditions], "conditions", self.name)
        methods_kept = _kept(
            methods, _unique(m for part in self.flights for m in part.methods), "methods", self.name
        )
        beliefs_kept = _kept(
            beliefs, _unique(b for part in self.flights for b in part.beliefs), "beliefs", self.name
        )
        parts: list[Flights] = []
        for part in self.flights:
            wanted = tuple(m for m in part.methods if m in methods_kept)
            named = tuple(c for c in part.conditions if c in kept and (c in given or wanted))
            believed = tuple(b for b in part.beliefs if b in beliefs_kept)
            if named and believed:
                parts.append(
                    replace(
                        part,
                        conditions=named,
                        methods=wanted,
                        beliefs=believed,
                        solutions=part.solutions if solutions is None else solutions,
                        trials=part.trials if trials is None else trials,
                    )
                )
        if not parts:
            raise InputError(
                f"the plan {self.name!r} has no flights with all of these conditions, methods and "
                "beliefs; choose fewer"
            )
        flown = {name for part in parts for name in part.conditions}
        return replace(
            self,
            conditions=tuple(c for c in self.conditions if c.name in flown),
            flights=tuple(parts),
            seed=self.seed if seed is None else seed,
            fly_infeasible=self.fly_infeasible if fly_infeasible is None else fly_infeasible,
        )

    def arms(self) -> list[Arm]:
        """Return the arms, by condition; an arm of two parts has the larger of their numbers."""
        found: dict[tuple[str, str, str, str], Arm] = {}
        for condition in self.conditions:
            for part in self.flights:
                if condition.name not in part.conditions:
                    continue
                for inertia in part.inertias:
                    for belief in part.beliefs:
                        for method in condition.labels or part.methods:
                            key = (condition.name, method, belief, inertia)
                            arm = Arm(
                                condition, method, belief, inertia, part.solutions, part.trials
                            )
                            if key in found:
                                old = found[key]
                                arm = replace(
                                    arm,
                                    solutions=max(arm.solutions, old.solutions),
                                    trials=max(arm.trials, old.trials),
                                )
                            found[key] = arm
        return list(found.values())

    @property
    def count(self) -> int:
        """Largest number of flights; `centroid` and given contacts have one solution."""
        return sum(
            (1 if arm.condition.contacts or arm.method == "centroid" else arm.solutions)
            * arm.trials
            for arm in self.arms()
        )


def _with_shared(entry: Any, shared: dict[str, Any]) -> Any:
    """Return the entry of a condition, with the plan's `defaults` for the keys that it lacks."""
    if not isinstance(entry, dict):
        return entry
    # A condition with contacts needs no demonstration.
    own = {k: v for k, v in shared.items() if k != "demonstration" or "contacts" not in entry}
    return {"title": entry.get("name", ""), **own, **entry}


def _no_doubles(names: Sequence[str], what: str) -> None:
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{what} must be different, got {name!r} twice")


def _unique(names: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(names))


def _kept(wanted: Iterable[str] | None, known: list[str], what: str, plan: str) -> list[str]:
    if wanted is None:
        return known
    wanted = list(wanted)
    for name in wanted:
        if name not in known:
            near = nearest(name, known)
            raise InputError(
                f"{what} must be among those of the plan {plan!r}, {', '.join(known) or 'none'}; "
                f"got {name!r}{near}"
            )
    return wanted
