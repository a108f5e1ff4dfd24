"""Trajectories with the geometry of another one and timing laws of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.references.path import Arc, Line, Segment, number
from drake_aerial.references.spline_law import Law, SplineLaw, composed
from drake_aerial.references.trajectory import Trajectory

_AT_REST = 1e-6
"""Velocity [m/s] and acceleration [m/s^2] below which a path is at rest."""


@dataclass(frozen=True)
class RetimedSegment:
    """Part of a move that has a law of its own: the geometry of `path` under `law`.

    Parameters
    ----------
    phase : str
    duration : float
        [s]
    path : Segment
        Its time is the progress.
    law : SplineLaw
        Law of the whole move.
    begin : float
        Time of the law at which the segment begins [s].
    low : float
        Progress of the law at which `path` begins.
    """

    phase: str
    duration: float
    path: Segment
    law: SplineLaw
    begin: float = 0.0
    low: float = 0.0

    def derivatives(self, t: Array) -> Array:
        """Return the derivative stack (5, B, 3) [m, s] at times t (B,) in [0, duration]."""
        s = self.law.derivatives(np.asarray(t, float) + self.begin)
        progress = np.clip(s[0] - self.low, 0.0, self.path.duration)
        return composed(self.path.derivatives(progress), s)

    @property
    def end(self) -> Array:
        """Last point (3,) [m]."""
        return self.path.end


@dataclass(frozen=True)
class SlowedSegment:
    """A segment with all times multiplied by a factor."""

    segment: Segment
    factor: float

    @property
    def phase(self) -> str:
        """Name of the phase that it belongs to."""
        return self.segment.phase

    @property
    def duration(self) -> float:
        """Time that it takes [s]."""
        return self.factor * self.segment.duration

    def derivatives(self, t: Array) -> Array:
        """Return the derivative stack (5, B, 3) [m, s] at times t (B,) in [0, duration]."""
        powers = self.factor ** -np.arange(5.0)
        return self.segment.derivatives(np.asarray(t) / self.factor) * powers[:, None, None]

    @property
    def end(self) -> Array:
        """Last point (3,) [m]."""
        return self.segment.end


class Move(NamedTuple):
    """Part of a trajectory between two rests.

    Attributes
    ----------
    segments : tuple of Segment
        As the trajectory has them.
    paths : tuple of Segment
        The same geometry with the progress as time: from 0 to 1 for a single line or arc, the
        trajectory's own time for all else.
    """

    segments: tuple[Segment, ...]
    paths: tuple[Segment, ...]

    @property
    def name(self) -> str:
        """Phase of the first segment."""
        return self.segments[0].phase

    @property
    def duration(self) -> float:
        """Time that the trajectory takes for it [s]."""
        return sum(segment.duration for segment in self.segments)

    @property
    def range(self) -> float:
        """Progress at the end; it is 0 at the beginning."""
        return sum(path.duration for path in self.paths)

    def along(self, progress: Array) -> Array:
        """Return the derivatives (5, B, 3) with respect to the progress (B,)."""
        stack = np.empty((5, len(progress), 3))
        low = 0.0
        for k, path in enumerate(self.paths):
            last = k == len(self.paths) - 1
            inside = (progress >= low) & ((progress < low + path.duration) | last)
            if inside.any():
                local = np.clip(progress[inside] - low, 0.0, path.duration)
                stack[:, inside] = path.derivatives(local)
            low += path.duration
        return stack

    def under(self, law: Law) -> list[Segment]:
        """Return the segments of the move under a timing law."""
        if not isinstance(law, SplineLaw):
            slowed = [SlowedSegment(segment, law) for segment in self.segments]
            return list(self.segments) if law == 1.0 else list(slowed)
        chain: list[Segment] = []
        low, begin = 0.0, 0.0
        for path, segment in zip(self.paths, self.segments, strict=True):
            high = low + path.duration
            last = len(chain) == len(self.paths) - 1
            end = law.duration if last else law.time_of(high)
            chain.append(RetimedSegment(segment.phase, end - begin, path, law, begin, low))
            low, begin = high, end
        return chain


@dataclass(frozen=True)
class MoveTrajectory(Trajectory):
    """One move alone, between two rests.

    Parameters
    ----------
    pieces : tuple of Segment
    """

    pieces: tuple[Any, ...] = ()

    name = "move"

    @classmethod
    def of(cls, move: Move, law: Law, yaw: float) -> MoveTrajectory:
        """Return a move under a law, with the payload's yaw [rad]."""
        start = move.paths[0].derivatives(np.zeros(1))[0, 0]
        return cls(start=tuple(start.tolist()), yaw=yaw, pieces=tuple(move.under(law)))

    def segment_chain(self) -> list[Segment]:
        """Return the pieces."""
        return list(self.pieces)


