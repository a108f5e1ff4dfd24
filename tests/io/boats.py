"""Records with every kind of field, which nothing in the package defines."""

from __future__ import annotations

from dataclasses import field
from typing import Annotated, ClassVar, Literal

from annotated_types import Lt

from drake_aerial.errors import InputError
from drake_aerial.io.records import (
    Count,
    Flag,
    Name,
    NonNegative,
    Number,
    OneOrMany,
    Positive,
    PositiveOrInfinite,
    Vector,
    Whole,
    record,
)


@record(frozen=True)
class Sail:
    """A sail."""

    area: Positive = 12.0
    """Area of the cloth [m^2]."""
    sheets: Count = 2
    """Number of sheets."""
    reefs: Whole = 0
    """Number of reefs."""


@record(frozen=True)
class Motor:
    """A motor without defaults."""

    power: NonNegative
    """Power [W]."""
    fuel: str
    """Name of the fuel."""


@record(frozen=True)
class Boat:
    """A boat, with a summary
    of two lines.

    And a paragraph that no file repeats.
    """

    kind: Literal["sloop", "yawl"] = "sloop"
    """Type of the rig."""
    length: Annotated[Positive, Lt(100)] = 7.5
    """Length over all [m]."""
    endurance: PositiveOrInfinite = float("inf")
    """Endurance [h]."""
    hull: Vector = (1e-9, 2.0, -3e20)
    """Three numbers."""
    depths: tuple[Count, ...] = (1, 2)
    """Any number of whole numbers."""
    name: str = "yes"
    """A text that YAML reads as a truth value."""
    sign: Name = "GER 1"
    """A text that may be given as a number."""
    wooden: Flag = False
    """None of it is steel."""
    sail: OneOrMany[Sail] = field(default_factory=Sail)
    """One sail or several."""
    spare: Sail | None = None
    """None for none."""
    motor: Motor | None = None
    """None for none."""
    draught: Number | None = None
    """Draught [m]."""

    def __post_init__(self) -> None:
        if self.draught is not None and self.draught > self.length:
            raise InputError(f"`draught` must be < length = {self.length} m, got {self.draught}")


@record(frozen=True)
class Raft:
    """A raft."""

    kind: Literal["raft"] = "raft"
    """Rafts are of one kind."""
    RETIRED: ClassVar = ("oars",)
    logs: Count = 9
    """Number of logs."""
