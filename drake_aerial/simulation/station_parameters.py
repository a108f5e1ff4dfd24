"""Everything about a station but the payload, the contacts and the controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.gripper import GripperParameters
from drake_aerial.plant.quadrotor import QuadrotorParameters
from drake_aerial.plant.wind import WindParameters
from drake_aerial.plant.world import ELASTIC_TIME_STEP, TIME_STEP

Part = TypeVar("Part", QuadrotorParameters, CableParameters, GripperParameters)


@dataclass(frozen=True)
class StationParameters:
    """The team and its sensors.

    Quadrotors, cables and grippers are each given once, for a team of equals, or as a sequence with one entry per contact.

    Examples
    --------
    >>> from drake_aerial import StationParameters
    >>> from drake_aerial.plant.cable import CableParameters
    >>> unequal = StationParameters(cable=[CableParameters(length=0.5), CableParameters(length=0.8)])
    >>> unequal.cable_lengths(2).tolist()
    [0.5, 0.8]
    """

    quadrotor: QuadrotorParameters | Sequence[QuadrotorParameters] = field(
        default_factory=QuadrotorParameters
    )
    """Of each quadrotor."""
    cable: CableParameters | Sequence[CableParameters] = field(default_factory=CableParameters)
    """Of each cable; all of one kind."""
    gripper: GripperParameters | Sequence[GripperParameters] = field(
        default_factory=GripperParameters
    )
    """Of each gripper."""
    time_step: float | None = None
    """Of the plant [s]; none for 0.005 with inextensible cables and 0.002 with elastic ones, whose springs are stiff."""
    perception_period: float = 0.02
    """[s]"""
    noise: float = 0.01
    """Standard deviation of the payload's measured position, per coordinate [m]."""
    measured_directions: bool = True
    """Whether cable directions are measured on their own, or inferred from the noisy payload position."""
    attitude_period: float = 0.0
    """How long propeller commands of the attitude loop are held [s]; 0 for new ones at every step of the plant."""
    initial_slack: float = 0.05
    """How much closer to its contact than its cable's length a quadrotor starts [m]."""
    airborne_height: float = 1.0
    """How high a payload starts that does not start on the ground [m]."""
    wind: WindParameters | None = None
    """Of the air; None for no air at all."""
    motor_lag: float = 0.0
    """Time constant with which propeller speeds follow their commands [s]; 0 for none."""
    motor_lead: bool = True
    """Whether the commands lead by what the motors lag, where they do (`MotorLead`). Without it the MPC with the table's attitude gains
    carries the table's box up to some 35 ms of lag, and loses it beyond."""

    def __post_init__(self) -> None:
        for name, value in (
            ("time_step", self.step),
            ("perception_period", self.perception_period),
        ):
            if not (np.isfinite(value) and value > 0.0):
                raise InputError(f"the station's {name} is {value!r} s; a positive number accepted")
        for name in ("noise", "attitude_period", "initial_slack", "airborne_height", "motor_lag"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0.0):
                raise InputError(f"the station's {name} is {value!r}; 0 or more accepted")

    @property
    def step(self) -> float:
        """The plant's time step [s]."""
        if self.time_step is not None:
            return self.time_step
        first = (
            self.cable
            if isinstance(self.cable, CableParameters)
            else next(iter(self.cable), CableParameters())
        )
        return ELASTIC_TIME_STEP if first.kind == "elastic" else TIME_STEP

    def quadrotors(self, n: int) -> tuple[QuadrotorParameters, ...]:
        """Return the parameters of n quadrotors. Raises InputError if another number is given."""
        return each(self.quadrotor, n, "quadrotors")

    def cables(self, n: int) -> tuple[CableParameters, ...]:
        """Return the parameters of n cables. Raises InputError if another number is given."""
        return each(self.cable, n, "cables")

    def grippers(self, n: int) -> tuple[GripperParameters, ...]:
        """Return the parameters of n grippers. Raises InputError if another number is given."""
        return each(self.gripper, n, "grippers")

    def cable_lengths(self, n: int) -> Array:
        """Return the lengths (n,) of n cables [m]."""
        return np.array([cable.length for cable in self.cables(n)])

    def with_cable_kind(self, kind: str) -> StationParameters:
        """Return the same team with all cables of another kind, their lengths kept."""
        if isinstance(self.cable, CableParameters):
            return replace(self, cable=replace(self.cable, kind=kind))
        return replace(self, cable=tuple(replace(cable, kind=kind) for cable in self.cable))


def each(given: Part | Sequence[Part], n: int, what: str) -> tuple[Part, ...]:
    """Return n parameter sets, of one for all or of a sequence of n.

    Parameters
    ----------
    given : parameters, or a sequence of n of them
    n : int
    what : str
        The plural, for the error.

    Raises
    ------
    InputError
        If a sequence has another length.
    """
    if not isinstance(given, Sequence):
        return (given,) * n
    if len(given) != n:
        raise InputError(
            f"parameters of {len(given)} {what} for {n} contact(s); one for all or {n} accepted"
        )
    return tuple(given)
