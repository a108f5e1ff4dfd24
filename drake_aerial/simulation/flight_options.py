"""Options of a flight: belief, controller, trajectory and team."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import SkipValidation
from pydrake.systems.framework import LeafSystem

from drake_aerial.choices import CONTROLLERS, Belief, CableKind, Retiming
from drake_aerial.control.controller import PayloadController
from drake_aerial.control.controller_parameters import CONTROLLERS as DEFAULTS
from drake_aerial.control.controller_parameters import ControllerParameters, MpcParameters
from drake_aerial.control.geometric import GeometricController
from drake_aerial.control.mpc.payload_mpc import PayloadMpc
from drake_aerial.dynamics.path_limits import LIMITS, PathLimits
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.errors import InputError
from drake_aerial.estimation.observation import PositionFilter
from drake_aerial.estimation.wind_observer import WindObserver
from drake_aerial.io.records import Flag, NonNegative, Positive, record
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.quadrotor import GUARD_REACH
from drake_aerial.references.trajectory import Trajectory
from drake_aerial.simulation.station_parameters import StationParameters

CONTROL_DELAY_FRACTION = 0.2
"""Delay from a sample to the control step that reads it, as a fraction of the plant's time step."""
SEPARATION_FACTOR = 4.0 / 3.0
"""Distance that the MPC keeps between quadrotors over that at which they touch."""
_CLASSES: dict[str, Callable[..., PayloadController]] = {
    "mpc": PayloadMpc,
    "geometric_ff": GeometricController,
    "geometric": GeometricController,
}
"""Classes by kind; each takes the believed `PayloadModelParameters` and its parameters."""