def parts_of(trajectory: Trajectory) -> list[Move | Segment]:
    """Return the moves of a trajectory and the rests between them, in order."""
    parts: list[Move | Segment] = []
    run: list[Segment] = []

    def close() -> None:
        if run:
            parts.append(Move(tuple(run), _paths(run)))
            run.clear()

    for segment in trajectory.segments:
        sampled = segment.derivatives(np.linspace(0.0, segment.duration, 9))
        speed = np.linalg.norm(sampled[1:3], axis=2)
        if (speed < _AT_REST).all():
            close()
            parts.append(segment)
            continue
        if speed[:, 0].max() < _AT_REST:
            close()
        run.append(segment)
        if speed[:, -1].max() < _AT_REST:
            close()
    close()
    return parts


def _paths(segments: Sequence[Segment]) -> tuple[Segment, ...]:
    """Return segments whose time is the progress."""
    if len(segments) == 1 and isinstance(segments[0], (Line, Arc)):
        return (replace(segments[0], timing="constant", duration=1.0),)
    return tuple(segments)


@dataclass(frozen=True)
class RetimedTrajectory(Trajectory):
    """The path of another trajectory with other timing laws; rests keep their durations.

    Parameters
    ----------
    base : Trajectory
        Its path; `start` and `yaw` are this trajectory's.
    laws : tuple of SplineLaw or float
        One for each of `base`'s moves between two rests. A number is the factor by which `base`'s
        own timing is slowed; 1 keeps it.

    Raises
    ------
    InputError
        If there are not as many laws as moves.
    """

    base: Any = None
    laws: tuple[Any, ...] = ()

    name = "retimed"

    def __post_init__(self) -> None:
        if not isinstance(self.base, Trajectory):
            raise InputError(f"`base` must be a trajectory, got {type(self.base).__name__}")
        object.__setattr__(self, "laws", tuple(_law(law) for law in self.laws))
        super().__post_init__()

    def segment_chain(self) -> list[Segment]:
        """Return the segments of `base` under the laws."""
        parts = parts_of(replace(self.base, start=self.start, yaw=self.yaw))
        count = sum(isinstance(part, Move) for part in parts)
        if len(self.laws) != count:
            raise InputError(
                f"`laws` must have {count} entries, as many as moves of `base`, got "
                f"{len(self.laws)}"
            )
        chain: list[Segment] = []
        laws = iter(self.laws)
        for part in parts:
            if not isinstance(part, Move):
                chain.append(part)
                continue
            chain += part.under(next(laws))
        return chain


def _law(given: Any) -> Law:
    """Return a law from itself, from a factor, or from a mapping with its spacing and points."""
    if isinstance(given, SplineLaw):
        return given
    if not isinstance(given, dict):
        return number("laws", given, low=1e-3)
    try:
        return SplineLaw(float(given["spacing"]), tuple(given["points"]))
    except (TypeError, KeyError, ValueError) as error:
        raise InputError(
            f"`laws` must be numbers, or mappings with the keys spacing and points, got {given!r}"
        ) from error
