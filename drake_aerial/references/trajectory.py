"""Reference trajectories of the payload's tracked point: immutable values, vectorised over time.

A trajectory gives position, velocity, acceleration, jerk and snap of the origin of the payload's tracked
frame L in the world, and the desired attitude R_WL (yaw only), at any time t >= 0. All places are relative to
`start`, so the same trajectory serves a payload that rests anywhere: `trajectory.starting_at(p_WL)`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.references.path import Arc, Line, Segment

Point = tuple[float, float, float]


class Phase(NamedTuple):
    """A named part of a trajectory, from `start` to `end` [s]."""

    name: str
    start: float
    end: float


class TrajectorySample(NamedTuple):
    """The reference at one time or at a batch of times.

    Attributes
    ----------
    p, v, a, jerk, snap : (..., 3) arrays
        Position of L's origin in the world and its time derivatives [m, s].
    q : (..., 4) array
        Desired attitude R_WL, unit quaternion w, x, y, z. Its angular velocity is zero.
    """

    p: Array
    v: Array
    a: Array
    jerk: Array
    snap: Array
    q: Array


@dataclass(frozen=True)
class Trajectory:
    """Base of all trajectories: a chain of segments from `start`, then rest where the last one ends.

    Parameters
    ----------
    start : (3,) tuple
        Position of L's origin at t = 0 [m].
    yaw : float
        Desired yaw of the payload [rad].
    """

    start: Point = (0.0, 0.0, 0.0)
    yaw: float = 0.0

    name = "trajectory"

    def __post_init__(self) -> None:
        for name in ("start", "approach", "displacement"):
            if hasattr(self, name):
                object.__setattr__(self, name, _point(name, getattr(self, name)))
        _number("yaw", self.yaw, low=-np.inf)
        self.segments  # noqa: B018  built here, so that bad values are refused where they are given

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return itself: it is immutable, and Drake's abstract values copy what they hold."""
        return self

    def _chain(self) -> list[Segment]:
        raise NotImplementedError

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        """The segments of positive duration, in order."""
        return tuple(s for s in self._chain() if s.duration > 0.0)

    @cached_property
    def phases(self) -> tuple[Phase, ...]:
        """The table of phases; segments that follow one another under the same name are one phase."""
        table: list[Phase] = []
        t = 0.0
        for segment in self.segments:
            end = t + segment.duration
            if table and table[-1].name == segment.phase:
                table[-1] = table[-1]._replace(end=end)
            else:
                table.append(Phase(segment.phase, t, end))
            t = end
        return tuple(table)

    @property
    def duration(self) -> float:
        """The time at which the last phase ends [s]; the reference rests there ever after."""
        return self.phases[-1].end if self.phases else 0.0

    def phase(self, name: str) -> Phase:
        """Return the phase called `name`; raises InputError, listing the names, if there is none."""
        for phase in self.phases:
            if phase.name == name:
                return phase
        raise InputError(
            f"no phase {name!r}: this trajectory has {', '.join(p.name for p in self.phases)}"
        )

    def starting_at(self, p_WL: ArrayLike) -> Self:
        """Return the same trajectory moved so that it starts at p_WL (3,) [m]."""
        p = np.asarray(p_WL, float).ravel()
        return replace(self, start=(float(p[0]), float(p[1]), float(p[2])))

    def sample(self, t: ArrayLike) -> TrajectorySample:
        """Return the reference at times t (...) [s]; before 0 it is the start at rest."""
        t = np.asarray(t, float)
        flat = t.ravel()
        stack = np.zeros((5, len(flat), 3))
        stack[0] = self.start
        begin = 0.0
        for segment in self.segments:
            inside = (flat >= begin) & (flat < begin + segment.duration)
            if inside.any():
                stack[:, inside] = segment.derivatives(flat[inside] - begin)
            begin += segment.duration
        after = flat >= begin
        if self.segments and after.any():
            stack[:, after] = 0.0
            stack[0, after] = self.segments[-1].end
        stack = stack.reshape(5, *t.shape, 3)
        q = np.broadcast_to([np.cos(self.yaw / 2), 0.0, 0.0, np.sin(self.yaw / 2)], (*t.shape, 4))
        return TrajectorySample(stack[0], stack[1], stack[2], stack[3], stack[4], q)