@record(frozen=True)
class FlightOptions:
    """Options of a `Flight`; each field is also a keyword of `fly`.

    Raises
    ------
    InputError
        If belief or controller is unknown, or a number is outside its range.

    Examples
    --------
    >>> from drake_aerial import FlightOptions
    >>> FlightOptions(belief="true", cable="elastic").station_parameters.cable.kind
    'elastic'
    >>> FlightOptions(belief="x")
    Traceback (most recent call last):
    drake_aerial.errors.InputError: `belief` must be one of below_contact, geometric, true, got 'x'
    """

    belief: Belief = "below_contact"
    """Believed centre of mass and inertia: below_contact, geometric or true."""
    controller: Annotated[
        str | ControllerParameters | Callable[..., LeafSystem], SkipValidation
    ] = "mpc"
    """mpc, geometric_ff or geometric; `MpcParameters` or `GeometricParameters`; or your own: a
    function or class that takes the believed `PayloadModelParameters` and returns a LeafSystem."""
    trajectory: Annotated[str | Path | Trajectory, SkipValidation] = "transport"
    """transport (also called circle), hover, line, waypoints, a YAML file, or a `Trajectory`."""
    cable: CableKind | CableParameters | None = None
    """inextensible or elastic, or all parameters of the cables; None: as in `parameters`."""
    noise: NonNegative | None = None
    """Standard deviation of the measured payload position, per coordinate [m]; None: as in
    `parameters`."""
    parameters: StationParameters | None = None
    """The station: team, wind, sensors, motor lag; None for the paper's values."""
    controller_options: dict[str, Any] | None = None
    """Further keyword arguments of the controller."""
    mass_ratio: Positive = 1.0
    """Believed mass of the payload over its true mass (dimensionless)."""
    after_drop: NonNegative = 3.0
    """Time that is simulated after a gripper lets go while others hold [s]."""
    force: Flag = False
    """Fly although the contacts are marked infeasible, no taut equilibrium exists, the payload is
    too heavy, or the path is impossible."""
    retime: Retiming | None = None
    """slower: only the moves that exceed a limit are slowed; fastest: every move except the lift is
    flown as fast as the limits permit; None: the path is flown as it is, or rejected."""
    path_limits: PathLimits | None = LIMITS
    """Margins of the check of the path before take-off; None to check nothing."""

    def __post_init__(self) -> None:
        given = callable(self.controller) or isinstance(self.controller, ControllerParameters)
        if not given and self.controller not in CONTROLLERS:
            raise InputError(
                f"`controller` must be one of {', '.join(CONTROLLERS)}, their parameters, or a "
                f"function, got {self.controller!r}"
            )

    def make_controller(self, model: PayloadModelParameters) -> LeafSystem:
        """Return a controller that uses `model`.

        The package's own controllers, and classes derived from `PayloadController`, also get the
        control delay and a position filter for the station's noise.
        """
        station, given = self.station_parameters, self.controller_options or {}
        # A control step reads the sample before it; its command acts from the next plant step on.
        offset, position_filter = (
            CONTROL_DELAY_FRACTION * station.step,
            PositionFilter(station.position_noise),
        )
        parameters = self.controller_parameters
        make: Any = self.controller if parameters is None else _CLASSES[parameters.kind]
        default = getattr(make, "default_parameters", None)
        if parameters is None and default is not None:
            parameters = _changed(default, given)
        if parameters is not None:
            if parameters.position_filter is None:
                parameters = replace(parameters, position_filter=position_filter)
            if isinstance(parameters, MpcParameters):
                parameters = _in_air(parameters, station, model)
            return make(model, parameters, offset=given.get("offset", offset))
        ours = isinstance(make, type) and issubclass(make, PayloadController)
        matched = {"offset": offset, "position_filter": position_filter} if ours else {}
        return make(model, **{**matched, **given})

    @property
    def controller_name(self) -> str:
        """Name of the controller in records."""
        if isinstance(self.controller, ControllerParameters):
            return self.controller.kind
        return (
            self.controller
            if isinstance(self.controller, str)
            else getattr(self.controller, "__name__", "function")
        )

    @property
    def controller_parameters(self) -> ControllerParameters | None:
        """Parameters of the controller, with `controller_options` applied; None for your own."""
        parameters = (
            DEFAULTS[self.controller] if isinstance(self.controller, str) else self.controller
        )
        if not isinstance(parameters, ControllerParameters):
            return None
        return _changed(parameters, self.controller_options or {})

    @property
    def station_parameters(self) -> StationParameters:
        """Parameters of the station, with `cable` and `noise` applied."""
        parameters = StationParameters() if self.parameters is None else self.parameters
        if isinstance(self.cable, CableParameters):
            parameters = replace(parameters, cable=self.cable)
        elif self.cable is not None:
            parameters = parameters.with_cable_kind(self.cable)
        if self.noise is None:
            return parameters
        if parameters.sensors is not None:
            raise InputError(
                "`noise` must be None with `sensors`, which have a noise of their own, got "
                f"{self.noise}"
            )
        return replace(parameters, noise=self.noise)


def _in_air(
    parameters: MpcParameters, station: StationParameters, model: PayloadModelParameters
) -> MpcParameters:
    """Return parameters whose observer and separation fit a flight with air and wind, or none."""
    if parameters.observer is None:
        in_wind = station.wind is not None and model.air is not None
        parameters = replace(parameters, observer=WindObserver() if in_wind else "off")
    if parameters.separation is None:
        reach = max(GUARD_REACH * q.arm for q in station.quadrotors(model.n))
        separation = 0.0 if model.air is None else SEPARATION_FACTOR * 2.0 * reach
        parameters = replace(parameters, separation=separation)
    return parameters


def _changed(parameters: ControllerParameters, options: dict[str, Any]) -> ControllerParameters:
    """Return parameters changed by options; None means the default, `offset` is no parameter."""
    default = DEFAULTS[parameters.kind]
    changes = {
        name: getattr(default, name) if value is None else value
        for name, value in options.items()
        if name != "offset"
    }
    return replace(parameters, **changes)
