"""The plan of a study: its conditions, and which methods, beliefs and inertias are flown on them how often."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from drake_aerial._version import __version__
from drake_aerial.choices import BELIEFS, METHODS
from drake_aerial.errors import InputError
from drake_aerial.io import model_files
from drake_aerial.io.strict_yaml import check_keys, nearest, number, read_mapping, shown
from drake_aerial.study.conditions import DEFAULTABLE, INERTIAS, Condition

_LISTS = ("conditions", "methods", "beliefs", "inertias")


@dataclass(frozen=True)
class Flights:
    """Part of a plan: every combination of the named conditions, methods, beliefs and inertias, flown equally often.

    Attributes
    ----------
    conditions, methods, beliefs, inertias : tuple of str
        Methods mean nothing to a condition whose contacts are given: all of its labels are flown.
    solutions, trials : int
        The best so many solutions, each so many times.
    """

    conditions: tuple[str, ...]
    methods: tuple[str, ...]
    beliefs: tuple[str, ...] = ("below_contact",)
    inertias: tuple[str, ...] = ("table",)
    solutions: int = 5
    trials: int = 10

    def to_dict(self) -> dict[str, Any]:
        """Return the part as a mapping of plain values."""
        lists = {key: list(getattr(self, key)) for key in _LISTS}
        return {**lists, "solutions": self.solutions, "trials": self.trials}


@dataclass(frozen=True)
class Arm:
    """One arm of a study: the best solutions of one method on one condition, flown under one belief with one inertia."""

    condition: Condition
    method: str
    belief: str
    inertia: str
    solutions: int
    trials: int

    @property
    def contacts(self) -> str:
        """Name of the contacts that the arm flies; arms that differ in belief or inertia share them."""
        return f"{self.condition.name}-{self.method}"


@dataclass(frozen=True)
class StudyPlan:
    """A study, in full: the same plan and version give the same records.

    Attributes
    ----------
    name, description : str
    seed : int
        All others derive from it.
    conditions : tuple of Condition
        In the report's order.
    flights : tuple of Flights
    fly_infeasible : bool
        Whether solutions with reasons against them are flown too, where they can be.

    Examples
    --------
    >>> from drake_aerial import StudyPlan
    >>> plan = StudyPlan.read("paper")
    >>> [condition.name for condition in plan.conditions]
    ['A', 'A_full', 'B', 'B_centroid', 'C', 'D', 'E', 'F', 'G', 'H']
    """

    name: str
    conditions: tuple[Condition, ...]
    flights: tuple[Flights, ...]
    description: str = ""
    seed: int = 0
    fly_infeasible: bool = False

    @classmethod
    def read(cls, name_or_path: str | Path) -> StudyPlan:
        """Return the plan of a YAML file, or a shipped one by its name ("paper").

        The file has `conditions` (a list; keys as in `Condition`), `flights` (a list; keys as in `Flights`) and, optionally,
        `name`, `description`, `seed`, `fly_infeasible` and `defaults` (keys that all conditions share). A study.yaml that a study
        left is such a file.

        Raises
        ------
        InputError
            For a missing file, an unknown key or name (the nearest known one is named), or an impossible value.
        """
        path = model_files.find("studies", name_or_path)
        values = read_mapping(path)
        optional = ("name", "description", "seed", "fly_infeasible", "defaults", "package_version")
        check_keys(values, str(path), required=("conditions", "flights"), optional=optional)
        defaults = values.get("defaults") or {}
        check_keys(defaults, f"{path}: defaults", optional=DEFAULTABLE)
        conditions = []
        for entry in _entries(values["conditions"], f"{path}: conditions"):
            # What is given once for all does not ask a condition with contacts of its own for a demonstration.
            own = {
                k: v for k, v in defaults.items() if k != "demonstration" or "contacts" not in entry
            }
            conditions.append(
                Condition.from_dict({**own, **entry}, f"{path}: condition", path.parent)
            )
        flights = [
            _flights(entry, f"{path}: flights {k + 1}", conditions)
            for k, entry in enumerate(_entries(values["flights"], f"{path}: flights"))
        ]
        seed = int(number(values.get("seed", 0), f"{path}: seed"))
        infeasible = values.get("fly_infeasible", False)
        if not isinstance(infeasible, bool):
            raise InputError(
                f"{path}: fly_infeasible is {shown(infeasible)}; true or false accepted"
            )
        return cls(
            name=str(values.get("name", path.stem)),
            conditions=tuple(conditions),
            flights=tuple(flights),
            description=str(values.get("description", "")),
            seed=seed,
            fly_infeasible=infeasible,
        )

    def __post_init__(self) -> None:
        _no_doubles([c.name for c in self.conditions], "conditions")
        stems: dict[str, str] = {}
        for condition in self.conditions:
            if condition.demonstration is not None:
                stem = Path(condition.demonstration).stem
                if stems.setdefault(stem, condition.demonstration) != condition.demonstration:
                    raise InputError(
                        f"two demonstrations are called {stem!r}: {stems[stem]}, {condition.demonstration}"
                    )
        if self.seed < 0:
            raise InputError(f"the study's seed is {self.seed}; a whole number from 0 is accepted")
        if not self.flights:
            raise InputError("the study flies nothing: at least one entry of flights is needed")

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

    def condition(self, name: str) -> Condition:
        """Return the condition of that name."""
        return next(condition for condition in self.conditions if condition.name == name)

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
        """Return a part of the plan, or the plan with other numbers; None leaves things as they are.

        Parameters
        ----------
        conditions, methods, beliefs : names, optional
            The ones to keep, of those that the plan has. Methods do not touch conditions whose contacts are given.
        solutions, trials : int, optional
            Instead of every number in the plan.
        seed : int, optional
        fly_infeasible : bool, optional

        Raises
        ------
        InputError
            For a name that the plan does not have, or if nothing is left.
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
            part = replace(
                part,
                conditions=tuple(
                    c for c in part.conditions if c in kept and (c in given or wanted)
                ),
                methods=wanted,
                beliefs=tuple(b for b in part.beliefs if b in beliefs_kept),
                solutions=part.solutions if solutions is None else solutions,
                trials=part.trials if trials is None else trials,
            )
            if part.conditions and part.beliefs:
                parts.append(part)
        if not parts:
            raise InputError(
                f"nothing is left of the plan {self.name!r}: it has no flights with all of these together"
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
        """Return what is flown, condition by condition; what two parts of the plan share is flown once, as often as the larger one asks."""
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
        """Largest number of flights that the plan asks for; `centroid` and given contacts have one solution."""
        return sum(
            (1 if arm.condition.contacts or arm.method == "centroid" else arm.solutions)
            * arm.trials
            for arm in self.arms()
        )


def _flights(values: Any, where: str, conditions: list[Condition]) -> Flights:
    check_keys(
        values, where, required=("conditions",), optional=(*_LISTS[1:], "solutions", "trials")
    )
    accepted = {
        "conditions": tuple(c.name for c in conditions),
        "methods": tuple(METHODS),
        "beliefs": BELIEFS,
        "inertias": INERTIAS,
    }
    transferred = [c.name for c in conditions if not c.contacts]
    given: dict[str, Any] = {"methods": ()}
    for key in _LISTS:
        if key not in values:
            continue
        names = values[key]
        if not isinstance(names, list) or (not names and key != "methods"):
            raise InputError(f"{where}: {key} should be a list of names, got {shown(names)}")
        # YAML takes the belief `true` for a truth value.
        names = ["true" if name is True else str(name) for name in names]
        for name in names:
            if name not in accepted[key]:
                near = nearest(name, accepted[key])
                raise InputError(
                    f"{where}: {key} has {name!r}{near}; accepted: {', '.join(accepted[key])}"
                )
        given[key] = tuple(names)
        _no_doubles(list(given[key]), f"{where}: {key}")
    for key in ("solutions", "trials"):
        if key in values:
            count = number(values[key], f"{where}: {key}")
            if count != int(count) or count < 1:
                raise InputError(
                    f"{where}: {key} is {shown(values[key])}; a whole number from 1 is accepted"
                )
            given[key] = int(count)
    if not given["methods"] and any(name in transferred for name in given["conditions"]):
        raise InputError(f"{where}: methods are missing; accepted: {', '.join(METHODS)}")
    return Flights(**given)


def _entries(value: Any, where: str) -> list[dict[str, Any]]:
    if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
        raise InputError(f"{where} should be a list of mappings, got {shown(value)}")
    return value


def _no_doubles(names: list[str], what: str) -> None:
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{what} has {name!r} twice")


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
                f"the plan {plan!r} has no {what} {name!r}{near}; it has {', '.join(known) or 'none'}"
            )
    return wanted
