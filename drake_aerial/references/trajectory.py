"""Reference trajectories of the payload's tracked point: immutable values, vectorised over time.

A trajectory gives position, velocity, acceleration, jerk and snap of the origin of the payload's
tracked frame L in the world, and the desired attitude R_WL (yaw only), at any time t >= 0. All
positions are relative to `start`; `trajectory.starting_at(p_WL)` moves the trajectory.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.references.path import (
    Arc,
    Line,
    Point,
    Segment,
    number,
    point,
    rest,
    take_off,
)


class Phase(NamedTuple):
    """Named part of a trajectory, from `start` to `end` [s]."""

    name: str
    start: float
    end: float


class TrajectorySample(NamedTuple):
    """Reference at one time or at a batch of times.

    Attributes
    ----------
    p, v, a, jerk, snap : (..., 3) arrays
        Position of L's origin in the world and its time derivatives [m, m/s, ..., m/s^4].
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
    """Base of all trajectories: a chain of segments from `start`, then rest.

    A derived class is a frozen dataclass, has a `name`, and overrides `segment_chain`.

    Parameters
    ----------
    start : (3,) tuple
        Position of L's origin at t = 0 [m].
    yaw : float
        Desired yaw of the payload [rad].

    Examples
    --------
    >>> from drake_aerial import LineTrajectory, Trajectory
    >>> line = LineTrajectory()
    >>> isinstance(line, Trajectory), line.duration
    (True, 14.0)
    >>> [phase.name for phase in line.phases]
    ['ground', 'lift', 'line', 'hover']
    """

    start: Point = (0.0, 0.0, 0.0)
    yaw: float = 0.0

    name = "trajectory"

    def __post_init__(self) -> None:
        for name in ("start", "approach", "displacement"):
            if hasattr(self, name):
                object.__setattr__(self, name, point(name, getattr(self, name)))
        number("yaw", self.yaw, low=-np.inf)
        self.segments  # noqa: B018  built here, so that bad values raise in the constructor

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return itself: it is immutable, and Drake's abstract values copy their content."""
        return self

    def segment_chain(self) -> list[Segment]:
        """Return the segments in order; each begins where the one before it ends."""
        raise NotImplementedError(f"{type(self).__name__} must override segment_chain")

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        """Segments of positive duration, in order."""
        return tuple(s for s in self.segment_chain() if s.duration > 0.0)

    @cached_property
    def phases(self) -> tuple[Phase, ...]:
        """Phases in order; consecutive segments of one name are one phase."""
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
        """Time at which the last phase ends [s]; after it the reference is at rest."""
        return self.phases[-1].end if self.phases else 0.0

    def phase(self, name: str) -> Phase:
        """Return the phase called `name`.

        Raises
        ------
        InputError
            If there is none; the message lists the names.
        """
        phases = {phase.name: phase for phase in reversed(self.phases)}
        if name not in phases:
            raise InputError(f"`name` must be one of {', '.join(reversed(phases))}, got {name!r}")
        return phases[name]

    def starting_at(self, p_WL: ArrayLike) -> Self:
        """Return the trajectory moved so that it starts at p_WL (3,) [m]."""
        return replace(self, start=point("p_WL", np.ravel(p_WL)))

    def sample(self, t: ArrayLike) -> TrajectorySample:
        """Return the reference at times t (...) [s]; before 0 it is at rest at the start."""
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
        if self.segments:
            stack[0, after] = self.segments[-1].end
        stack = stack.reshape(5, *t.shape, 3)
        q = np.broadcast_to([np.cos(self.yaw / 2), 0.0, 0.0, np.sin(self.yaw / 2)], (*t.shape, 4))
        return TrajectorySample._make([*stack, q])


@dataclass(frozen=True)
class HoverTrajectory(Trajectory):
    """Rest on the ground, rise by `lift_height` [m], then hover for `hover_time` [s].

    With `ground_time` = `lift_time` = 0 the payload hangs at `start` from the beginning.

    Examples
    --------
    >>> from drake_aerial import HoverTrajectory
    >>> HoverTrajectory(hover_time=3.0).sample(1.0).p.tolist()
    [0.0, 0.0, 0.0]
    """

    ground_time: float = 0.0
    lift_time: float = 0.0
    lift_height: float = 1.0
    hover_time: float = 10.0

    name = "hover"

    def segment_chain(self) -> list[Segment]:
        """Return take-off and hover."""
        chain, here = take_off(self.start, self.ground_time, self.lift_time, self.lift_height)
        return [*chain, rest("hover", self.hover_time, here)]


@dataclass(frozen=True)
class LineTrajectory(Trajectory):
    """Take off, go along `displacement` [m] in `line_time` [s], hover for `hover_time` [s].

    Examples
    --------
    >>> from drake_aerial import LineTrajectory
    >>> LineTrajectory(displacement=(1.0, 0.0, 0.0)).sample(20.0).p.tolist()
    [1.0, 0.0, 1.0]
    """

    displacement: Point = (2.0, 0.0, 0.0)
    line_time: float = 4.0
    timing: str = "smooth"
    ground_time: float = 2.0
    lift_time: float = 3.0
    lift_height: float = 1.0
    hover_time: float = 5.0

    name = "line"

    def segment_chain(self) -> list[Segment]:
        """Return take-off, line and hover."""
        chain, a = take_off(self.start, self.ground_time, self.lift_time, self.lift_height)
        b = a + point("displacement", self.displacement)
        duration = number("line_time", self.line_time, low=1e-3)
        line = Line("line", duration, tuple(a), tuple(b), self.timing)
        line.derivatives(np.zeros(1))
        return [*chain, line, rest("hover", self.hover_time, b)]


