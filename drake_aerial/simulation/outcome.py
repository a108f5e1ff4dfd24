"""Outcome of a flight: a monitor that detects drops, crashes and divergence."""

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
"""Called with the station's context every 0.02 s of simulated time; must not change it."""

_NOTHING_DONE = EventStatus.DidNothing()
_FLYING = float(FlightPhase.FLYING)
_CHECK_PERIOD = 0.02
_REPORT_PERIOD = 0.2
_TIME_AFTER_END = 0.5


class FlightMonitor:
    """Detect how a flight ends and report progress; a monitor for `Simulator.set_monitor`.

    - dropped: a gripper let go; `after_drop` says what the others did;
    - crashed: a quadrotor touched anything, or the payload touched the ground while the reference
      was in the air;
    - diverged: the payload was further than `max_error` from the reference, or never left the
      ground, or a number was not finite.

    The simulation continues for 0.5 s after a crash, or after the last gripper let go, for the
    replay. After a drop while other grippers hold, it continues for `after_drop` seconds unless a
    crash or divergence ends it.

    Parameters
    ----------
    station : TransportStation
    trajectory : Trajectory
        Reference as it is flown, returned by `TransportStation.place`.
    max_error : float
        [m]
    after_drop : float
        [s]
    progress : callable, optional
        Called with the fraction flown and the time as text.
    watch : callable, optional
        Called with the context every 0.02 s of simulated time; must not change it.

    Attributes
    ----------
    outcome, reason : str
        One of `OUTCOMES`, and what happened if it is not "completed".
    time : float or None
        Time at which it happened [s].
    after_drop : dict or None
        After a drop with other grippers attached: "outcome" (held, lost if no gripper holds any
        more, crashed or diverged), "reason" and "time_s", the time of that or the last time at
        which they held [s].
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
        self._next_check = self._next_report = 0.0
        # One call for many times is much faster than many calls.
        count = int(np.ceil(trajectory.duration / _CHECK_PERIOD)) + 2
        self._reference = trajectory.sample(_CHECK_PERIOD * np.arange(count)).p
        phases = {phase.name: phase for phase in trajectory.phases}
        # The payload may drag and swing while it is lifted, and must be in the air 1 s later.
        without_lift = np.inf if "ground" in phases else 0.1
        self._airborne = phases["lift"].end + 1.0 if "lift" in phases else without_lift

    def __call__(self, context: Context) -> EventStatus:
        """Check the state after a step; end the simulation when the flight is over."""
        t = context.get_time()
        if t < self._next_check - 1e-9:
            return _NOTHING_DONE
        self._next_check = t + _CHECK_PERIOD
        if self._progress is not None and t >= self._next_report:
            self._next_report = t + _REPORT_PERIOD
            self._progress(min(t / max(self._trajectory.duration, 1e-9), 1.0), f"flight {t:.1f} s")
        if self._watch is not None:
            self._watch(context)
        if self.is_open:
            self._check_state(context, t)
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
        """True while the outcome is open: the flight goes on, or grippers hold after a drop."""
        return self.time is None or self._holding

    @property
    def _holding(self) -> bool:
        """Whether a gripper let go and others hold."""
        return self.after_drop is not None and self.after_drop["outcome"] == "held"

    def _check_state(self, context: Context, t: float) -> None:
        station = self._station
        payload, quadrotors = (
            self._payload_state.Eval(context),
            self._quadrotor_states.Eval(context),
        )
        desired = self._reference[min(round(t / _CHECK_PERIOD), len(self._reference) - 1)]
        error = math.dist(payload[4:7], desired)
        if self._dropped_at is not None:
            # The remaining team may hold the payload where the drop happened.
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
            self._check_contacts(context, t)

    def _check_contacts(self, context: Context, t: float) -> None:
        results = self._contacts.Eval(context)
        for i in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(i)
            bodies = {int(info.bodyA_index()), int(info.bodyB_index())}
            if bodies & self._quadrotors:
                what = "the payload" if self._payload in bodies else "the ground"
                what = "another" if len(bodies & self._quadrotors) > 1 else what
                self.end("crashed", f"a quadrotor touched {what}", t)
                return
            if t > self._airborne and (self.time is None or self.time > self._airborne):
                self.end("crashed", "the payload touched the ground", t)
                return

    def _flying(self, context: Context) -> bool:
        # The phase `FLYING` is the last one.
        if self._phase is not None and self._phase.Eval(context)[0] >= _FLYING:
            self._phase = None
        return self._phase is None

    def end(self, outcome: str, reason: str, time: float) -> None:
        """Record an outcome, its reason and time [s]; after a drop, those of the remaining team."""
        holding = outcome == "dropped" and self._attached.any()
        self._until = time + (
            self._wait if holding else 0.0 if outcome == "diverged" else _TIME_AFTER_END
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
