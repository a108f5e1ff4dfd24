"""How a flight ends: completed, dropped, crashed or diverged; watched while it is simulated."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.systems.framework import Context, EventStatus

from drake_aerial.control.take_off import FlightPhase
from drake_aerial.geometry import Array
from drake_aerial.references.trajectory import Trajectory
from drake_aerial.simulation.station import TransportStation

OUTCOMES = ("completed", "dropped", "crashed", "diverged")
Progress = Callable[[float, str], None]
Watch = Callable[[Context], None]
"""Sees the station's context, every 0.02 s of simulated time."""

_NOTHING_DONE = EventStatus.DidNothing()
_FLYING = float(FlightPhase.FLYING)
_LOOK = 0.02
_REPORT = 0.2
_AFTERMATH = 0.5


class FlightMonitor:
    """A monitor for `Simulator.set_monitor`: releases overloaded grippers, sees how the flight ends, reports progress.

    - dropped: a gripper let go; what became of the payload while others held it is in `after_drop`;
    - crashed: a quadrotor touched anything, or the payload touched the ground while the reference was in the air;
    - diverged: the payload went further than `max_error` from the reference, or never left the ground, or a number was not finite.

    The simulation goes on for half a second after a crash, or after no gripper holds any more, for the replay; and for `after_drop` seconds
    after a drop while others hold, unless that ends in a crash or divergence.

    Parameters
    ----------
    station : TransportStation
    trajectory : Trajectory
        As it is flown.
    max_error : float
        [m]
    after_drop : float
        [s]
    progress : callable, optional
        Called with the fraction flown and a word on it.
    watch : callable, optional
        Called with the context every 0.02 s of simulated time, to look at and not to change.

    Attributes
    ----------
    outcome, reason : str
        One of `OUTCOMES`, and what happened if it is not "completed".
    time : float or None
        When it happened [s].
    after_drop : dict or None
        Where others still held: "outcome", one of held, lost (no gripper holds any more), crashed, diverged; "reason"; and "time_s",
        when that happened, or until when they were seen to hold [s].
    """

    def __init__(
        self,
        station: TransportStation,
        trajectory: Trajectory,
        *,
        max_error: float = 2.5,
        after_drop: float = 3.0,
        progress: Progress | None = None,
        watch: Watch | None = None,
    ):
        self._watch = watch
        self.outcome, self.reason = "completed", ""
        self.time: float | None = None
        self.after_drop: dict[str, Any] | None = None
        self._wait, self._until = after_drop, np.inf
        self._attached: Any = np.ones(station.n, dtype=bool)
        self._dropped_at: Array | None = None
        self._station, self._trajectory, self._max_error, self._progress = (
            station,
            trajectory,
            max_error,
            progress,
        )
        names = ("payload.state", "quadrotors.state", "plant.contact_results", "cables.attached")
        ports = (station.GetOutputPort(name) for name in names)
        self._payload_state, self._quadrotor_states, self._contacts, self._grippers = ports
        self._phase = (
            None if station.controller is None else station.GetOutputPort("controller.phase")
        )
        self._quadrotors = {int(q.body.index()) for q in station.quadrotors}
        self._payload = int(station.payload_body.body.index())
        self._next_look = self._next_report = 0.0
        # Sampled once: a trajectory is far quicker for many times than many times for one.
        count = int(np.ceil(trajectory.duration / _LOOK)) + 2
        self._reference = trajectory.sample(_LOOK * np.arange(count)).p
        phases = {phase.name: phase for phase in trajectory.phases}
        # The payload may drag and swing while it is lifted; a second after the reference is up it must hang free.
        begins_in_the_air = np.inf if "ground" in phases else 0.1
        self._airborne = phases["lift"].end + 1.0 if "lift" in phases else begins_in_the_air

    def __call__(self, context: Context) -> EventStatus:
        """Look at the state after a step; ends the simulation when it is over."""
        t = context.get_time()
        if t < self._next_look - 1e-9:
            return _NOTHING_DONE
        self._next_look = t + _LOOK
        if self._progress is not None and t >= self._next_report:
            self._next_report = t + _REPORT
            self._progress(min(t / max(self._trajectory.duration, 1e-9), 1.0), f"flight {t:.1f} s")
        if self._watch is not None:
            self._watch(context)
        if self.is_open:
            self._look(context, t)
        if self._holding and self.after_drop is not None:
            self.after_drop["time_s"] = t
        over = t >= self._until - 1e-9
        return (
            EventStatus.ReachedTermination(self._station, self.reason)
            if over
            else EventStatus.Succeeded()
        )

    @property
    def is_open(self) -> bool:
        """Whether something is still to be seen: nothing has ended the flight, or the rest holds after a drop."""
        return self.time is None or self._holding

    @property
    def _holding(self) -> bool:
        """Whether a gripper let go and the others hold."""
        return self.after_drop is not None and self.after_drop["outcome"] == "held"

    def _look(self, context: Context, t: float) -> None:
        station = self._station
        payload, quadrotors = (
            self._payload_state.Eval(context),
            self._quadrotor_states.Eval(context),
        )
        desired = self._reference[min(round(t / _LOOK), len(self._reference) - 1)]
        error = math.dist(payload[4:7], desired)
        if self._dropped_at is not None:
            # The rest may stay where it happened.
            error = min(error, math.dist(payload[4:7], self._dropped_at))
        attached: Any = self._grippers.Eval(context) > 0.5
        if not math.isfinite(float(payload.sum()) + float(quadrotors.sum())):
            self.end("diverged", "the state is not finite", t)
        elif (self._attached & ~attached).any():
            lost = [str(i + 1) for i in np.flatnonzero(self._attached & ~attached)]
            self._attached, self._dropped_at = attached, payload[4:7].copy()
            which = "the gripper was" if station.n == 1 else f"gripper {lost[0]} of {station.n} was"
            if len(lost) > 1:
                which = f"grippers {' and '.join(lost)} of {station.n} were"
            self.end("dropped", f"{which} pulled off the payload", t)
        elif error > self._max_error:
            self.end("diverged", f"the payload was {error:.1f} m from the reference", t)
        elif self.time is None and t > self._airborne and not self._flying(context):
            self.end("diverged", "the payload was not in the air when the reference was", t)
        else:
            self._look_for_contacts(context, t)

    def _look_for_contacts(self, context: Context, t: float) -> None:
        results = self._contacts.Eval(context)
        for i in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(i)
            bodies = {int(info.bodyA_index()), int(info.bodyB_index())}
            if bodies & self._quadrotors:
                what = "the payload" if self._payload in bodies else "the ground"
                self.end(
                    "crashed",
                    f"a quadrotor touched {what if len(bodies & self._quadrotors) == 1 else 'another'}",
                    t,
                )
                return
            if t > self._airborne and (self.time is None or self.time > self._airborne):
                self.end("crashed", "the payload touched the ground", t)
                return

    def _flying(self, context: Context) -> bool:
        # Flight is the last phase.
        if self._phase is not None and self._phase.Eval(context)[0] >= _FLYING:
            self._phase = None
        return self._phase is None

    def end(self, outcome: str, reason: str, time: float) -> None:
        """Record how the flight ended, and when [s]; after a drop, what became of the payload."""
        holding = outcome == "dropped" and self._attached.any()
        self._until = time + (
            self._wait if holding else 0.0 if outcome == "diverged" else _AFTERMATH
        )
        if self.time is None:
            self.outcome, self.reason, self.time = outcome, reason, time
            if holding:
                self.after_drop = {"outcome": "held", "reason": "", "time_s": time}
        elif not holding:
            self.after_drop = {
                "outcome": "lost" if outcome == "dropped" else outcome,
                "reason": reason,
                "time_s": time,
            }
        elif self.after_drop is not None:
            self.after_drop["reason"] = reason
