"""One log of several output ports of a diagram."""

import numpy as np
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.primitives import Multiplexer, VectorLogSink

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

LOG_PERIOD = 0.01
"""Sample period of a log [s]."""


class PortLog:
    """Log of several output ports in a single system.

    A single system is faster than one log per port, because the simulator visits every system at
    every step.
    """

    def __init__(self) -> None:
        self._ports: dict[str, OutputPort] = {}

    def export(self, builder: DiagramBuilder, port: OutputPort, name: str) -> None:
        """Export `port` from the diagram and log it; call it before `connect`."""
        builder.ExportOutput(port, name)
        self._ports[name] = port

    def connect(self, builder: DiagramBuilder) -> None:
        """Add the log to the diagram of its ports."""
        sizes = [port.size() for port in self._ports.values()]
        ends = np.cumsum(sizes)
        self._slices = {
            name: slice(end - size, end)
            for name, size, end in zip(self._ports, sizes, ends, strict=True)
        }
        together = builder.AddNamedSystem("logged", Multiplexer(sizes))
        for k, port in enumerate(self._ports.values()):
            builder.Connect(port, together.get_input_port(k))
        self._sink = builder.AddNamedSystem("log", VectorLogSink(int(ends[-1]), LOG_PERIOD))
        builder.Connect(together.get_output_port(), self._sink.get_input_port())

    def read(self, root_context: Context, name: str) -> tuple[Array, Array]:
        """Return times (T,) [s] and values (T, size) of the port with this name.

        Raises
        ------
        InputError
            If no port of this name is logged.
        """
        if name not in self._slices:
            raise InputError(f"`name` must be one of {', '.join(self._slices)}, got {name!r}")
        log = self._sink.FindLog(root_context)
        return np.array(log.sample_times()), np.array(log.data()[self._slices[name]].T)
