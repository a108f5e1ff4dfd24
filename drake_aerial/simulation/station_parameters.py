"""Parameters of a station, apart from payload, contacts and controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from typing import Annotated, TypeVar

import numpy as np
from annotated_types import Le

from drake_aerial.choices import CableKind
from drake_aerial.errors import InputError
from drake_aerial.estimation.sensor_parameters import SensorParameters
from drake_aerial.geometry import Array
from drake_aerial.io.records import Flag, NonNegative, OneOrMany, Positive, record
from drake_aerial.plant.air import AirParameters
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.gripper import GripperParameters
from drake_aerial.plant.quadrotor import QuadrotorParameters
from drake_aerial.plant.wind import WindParameters
from drake_aerial.plant.world import ELASTIC_TIME_STEP, TIME_STEP

Part = TypeVar("Part", QuadrotorParameters, CableParameters, GripperParameters)


@record(frozen=True)
class StationParameters:
    """The team, its sensors and the wind.

    Quadrotors, cables and grippers are each given once, for a team of equals, or as a sequence with
    one entry per contact.

    Examples
    --------
    >>> from drake_aerial import StationParameters
    >>> from drake_aerial.plant.cable import CableParameters
    >>> short, long = CableParameters(length=0.5), CableParameters(length=0.8)
    >>> StationParameters(cable=[short, long]).cable_lengths(2).tolist()
    [0.5, 0.8]
    """

    quadrotor: OneOrMany[QuadrotorParameters] = field(default_factory=QuadrotorParameters)
    """Each quadrotor."""
    cable: OneOrMany[CableParameters] = field(default_factory=CableParameters)
    """Each cable; all are of one kind."""
    gripper: OneOrMany[GripperParameters] = field(default_factory=GripperParameters)
    """Each gripper."""
    time_step: Annotated[Positive, Le(0.01)] | None = None
    """Time step of the plant [s]; None for 0.005 with inextensible cables and 0.002 with elastic
    ones."""
    perception_period: Positive = 0.02
    """Period of the measurements [s]."""
    noise: NonNegative = 0.01
    """Standard deviation of the payload's measured position, per coordinate [m]."""
    measured_directions: Flag = True
    """True if cable directions are measured; False to infer them from the noisy payload
    position."""
    sensors: SensorParameters | None = None
    """Noise, bias, rate and delay of every measured quantity; None for the paper's sensing, as in
    the three fields above: everything but the payload's position is exact."""
    attitude_period: NonNegative = 0.0
    """Time for which the attitude loop holds its propeller commands [s]; 0 for new commands at
    every time step."""
    initial_slack: NonNegative = 0.05
    """Cable length less the distance between quadrotor and contact at the start [m]."""
    airborne_height: NonNegative = 1.0
    """Initial height of a payload that starts in the air [m]."""
    air: AirParameters | None = None
    """Drag, and the air that moves with the payload. None: no air, as in the paper, or the defaults
    of `AirParameters` where there is wind."""
    wind: WindParameters | None = None
    """Wind; None for still air."""
    motor_lag: NonNegative = 0.0
    """Time constant with which propeller speeds follow their commands [s]; 0 for none."""
    motor_lead: Flag = True
    """True to compensate the motor lag with lead compensation. Without it, the MPC flies the
    paper's box up to a lag of about 0.035 s and loses it beyond."""

    def __post_init__(self) -> None:
        if self.wind is not None and self.air is None:
            object.__setattr__(self, "air", AirParameters())
        if 0.0 < self.attitude_period < self.step:
            raise InputError(
                f"`attitude_period` must be 0 or >= the time step {self.step:g} s, "
                f"got {self.attitude_period}"
            )

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

    @property
    def position_noise(self) -> float:
        """Standard deviation of the payload's measured position, per coordinate [m]."""
        return self.noise if self.sensors is None else self.sensors.payload_position.noise

    def quadrotors(self, n: int) -> tuple[QuadrotorParameters, ...]:
        """Return the parameters of n quadrotors; raise InputError for another number."""
        return each(self.quadrotor, n, "quadrotors")

    def cables(self, n: int) -> tuple[CableParameters, ...]:
        """Return the parameters of n cables; raise InputError for another number."""
        return each(self.cable, n, "cables")

    def grippers(self, n: int) -> tuple[GripperParameters, ...]:
        """Return the parameters of n grippers; raise InputError for another number."""
        return each(self.gripper, n, "grippers")

    def cable_lengths(self, n: int) -> Array:
        """Return the lengths (n,) of n cables [m]."""
        return np.array([cable.length for cable in self.cables(n)])

    def with_cable_kind(self, kind: CableKind) -> StationParameters:
        """Return the same parameters with all cables of another kind."""
        if isinstance(self.cable, CableParameters):
            return replace(self, cable=replace(self.cable, kind=kind))
        return replace(self, cable=tuple(replace(cable, kind=kind) for cable in self.cable))


def each(given: Part | Sequence[Part], n: int, what: str) -> tuple[Part, ...]:
    """Return n parameter sets from one for all or from a sequence of n.

    Parameters
    ----------
    given : parameters, or a sequence of n of them
    n : int
    what : str
        Plural noun for the error.

    Raises
    ------
    InputError
        If a sequence has another length.
    """
    if not isinstance(given, Sequence):
        return (given,) * n
    if len(given) != n:
        raise InputError(
            f"parameters of the {what} must be one for all or {n}, one per contact, "
            f"got {len(given)}"
        )
    return tuple(given)
