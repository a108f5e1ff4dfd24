"""Configuration of the flight controllers: kind, options, weights or gains; not the model."""

from dataclasses import field
from typing import Annotated, Literal, TypeAlias

import numpy as np
from annotated_types import Lt

from drake_aerial.control.mpc.horizon import STAGES
from drake_aerial.control.take_off import TakeOff
from drake_aerial.errors import InputError
from drake_aerial.estimation.disturbance_observer import DisturbanceObserver
from drake_aerial.estimation.observation import PositionFilter
from drake_aerial.estimation.wind_observer import WindObserver
from drake_aerial.io.records import Count, NonNegative, OneOrMany, Positive, record

Observer: TypeAlias = DisturbanceObserver | WindObserver
"""One of the two, told apart by `kind`."""
Gain = tuple[NonNegative, NonNegative, NonNegative]


@record(frozen=True)
class MpcWeights:
    """Weights of the MPC's cost per second of horizon, on squared deviations.

    Examples
    --------
    >>> from drake_aerial import MpcParameters, MpcWeights
    >>> MpcParameters(weights=MpcWeights(swing=0.1)).weights.position
    100.0
    """

    position: NonNegative = 100.0
    """Position of the tracked point [1/m^2]."""
    velocity: NonNegative = 10.0
    """Velocity of the tracked point [s^2/m^2]."""
    attitude: NonNegative = 2.0
    """Attitude of a payload on several cables [1/rad^2]."""
    rate: NonNegative = 0.5
    """Angular velocity of a payload on several cables [s^2/rad^2]."""
    swing: NonNegative = 0.2
    """Tilt of a payload on one cable [1/rad^2]. The tilt is not actuated: with a large weight, a
    flight with a wrong belief of the centre of mass becomes unstable."""
    swing_rate: NonNegative = 0.3
    """Tilt rate of a payload on one cable [s^2/rad^2]."""
    direction: NonNegative = 2.0
    """Directions of the cables [1/rad^2]."""
    direction_rate: NonNegative = 0.5
    """Angular velocities of the cables [s^2/rad^2]."""
    thrust: NonNegative = 0.0
    """Thrusts [1/N^2]."""
    input: Positive = 1.0
    """Commanded thrusts [1/N^2]."""
    separation: NonNegative = 5e3
    """Distance that two quadrotors miss between them, if `separation` is given [1/m^2]."""
    view: NonNegative = 2e4
    """Cosine by which the payload is outside a camera's view, if `field_of_view` is given
    (dimensionless)."""


@record(frozen=True)
class MpcParameters:
    """Parameters of the model predictive controller, `PayloadMpc`.

    Examples
    --------
    >>> from drake_aerial import FlightOptions, MpcParameters
    >>> FlightOptions(controller=MpcParameters(stages=10, integral_gain=0.3)).controller_name
    'mpc'
    """

    kind: Literal["mpc"] = "mpc"
    """mpc; the geometric laws, geometric_ff and geometric, have other options."""
    stages: OneOrMany[Count] = STAGES
    """Lengths of the horizon's steps, in units of `step`; a number N alone for N steps of length
    1."""
    step: Positive = 0.05
    """Shortest step of the horizon [s]."""
    ticks_per_plan: Count = 2
    """Control steps per plan; in between the first input of the plan is held."""
    weights: MpcWeights = field(default_factory=MpcWeights)
    """Weights of the cost."""
    integral_gain: NonNegative = 0.0
    """Rate at which a remaining position error moves the reference [1/s]; 0 for off."""
    integral_limit: NonNegative = 0.3
    """Largest shift of the reference by the integral [m]."""
    field_of_view: Annotated[Positive, Lt(np.pi)] | None = None
    """Full angle of a camera under each quadrotor that keeps the payload in view [rad]; None for
    off."""
    separation: NonNegative | None = None
    """Distance between the centres of two quadrotors that plans keep [m]; 0 for off. None: the
    distance at which they touch and a third more in a flight with air, else off."""
    observer: Observer | Literal["off"] | None = None
    """Observer of wind (kind: wind) or of unmodelled forces and a moment (kind: force), or off.
    None: of wind in a flight with wind, else off."""
    period: Positive = 0.02
    """Control period [s]."""
    take_off: TakeOff = field(default_factory=TakeOff)
    """Take-off from the ground."""
    position_filter: PositionFilter | None = None
    """Filter of the measured payload position; None for one that fits the station's noise."""

    def __post_init__(self) -> None:
        if (self.stages if isinstance(self.stages, int) else len(self.stages)) < 2:
            raise InputError(f"`stages` must have at least 2 steps, got {self.stages}")


@record(frozen=True)
class GeometricGains:
    """Gains of the geometric laws along x, y and z: the paper's table.

    Examples
    --------
    >>> from drake_aerial import GeometricGains, GeometricParameters
    >>> GeometricParameters(gains=GeometricGains(position=(2.0, 2.0, 3.0))).gains.velocity
    (3.7, 3.2, 2.5)
    """

    position: Gain = (1.45, 1.45, 3.0)
    """Position of the payload [1/s^2]."""
    velocity: Gain = (3.7, 3.2, 2.5)
    """Velocity of the payload [1/s]."""
    rotation: Gain = (0.5, 0.5, 0.02)
    """Attitude of the payload [N m]."""
    rate: Gain = (0.16, 0.16, 0.04)
    """Angular velocity of the payload [N m s]."""
    direction: Gain = (16.0, 16.0, 16.0)
    """Directions of the cables, scaled by mass times cable length [1/s^2]."""
    direction_rate: Gain = (6.7, 6.7, 3.1)
    """Angular velocities of the cables, scaled by mass times cable length [1/s]."""


@record(frozen=True)
class GeometricParameters:
    """Parameters of the geometric tracking laws, `GeometricController`.

    Examples
    --------
    >>> from drake_aerial import FlightOptions, GeometricParameters
    >>> FlightOptions(controller=GeometricParameters(kind="geometric")).controller_name
    'geometric'
    """

    kind: Literal["geometric_ff", "geometric"] = "geometric_ff"
    """geometric_ff (feeds the desired rate of the cables forward) or geometric (does not); mpc has
    other options."""
    gains: GeometricGains = field(default_factory=GeometricGains)
    """Gains of the law."""
    period: Positive = 0.02
    """Control period [s]."""
    take_off: TakeOff = field(default_factory=TakeOff)
    """Take-off from the ground."""
    position_filter: PositionFilter | None = None
    """Filter of the measured payload position; None for one that fits the station's noise."""


ControllerParameters: TypeAlias = MpcParameters | GeometricParameters
"""One of the two, told apart by `kind`."""


CONTROLLERS: dict[str, ControllerParameters] = {
    "mpc": MpcParameters(),
    "geometric_ff": GeometricParameters("geometric_ff"),
    "geometric": GeometricParameters("geometric"),
}
"""The defaults of each kind."""
