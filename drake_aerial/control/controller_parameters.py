"""Everything about a controller but what it believes: its kind, its options and its weights or gains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Literal, TypeAlias

from drake_aerial.control.geometric import GeometricGains
from drake_aerial.control.mpc.horizon import STAGES
from drake_aerial.control.mpc.payload_mpc import MpcWeights
from drake_aerial.control.take_off import TakeOff
from drake_aerial.estimation.disturbance_observer import DisturbanceObserver
from drake_aerial.estimation.observation import PositionFilter


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

    def options(self) -> dict[str, Any]:
        """Return the keywords of `PayloadMpc`."""
        return _options(self)


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

    def options(self) -> dict[str, Any]:
        """Return the keywords of `GeometricController`, but for `feedforward`, which the kind says."""
        return _options(self)


ControllerParameters: TypeAlias = MpcParameters | GeometricParameters
"""One of the two, told apart by `kind`."""


def _options(parameters: ControllerParameters) -> dict[str, Any]:
    given = {f.name: getattr(parameters, f.name) for f in fields(parameters) if f.name != "kind"}
    return {
        name: value
        for name, value in given.items()
        if name != "position_filter" or value is not None
    }


CONTROLLERS: dict[str, ControllerParameters] = {
    "mpc": MpcParameters(),
    "geometric_ff": GeometricParameters("geometric_ff"),
    "geometric": GeometricParameters("geometric"),
}
"""The defaults of each kind."""
