"""How a payload is flown: what `fly`, `prepare_flight` and `Flight` take besides the contacts and the payload."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.systems.framework import LeafSystem

from drake_aerial.control.controller import PayloadController
from drake_aerial.control.controller_parameters import CONTROLLERS as DEFAULTS
from drake_aerial.control.controller_parameters import ControllerParameters
from drake_aerial.control.geometric import GeometricController
from drake_aerial.control.mpc.payload_mpc import PayloadMpc
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.errors import InputError
from drake_aerial.estimation.observation import PositionFilter
from drake_aerial.plant.cable import CableParameters
from drake_aerial.references.trajectory import Trajectory
from drake_aerial.simulation.beliefs import BELIEFS
from drake_aerial.simulation.station_parameters import StationParameters

THOUGHT = 0.2
"""Of a plant's step, what passes between a sample and the tick that reads it."""
CONTROLLERS: dict[str, Callable[..., PayloadController]] = {
    "mpc": PayloadMpc,
    "geometric_ff": GeometricController,
    "geometric": GeometricController,
}
"""Classes by kind; each takes the believed `PayloadModelParameters` and its parameters."""


@dataclass(frozen=True)
class FlightOptions:
    """How to fly; each field is also a keyword of `fly`, `prepare_flight` and `Flight`.

    Raises
    ------
    InputError
        For an unknown belief or controller, or a time that is negative.

    Examples
    --------
    >>> from drake_aerial import FlightOptions
    >>> FlightOptions(belief="true", cable="elastic").station_parameters.cable.kind
    'elastic'
    >>> FlightOptions(belief="centre")
    Traceback (most recent call last):
    drake_aerial.errors.InputError: no belief 'centre': give one of below_contact, geometric, true
    """

    belief: str = "below_contact"
    """What the controller takes for the centre of mass: below_contact, geometric or true."""
    controller: str | ControllerParameters | Callable[..., LeafSystem] = "mpc"
    """mpc, geometric_ff or geometric; or `MpcParameters` or `GeometricParameters`; or your own: called with the believed
    `PayloadModelParameters`, it returns the LeafSystem."""
    trajectory: str | Path | Trajectory = "transport"
    """"transport" (also called "circle"), hover, line, waypoints, or a YAML file."""
    cable: str | CableParameters | None = None
    """"inextensible" or "elastic", or everything about the cables; None: as `parameters` has them."""
    noise: float | None = None
    """Standard deviation of the measured payload position, per coordinate [m]; None: as `parameters` has it."""
    parameters: StationParameters | None = None
    """Everything else about the station: unequal teams, wind, motor lag; None for the paper's values."""
    controller_options: dict[str, Any] | None = None
    """Further arguments of the controller."""
    mass_ratio: float = 1.0
    """What the controller takes for the payload's mass, over the true one."""
    after_drop: float = 3.0
    """How long the flight goes on after a gripper let go while others hold [s]."""
    force: bool = False
    """Whether to fly what is known not to fly: a solution marked infeasible, a formation without taut equilibrium, too heavy a payload."""

    def __post_init__(self) -> None:
        if self.belief not in BELIEFS:
            raise InputError(f"no belief {self.belief!r}: give one of {', '.join(BELIEFS)}")
        given = callable(self.controller) or isinstance(self.controller, ControllerParameters)
        if not given and self.controller not in CONTROLLERS:
            raise InputError(
                f"no controller {self.controller!r}: give one of {', '.join(CONTROLLERS)}, or a function"
            )
        if not (np.isfinite(self.after_drop) and self.after_drop >= 0.0):
            raise InputError(f"after_drop is {self.after_drop!r} s; 0 or more accepted")

    def make_controller(self, model: PayloadModelParameters) -> LeafSystem:
        """Return a controller that uses `model`.

        The package's own controllers, and classes derived from `PayloadController`, also get the
        control delay and a position filter for the station's noise.
        """
        station, given = self.station_parameters, self.controller_options or {}
        # A control step reads the sample before it; its command acts from the next plant step on.
        offset, position_filter = THOUGHT * station.step, PositionFilter(station.noise)
        parameters = self.controller_parameters
        make: Any = self.controller if parameters is None else CONTROLLERS[parameters.kind]
        default = getattr(make, "default_parameters", None)
        if parameters is None and default is not None:
            parameters = _changed(default, given)
        if parameters is not None:
            if parameters.position_filter is None:
                parameters = replace(parameters, position_filter=position_filter)
            return make(model, parameters, offset=given.get("offset", offset))
        ours = isinstance(make, type) and issubclass(make, PayloadController)
        matched = {"offset": offset, "position_filter": position_filter} if ours else {}
        return make(model, **{**matched, **given})

    @property
    def controller_name(self) -> str:
        """What the controller is called in records."""
        if isinstance(self.controller, ControllerParameters):
            return self.controller.kind
        return (
            self.controller
            if isinstance(self.controller, str)
            else getattr(self.controller, "__name__", "function")
        )

    @property
    def controller_parameters(self) -> ControllerParameters | None:
        """Everything about the controller that is flown, what `controller_options` change included; None for your own."""
        parameters = (
            DEFAULTS[self.controller] if isinstance(self.controller, str) else self.controller
        )
        if not isinstance(parameters, ControllerParameters):
            return None
        return _changed(parameters, self.controller_options or {})

    @classmethod
    def merged(cls, options: FlightOptions | None, changes: dict[str, Any]) -> FlightOptions:
        """Return `options`, or the defaults, with some fields changed. Raises TypeError for a field that does not exist."""
        return replace(cls() if options is None else options, **changes)

    @property
    def station_parameters(self) -> StationParameters:
        """The station's parameters, with the kind of cable and the noise that were asked for."""
        parameters = StationParameters() if self.parameters is None else self.parameters
        if isinstance(self.cable, CableParameters):
            parameters = replace(parameters, cable=self.cable)
        elif self.cable is not None:
            parameters = parameters.with_cable_kind(self.cable)
        return parameters if self.noise is None else replace(parameters, noise=self.noise)


def _changed(parameters: ControllerParameters, options: dict[str, Any]) -> ControllerParameters:
    """Return parameters changed by options; None means the default, `offset` is no parameter."""
    default = DEFAULTS[parameters.kind]
    changes = {
        name: getattr(default, name) if value is None else value
        for name, value in options.items()
        if name != "offset"
    }
    return replace(parameters, **changes)