@dataclass(frozen=True)
class WaypointTrajectory(Trajectory):
    """Take off, visit `waypoints` [m] in `leg_times` [s] each, then hover.

    Waypoints are relative to the end of the lift. Every leg starts and ends at rest with smooth
    timing.

    Examples
    --------
    >>> from drake_aerial import WaypointTrajectory
    >>> square = WaypointTrajectory(waypoints=((1, 0, 0), (1, 1, 0), (0, 0, 0)), leg_times=2.0)
    >>> square.sample(9.0).p.tolist()
    [1.0, 1.0, 1.0]
    """

    waypoints: tuple[Point, ...] = ((1.0, 0.0, 0.0), (1.0, 1.0, 0.5), (0.0, 0.0, 0.0))
    leg_times: tuple[float, ...] | float = 3.0
    ground_time: float = 2.0
    lift_time: float = 3.0
    lift_height: float = 1.0
    hover_time: float = 5.0

    name = "waypoints"

    def __post_init__(self) -> None:
        given = self.waypoints
        if isinstance(given, (str, bytes)) or not np.iterable(given) or not len(given):
            raise InputError(f"`waypoints` must be a list of points (x, y, z) [m], got {given!r}")
        object.__setattr__(self, "waypoints", tuple(point("waypoints", w) for w in given))
        if np.iterable(self.leg_times):
            object.__setattr__(self, "leg_times", tuple(self.leg_times))
        super().__post_init__()

    def segment_chain(self) -> list[Segment]:
        """Return take-off, legs and hover."""
        chain, base = take_off(self.start, self.ground_time, self.lift_time, self.lift_height)
        here, times = base, self.leg_times
        if not isinstance(times, tuple):
            times = (times,) * len(self.waypoints)
        if len(times) != len(self.waypoints):
            raise InputError(
                f"`leg_times` must be one number or {len(self.waypoints)}, as many as waypoints, "
                f"got {len(times)}"
            )
        for waypoint, seconds in zip(self.waypoints, times):
            there = base + np.array(waypoint)
            duration = number("leg_times", seconds, low=1e-3)
            chain.append(Line("waypoints", duration, tuple(here), tuple(there), "smooth"))
            here = there
        return [*chain, rest("hover", self.hover_time, here)]


@dataclass(frozen=True)
class TransportTrajectory(Trajectory):
    """The paper's transport task: lift, go to the circle's start, fly the circle, hover.

    Parameters
    ----------
    ground_time : float
        Rest on the ground while the cables are tightened [s].
    lift_time, lift_height : float
        Duration [s] and height [m] of the lift; a `lift_time` of 0 skips it.
    approach_time, approach : float, (3,) tuple
        Duration [s] and displacement [m] from the end of the lift to the circle's first point; 0 s
        skips it.
    radius, turns, circle_time : float
        Radius of the circle [m], number of turns, and time for all of them [s].
    timing : str
        Timing of the circle: "quintic" (velocity and acceleration vanish at both ends), "smooth"
        (jerk and snap vanish too) or "constant" (a velocity step at both ends). Lift and approach
        are smooth.
    heading : float
        Azimuth of the circle's first point about its centre [rad].
    hover_time : float
        Duration of the hover at the circle's last point [s].

    Examples
    --------
    >>> from drake_aerial import TransportTrajectory
    >>> circle = TransportTrajectory.airborne(radius=0.5, turns=1.0, circle_time=6.0)
    >>> circle.sample(3.0).p.round(6).tolist()
    [-1.0, 0.0, 0.0]
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
        """Return circle and hover only, for a payload that hangs at the circle's first point."""
        return cls(**{"ground_time": 0.0, "lift_time": 0.0, "approach_time": 0.0, **keywords})

    def segment_chain(self) -> list[Segment]:
        """Return take-off, approach, circle and hover."""
        chain, here = take_off(self.start, self.ground_time, self.lift_time, self.lift_height)
        if number("approach_time", self.approach_time) > 0.0:
            there = here + point("approach", self.approach)
            chain.append(Line("approach", self.approach_time, tuple(here), tuple(there), "smooth"))
            here = there
        radius = number("radius", self.radius)
        heading = number("heading", self.heading, low=-np.inf)
        centre = here - radius * np.array([np.cos(heading), np.sin(heading), 0.0])
        angle = 2.0 * np.pi * number("turns", self.turns, low=-np.inf)
        time = number("circle_time", self.circle_time, low=1e-3)
        circle = Arc("circle", time, tuple(centre), radius, heading, angle, self.timing)
        circle.derivatives(np.zeros(1))
        return [*chain, circle, rest("hover", self.hover_time, circle.end)]