@dataclass(frozen=True)
class HoverTrajectory(Trajectory):
    """Rest on the ground, rise by `lift_height` [m], then hover for `hover_time` [s].

    With `ground_time` = `lift_time` = 0 the payload is expected to hang at `start` already.
    """

    ground_time: float = 0.0
    lift_time: float = 0.0
    lift_height: float = 1.0
    hover_time: float = 10.0

    name = "hover"

    def _chain(self) -> list[Segment]:
        chain = _take_off(self.start, self.ground_time, self.lift_time, self.lift_height)
        here = tuple(chain[-1].end) if chain else self.start
        return [*chain, _rest("hover", _number("hover_time", self.hover_time), here)]


@dataclass(frozen=True)
class LineTrajectory(Trajectory):
    """Take off, go along `displacement` [m] in `line_time` [s], hover for `hover_time` [s]."""

    displacement: Point = (2.0, 0.0, 0.0)
    line_time: float = 4.0
    timing: str = "smooth"
    ground_time: float = 2.0
    lift_time: float = 3.0
    lift_height: float = 1.0
    hover_time: float = 5.0

    name = "line"

    def _chain(self) -> list[Segment]:
        chain = _take_off(self.start, self.ground_time, self.lift_time, self.lift_height)
        a = chain[-1].end if chain else np.array(self.start)
        b = a + _point("displacement", self.displacement)
        line = Line(
            "line", _number("line_time", self.line_time, low=1e-3), tuple(a), tuple(b), self.timing
        )
        line.derivatives(np.zeros(1))
        return [*chain, line, _rest("hover", _number("hover_time", self.hover_time), tuple(b))]


@dataclass(frozen=True)
class WaypointTrajectory(Trajectory):
    """Take off, visit `waypoints` (relative to where the lift ends) [m], `leg_times` [s] each, then hover.

    Every leg starts and ends at rest with smooth timing.
    """

    waypoints: tuple[Point, ...] = ((1.0, 0.0, 0.0), (1.0, 1.0, 0.5), (0.0, 0.0, 0.0))
    leg_times: tuple[float, ...] | float = 3.0
    ground_time: float = 2.0
    lift_time: float = 3.0
    lift_height: float = 1.0
    hover_time: float = 5.0

    name = "waypoints"

    def __post_init__(self) -> None:
        if (
            isinstance(self.waypoints, (str, bytes))
            or not np.iterable(self.waypoints)
            or not len(self.waypoints)
        ):
            raise InputError(
                f"waypoints must be a list of points (x, y, z) [m] but got {self.waypoints!r}"
            )
        object.__setattr__(self, "waypoints", tuple(_point("waypoints", w) for w in self.waypoints))
        if np.iterable(self.leg_times):
            object.__setattr__(self, "leg_times", tuple(self.leg_times))
        super().__post_init__()

    def _chain(self) -> list[Segment]:
        chain = _take_off(self.start, self.ground_time, self.lift_time, self.lift_height)
        here = base = chain[-1].end if chain else np.array(self.start)
        times = (
            self.leg_times
            if isinstance(self.leg_times, tuple)
            else (self.leg_times,) * len(self.waypoints)
        )
        if len(times) != len(self.waypoints):
            raise InputError(
                f"leg_times has {len(times)} entries for {len(self.waypoints)} waypoints: give as many"
            )
        for waypoint, seconds in zip(self.waypoints, times):
            there = base + np.array(waypoint)
            chain.append(
                Line(
                    "waypoints",
                    _number("leg_times", seconds, low=1e-3),
                    tuple(here),
                    tuple(there),
                    "smooth",
                )
            )
            here = there
        return [*chain, _rest("hover", _number("hover_time", self.hover_time), tuple(here))]


