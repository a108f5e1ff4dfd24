"""Records of every kind of field, which nothing of the package defines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from drake_aerial.errors import InputError
from drake_aerial.io.typed_yaml.record_fields import Unbounded


class Sail(NamedTuple):
    """A sail.

    Attributes
    ----------
    area : float
        Of the cloth [m^2].
    sheets, reefs : int
        How many.
    """

    area: float = 12.0
    sheets: int = 2
    reefs: int = 0


@dataclass(frozen=True)
class Motor:
    """A motor; all of it must be said."""

    power: float
    """[W]"""
    fuel: str
    """What it burns."""


@dataclass(frozen=True)
class Boat:
    """A boat, with a summary
    of two lines.

    And more of it, which no file repeats.
    """

    kind: Literal["sloop", "yawl"] = "sloop"
    """How it is rigged."""
    length: float = 7.5
    """Over all [m]."""
    endurance: Unbounded = float("inf")
    """[h]"""
    hull: tuple[float, float, float] = (1e-9, 2.0, -3e20)
    """Three numbers."""
    depths: tuple[int, ...] = (1, 2)
    """As many as there are."""
    name: str = "yes"
    """A text that YAML would take for something else."""
    wooden: bool = False
    """Whether None of it is steel."""
    sail: Sail | Sequence[Sail] = field(default_factory=Sail)
    """One, or several."""
    spare: Sail | None = None
    """None for none."""
    motor: Motor | None = None
    """None for none."""

    def __post_init__(self) -> None:
        if not self.length > 0.0:
            raise InputError(f"the boat's length is {self.length!r} m; a positive number accepted")


@dataclass(frozen=True)
class Raft:
    """A raft."""

    kind: Literal["raft"] = "raft"
    """Rafts are of one kind."""
    logs: int = 9
    """How many."""
