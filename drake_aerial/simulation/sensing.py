"""Sensors of a station, and what its controller reads from them."""

from __future__ import annotations

from dataclasses import dataclass

from pydrake.systems.framework import DiagramBuilder, OutputPort, System

from drake_aerial.control.controller import PayloadController
from drake_aerial.errors import InputError
from drake_aerial.estimation.delay_compensation import DelayCompensation
from drake_aerial.estimation.payload_from_cables import PayloadFromCables
from drake_aerial.estimation.sensor_suite import SensorSuite
from drake_aerial.estimation.state_sensor import StateSensor
from drake_aerial.geometry import Array
from drake_aerial.simulation.station_parameters import StationParameters

SENSED = ("payload_state", "quadrotor_states", "cable_directions", "attached")
"""Ports that a controller may read; it may leave some out."""
MEASURED = (*SENSED, "imu", "rotor_speeds")
"""Output ports of the sensors; which of them there are depends on their level."""

Ports = tuple[OutputPort, OutputPort]
"""Of the payload, and of the n quadrotors."""


@dataclass(frozen=True, eq=False)
class Sensing:
    """Sensors in a diagram, made by `add_sensing`.

    Attributes
    ----------
    perception : StateSensor or SensorSuite
        The sensors; their output ports are the measurements.
    read : dict
        Ports for a controller by name: the measurements, extrapolated to the present.
    """

    perception: StateSensor | SensorSuite
    read: dict[str, OutputPort]

    def measured(self) -> dict[str, OutputPort]:
        """Return the output ports of the sensors by name."""
        names = (name for name in MEASURED if self.perception.HasOutputPort(name))
        return {name: self.perception.GetOutputPort(name) for name in names}

    def connect(self, builder: DiagramBuilder, controller: System) -> None:
        """Connect the inputs of a controller.

        Raises
        ------
        InputError
            If the controller reads what is neither measured nor follows from it.
        """
        for name in SENSED:
            if not controller.HasInputPort(name):
                continue
            port = self.read.get(name)
            if port is None:
                port = self._payload_state(builder, name, controller)
            builder.Connect(port, controller.GetInputPort(name))

    def _payload_state(self, builder: DiagramBuilder, name: str, controller: System) -> OutputPort:
        """Return the port of a payload's state that is computed from the cables' angles."""
        ours = isinstance(controller, PayloadController)
        if name != "payload_state" or "cable_directions" not in self.read or not ours:
            accepted = "payload or cables" if ours else "payload"
            given = getattr(self.perception, "parameters", None)
            raise InputError(
                f"`sensors.level` must be {accepted} for a controller that reads {name}, got "
                f"{given.level if given else None!r}; choose such a level, or read the measured "
                "ports in a controller of your own"
            )
        estimator = builder.AddNamedSystem("payload_estimator", PayloadFromCables(controller.model))
        for port in ("quadrotor_states", "cable_directions"):
            builder.Connect(self.read[port], estimator.GetInputPort(port))
        output: OutputPort = estimator.GetOutputPort("payload_state")
        return output


def add_sensing(
    builder: DiagramBuilder,
    p_LC: Array,
    states: Ports,
    accelerations: Ports,
    parameters: StationParameters,
) -> Sensing:
    """Add the sensors of a station and the compensation of their delays to a diagram.

    Parameters
    ----------
    builder : DiagramBuilder
    p_LC : (n, 3) array
        Contacts in L [m].
    states, accelerations : pairs of OutputPort
    parameters : StationParameters
    """
    perception: StateSensor | SensorSuite
    if parameters.sensors is None:
        perception = StateSensor(
            p_LC,
            period=parameters.perception_period,
            noise=parameters.noise,
            measured_directions=parameters.measured_directions,
            time_step=parameters.step,
        )
    else:
        perception = SensorSuite(p_LC, parameters.sensors, time_step=parameters.step)
    builder.AddNamedSystem("perception", perception)
    for what, (payload, quadrotors) in (("state", states), ("acceleration", accelerations)):
        builder.Connect(payload, perception.GetInputPort(f"payload_{what}"))
        builder.Connect(quadrotors, perception.GetInputPort(f"quadrotor_{what}s"))
    read = {
        name: perception.GetOutputPort(name) for name in SENSED if perception.HasOutputPort(name)
    }
    if isinstance(perception, SensorSuite):
        now = builder.AddNamedSystem("delay_compensation", DelayCompensation(perception, p_LC))
        for name in MEASURED:
            if now.HasInputPort(name):
                builder.Connect(perception.GetOutputPort(name), now.GetInputPort(name))
            if now.HasOutputPort(name):
                read[name] = now.GetOutputPort(name)
    return Sensing(perception, read)
