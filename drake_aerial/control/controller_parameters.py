"""Configuration of the flight controllers: kind, options, weights or gains; not the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Literal, TypeAlias

import numpy as np

from drake_aerial.control.mpc.horizon import STAGES
from drake_aerial.control.take_off import TakeOff
from drake_aerial.errors import InputError
from drake_aerial.estimation.disturbance_observer import DisturbanceObserver
from drake_aerial.estimation.observation import PositionFilter

Gain = tuple[float, float, float]


@dataclass(frozen=True)
class MpcWeights:
    """Weights per second of horizon on squared deviations, and on squared deviations of the commanded thrusts.

    Attributes
    ----------
    position, velocity : float
        Of the tracked point [1/m^2, s^2/m^2].
    attitude, rate : float
        Of the payload under several cables [1/rad^2, s^2/rad^2].
    swing, swing_rate : float
        The same of the payload's tilt under one cable. It is not actuated but swings, and a large weight on it
        makes a flight with a wrong belief of the centre of mass unstable.
    direction, direction_rate : float
        Of the cables [1/rad^2, s^2/rad^2].
    thrust : float
        Of the thrusts [1/N^2].
    input : float
        Of the commanded thrusts [1/N^2].
    view : float
        Of the cosine by which the payload is out of a camera's view, where a field of view is given.
    """

    position: float = 100.0
    velocity: float = 10.0
    attitude: float = 2.0
    rate: float = 0.5
    swing: float = 0.2
    swing_rate: float = 0.3
    direction: float = 2.0
    direction_rate: float = 0.5
    thrust: float = 0.0
    input: float = 1.0
    view: float = 2e4

    def __post_init__(self) -> None:
        for weight in fields(self):
            value = getattr(self, weight.name)
            if not (np.isfinite(value) and value >= 0.0):
                raise InputError(f"the MPC's weight {weight.name} is {value!r}; 0 or more accepted")
        if self.input == 0.0:
            raise InputError("the MPC's weight input is 0; a positive number accepted")


@dataclass(frozen=True)
class MpcParameters:
    """Of the model predictive controller, `PayloadMpc`.

    Examples
    --------
    >>> from drake_aerial import FlightOptions, MpcParameters
    >>> FlightOptions(controller=MpcParameters(stages=10, integral_gain=0.3)).controller_name
    'mpc'
    """

    kind: Literal["mpc"] = "mpc"
    """The geometric laws, geometric_ff and geometric, have other options."""
    stages: int | Sequence[int] = STAGES
    """The lengths of the horizon's steps, in units of `step`; a number alone is so many equal steps."""
    step: float = 0.05
    """The shortest step [s]."""
    ticks_per_plan: int = 2
    """How many ticks a plan serves."""
    weights: MpcWeights = field(default_factory=MpcWeights)
    """Per second of horizon, on squared deviations."""
    integral_gain: float = 0.0
    """Rate at which a remaining position error moves the reference [1/s]; 0 is off."""
    integral_limit: float = 0.3
    """Largest shift of the reference by that [m]."""
    field_of_view: float | None = None
    """Full angle of a camera under each quadrotor in whose view the payload is kept [rad]; None is off."""
    observer: DisturbanceObserver | None = None
    """Of forces and a moment that the model does not know of: wind, a wrong mass; None is off."""
    period: float = 0.02
    """Of the ticks [s]."""
    take_off: TakeOff = field(default_factory=TakeOff)
    """How to get into the air from the ground."""
    position_filter: PositionFilter | None = None
    """Of the measured payload position; None: matched to the station's noise."""


@dataclass(frozen=True)
class GeometricGains:
    """The payload's rows of the paper's table, and its rows for the cable's direction; along x, y, z.

    Attributes
    ----------
    position, velocity : (3,)
        Of the payload [1/s^2, 1/s].
    rotation, rate : (3,)
        Of the payload's attitude [N m, N m s].
    direction, direction_rate : (3,)
        Of the cables' directions [1/s^2, 1/s], scaled by m l.
    """

    position: Gain = (1.45, 1.45, 3.0)
    velocity: Gain = (3.7, 3.2, 2.5)
    rotation: Gain = (0.5, 0.5, 0.02)
    rate: Gain = (0.16, 0.16, 0.04)
    direction: Gain = (16.0, 16.0, 16.0)
    direction_rate: Gain = (6.7, 6.7, 3.1)


@dataclass(frozen=True)
class GeometricParameters:
    """Of the geometric tracking laws, `GeometricController`.

    Examples
    --------
    >>> from drake_aerial import FlightOptions, GeometricParameters
    >>> FlightOptions(controller=GeometricParameters(kind="geometric")).controller_name
    'geometric'
    """

    kind: Literal["geometric_ff", "geometric"] = "geometric_ff"
    """geometric_ff, which feeds the desired rate of the cables forward, or geometric, which does not; mpc has other options."""
    gains: GeometricGains = field(default_factory=GeometricGains)
    """Along x, y, z."""
    period: float = 0.02
    """Of the ticks [s]."""
    take_off: TakeOff = field(default_factory=TakeOff)
    """How to get into the air from the ground."""
    position_filter: PositionFilter | None = None
    """Of the measured payload position; None: matched to the station's noise."""


ControllerParameters: TypeAlias = MpcParameters | GeometricParameters
"""One of the two, told apart by `kind`."""


CONTROLLERS: dict[str, ControllerParameters] = {
    "mpc": MpcParameters(),
    "geometric_ff": GeometricParameters("geometric_ff"),
    "geometric": GeometricParameters("geometric"),
}
"""The defaults of each kind."""
