"""A live Meshcat: a file, or a flight while it is simulated."""

from __future__ import annotations

import time
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.systems.framework import Context

from drake_aerial.geometry import Array, Pose, rotate
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.metrics import SLACK
from drake_aerial.simulation.trial_result import TrialResult
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.statics.gravity import GRAVITY
from drake_aerial.visualization.file_view import is_trial, view_of
from drake_aerial.visualization.flight_scene import FlightScene
from drake_aerial.visualization.meshcat_page import show_mesh, start_meshcat
from drake_aerial.visualization.replay import record_flight

Tell = Callable[[str], None]

_PERIOD = 0.04
"""Time between two shown states [s]."""
_PIECE = 0.03
"""Length of the pieces of the flown path [m]."""


@contextmanager
def live_view(
    path: str | Path,
    *,
    skill: ContactSkill | None = None,
    port: int | None = None,
    open_browser: bool = False,
) -> Iterator[str]:
    """Serve a view of a file until the context manager exits.

    Parameters
    ----------
    path : str or Path
        A file that `write_view` accepts; a trial is shown as an animation.
    skill : ContactSkill, optional
        As in `write_view`.
    port : int, optional
        1024 to 65535; the first free one from 7000 by default.
    open_browser : bool
        Open the address in the browser.

    Yields
    ------
    str
        The address, on this machine.

    Raises
    ------
    InputError
        As in `write_view`, or if the port is out of range or taken.
    """
    if is_trial(path):
        trial = TrialResult.load(path)
        meshcat = start_meshcat(port)
        record_flight(meshcat, trial)
    else:
        view = view_of(path, skill=skill)
        meshcat = start_meshcat(port)
        show_mesh(meshcat, view.mesh)
    if open_browser:
        webbrowser.open(meshcat.web_url())
    yield meshcat.web_url()


@contextmanager
def live_flight(
    flight: Flight,
    *,
    port: int | None = None,
    open_browser: bool = False,
    tell: Tell | None = None,
    patience: float = 10.0,
) -> Iterator[LiveFlight]:
    """Serve a flight while it is simulated.

    Parameters
    ----------
    flight : Flight
    port : int, optional
        1024 to 65535; the first free one from 7000 by default.
    open_browser : bool
        Open the address in the browser.
    tell : callable, optional
        Called with the address before the wait for a browser.
    patience : float
        Longest wait for a browser [s]; then the flight begins without one.

    Yields
    ------
    LiveFlight
        The argument `watch` of `Flight.run`.

    Raises
    ------
    InputError
        If the port is out of range or taken.

    Examples
    --------
    >>> from drake_aerial import Flight, FlightOptions, Payload, SuspendedPayload
    >>> from drake_aerial.references.trajectory import HoverTrajectory
    >>> box = Payload.from_box([0.4, 0.4, 0.2], 0.25)
    >>> box = SuspendedPayload.from_contacts(box, [[0.0, 0.0, 0.1]], [[0.0, 0.0, 1.0]])
    >>> flight = Flight(box, FlightOptions(trajectory=HoverTrajectory(hover_time=0.2)))
    >>> with live_flight(flight, patience=0.0) as watch:
    ...     result = flight.run(0, watch=watch)
    >>> result.outcome
    'completed'
    """
    meshcat = start_meshcat(port)
    watch = LiveFlight(meshcat, flight)
    if tell is not None:
        tell(meshcat.web_url())
    if open_browser:
        webbrowser.open(meshcat.web_url())
    waited = time.monotonic() + patience
    while not meshcat.GetNumActiveConnections() and time.monotonic() < waited:
        time.sleep(0.1)
    try:
        yield watch
        meshcat.Flush()
    finally:
        watch.close()


class LiveFlight:
    """Monitor that moves a `FlightScene` with a simulation, in real time at most.

    Attributes
    ----------
    frames : int
        Number of states shown.
    """

    def __init__(self, meshcat: Any, flight: Flight):
        station, payload = flight.station, flight.suspended_payload.payload
        self._meshcat, self._station, self._trajectory = meshcat, station, flight.trajectory
        self._scene = FlightScene(
            meshcat,
            payload.vertices,
            payload.faces,
            station.p_LC,
            station.parameters.cable_lengths(station.n),
        )
        self._slack_below = SLACK * GRAVITY * payload.mass / station.n
        self._ports = [station.GetOutputPort(f"{part}.state") for part in ("payload", "quadrotors")]
        self._tension, self._attached = (
            station.GetOutputPort(f"cables.{name}") for name in ("tension", "attached")
        )
        self._next = 0.0
        self._flown: Array | None = None
        self.frames = 0

    def __call__(self, context: Context) -> None:
        """Show the state in a station's context; wait until it is due."""
        t = context.get_time()
        if t < self._next - 1e-9:
            return
        payload, quadrotors = (port.Eval(context) for port in self._ports)
        if not (np.isfinite(payload).all() and np.isfinite(quadrotors).all()):
            return
        if self._flown is None:
            self._begin(payload[4:7], t)
        wait = self._start + t - time.monotonic()
        if wait > 0.0:
            time.sleep(wait)
        else:
            # After a delay, do not try to catch up.
            self._start -= wait
        self._next = t + _PERIOD
        self.frames += 1
        quadrotors = quadrotors.reshape(-1, 13)
        X_WL = Pose(payload[4:7], payload[:4])
        attached = self._attached.Eval(context) > 0.5
        self._scene.move(
            X_WL,
            self._reference.sample(np.array([t])).p[0],
            Pose(quadrotors[:, 4:7], quadrotors[:, :4]),
            X_WL.p + rotate(X_WL.q, self._station.p_LC),
            self._tension.Eval(context) < self._slack_below,
            attached,
        )
        self._meshcat.SetSimulationTime(t)
        assert self._flown is not None
        if np.linalg.norm(payload[4:7] - self._flown) > _PIECE:
            self._scene.extend_flown(self._flown, payload[4:7].copy())
            self._flown = payload[4:7].copy()

    def close(self) -> None:
        """Drop the references to the server, so that it stops."""
        del self._meshcat, self._scene

    def _begin(self, p_WL: Array, t: float) -> None:
        """Start the clock and draw the reference path, which starts at the payload."""
        self._start = time.monotonic() - t
        self._flown = p_WL.copy()
        self._reference = self._trajectory.starting_at(p_WL)
        path = self._reference.sample(np.arange(0.0, self._reference.duration, 0.02)).p
        self._scene.draw_reference(path)
        span = np.vstack([path, path + [0.0, 0.0, 0.7]])
        self._scene.look_at(span.min(axis=0), span.max(axis=0))