@dataclass(frozen=True)
class TransportTrajectory(Trajectory):
    """The paper's transport task: lift, go to the circle's start, fly the circle, hover.

    Parameters
    ----------
    ground_time : float
        Time the reference rests on the ground while the cables are tightened [s].
    lift_time, lift_height : float
        The vertical part [s], [m]; a `lift_time` of 0 skips it.
    approach_time, approach : float, (3,) tuple
        Duration [s] and displacement [m] from above the start to the circle's first point; 0 s skips it.
    radius, turns, circle_time : float
        The circle [m], how many times, and the time for all turns [s].
    timing : str
        Of the circle: "quintic" (starts and ends at rest), "smooth" (with jerk and snap at rest too), or "constant" rate (a velocity
        step at both ends). Lift and approach are smooth.
    heading : float
        Azimuth of the circle's first point as seen from its centre [rad].
    hover_time : float
        Hover at the circle's last point [s].
    """

    ground_time: float = 2.0
    lift_time: float = 3.0
    lift_height: float = 1.0
    approach_time: float = 3.0
    approach: Point = (1.0, 0.0, 0.0)
    radius: float = 1.0
    turns: float = 2.0
    circle_time: float = 12.0
    timing: str = "quintic"
    heading: float = 0.0
    hover_time: float = 5.0

    name = "transport"

    @classmethod
    def airborne(cls, **keywords: Any) -> Self:
        """Return the circle and hover alone, for a payload that hangs at the circle's first point already."""
        return cls(**{"ground_time": 0.0, "lift_time": 0.0, "approach_time": 0.0, **keywords})

    def _chain(self) -> list[Segment]:
        chain = _take_off(self.start, self.ground_time, self.lift_time, self.lift_height)
        here = chain[-1].end if chain else np.array(self.start)
        if _number("approach_time", self.approach_time) > 0.0:
            there = here + _point("approach", self.approach)
            chain.append(Line("approach", self.approach_time, tuple(here), tuple(there), "smooth"))
            here = there
        radius = _number("radius", self.radius)
        heading = _number("heading", self.heading, low=-np.inf)
        centre = here - radius * np.array([np.cos(heading), np.sin(heading), 0.0])
        angle = 2.0 * np.pi * _number("turns", self.turns, low=-np.inf)
        time = _number("circle_time", self.circle_time, low=1e-3)
        circle = Arc("circle", time, tuple(centre), radius, heading, angle, self.timing)
        circle.derivatives(np.zeros(1))
        return [
            *chain,
            circle,
            _rest("hover", _number("hover_time", self.hover_time), tuple(circle.end)),
        ]


def _take_off(
    start: Point, ground_time: float, lift_time: float, lift_height: float
) -> list[Segment]:
    chain: list[Segment] = []
    if _number("ground_time", ground_time) > 0.0:
        chain.append(_rest("ground", ground_time, start))
    if _number("lift_time", lift_time) > 0.0:
        top = (start[0], start[1], start[2] + _number("lift_height", lift_height))
        chain.append(Line("lift", lift_time, start, top, "smooth"))
    return chain


def _rest(phase: str, duration: float, here: Any) -> Line:
    return Line(phase, duration, tuple(here), tuple(here))


def _number(name: str, value: Any, low: float = 0.0) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise InputError(f"{name} must be a number but got {value!r}")
    if not np.isfinite(value) or value < low:
        raise InputError(f"{name} must be finite and at least {low:g} but got {value!r}")
    return float(value)


def _point(name: str, value: Any) -> Point:
    try:
        p = np.asarray(value, float)
    except (TypeError, ValueError):
        p = np.zeros(0)
    if p.shape != (3,) or not np.isfinite(p).all():
        raise InputError(f"{name} must be three finite numbers (x, y, z) [m] but got {value!r}")
    return (float(p[0]), float(p[1]), float(p[2]))
