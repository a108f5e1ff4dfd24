"""Retiming: slow a path until a team can fly it, or fly it as fast as its limits permit."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from drake_aerial.choices import RETIMINGS, Retiming
from drake_aerial.dynamics.law_optimization import faster_law
from drake_aerial.dynamics.path_check import check_path, path_demands
from drake_aerial.dynamics.path_limits import CarriedPayload, PathLimits
from drake_aerial.dynamics.path_speed import fastest_progress
from drake_aerial.errors import InputError, JobError
from drake_aerial.geometry import Array
from drake_aerial.references.retimed import Move, MoveTrajectory, RetimedTrajectory, parts_of
from drake_aerial.references.spline_law import Law, SplineLaw, duration_of, slowed
from drake_aerial.references.trajectory import HoverTrajectory, Trajectory

_PRECISION = 0.005
"""Relative precision of the factors by which laws are slowed."""
_SLOWEST = 50.0
"""Largest factor that is tried."""
_SPACINGS = (0.12, 0.17, 0.24, 0.34)
"""Distances of the control points of a law that are tried [s]: short ones leave short ramps of the
acceleration, which cost thrust; long ones cost time."""
_SHARES = (0.6, 1.0)
"""Parts of the free thrust that are tried for the accelerations; the ramps need the rest."""
_ROUNDS, _SLOWED, _NEAR = 40, 1.04, 0.5
"""Rounds in which moves within 0.5 s of a violation are slowed by 4 %."""


def retime(
    trajectory: Trajectory,
    carried: CarriedPayload,
    limits: PathLimits | None = None,
    *,
    mode: Retiming = "slower",
) -> Trajectory:
    """Return a trajectory along the same path that a team can fly.

    Each move between two rests gets a timing law of its own, smooth up to snap; rests keep their
    durations.

    Parameters
    ----------
    trajectory : Trajectory
    carried : CarriedPayload
    limits : PathLimits, optional
    mode : str
        "slower": moves that keep the limits stay as they are; the others take the time that was
        asked for if another law permits it, or as little more as possible. "fastest": every move
        but the lift takes as little time as possible.

    Returns
    -------
    Trajectory
        The given one if nothing had to change.

    Raises
    ------
    InputError
        If the mode is unknown.
    JobError
        If no timing makes the path possible, for instance because the payload is too heavy.

    Examples
    --------
    >>> import numpy as np
    >>> from drake_aerial import CarriedPayload, check_path, retime
    >>> from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
    >>> from drake_aerial.references.trajectory import LineTrajectory
    >>> box = PayloadModelParameters(0.25, 0.006 * np.eye(3), [[0.0, 0.0, 0.1]])
    >>> carried = CarriedPayload.of_model(box)
    >>> slower = retime(LineTrajectory(line_time=1.0), carried)
    >>> check_path(slower, carried).feasible
    True
    """
    if mode not in RETIMINGS:
        raise InputError(f"`mode` must be one of {', '.join(RETIMINGS)}, got {mode!r}")
    limits = limits or PathLimits()
    moves = [part for part in parts_of(trajectory) if isinstance(part, Move)]
    laws: list[Law] = []
    for move in moves:
        keeps = mode == "slower" or move.name == "lift"
        if keeps and _possible(move, 1.0, trajectory.yaw, carried, limits):
            laws.append(1.0)
            continue
        wanted = move.duration if keeps else 0.0
        law = best_law(move, carried, limits, trajectory.yaw, wanted, optimize=mode == "fastest")
        if law is None:
            why = _why_not(trajectory, carried, limits)
            raise JobError(f"no timing makes the phase {move.name!r} possible: {why}")
        laws.append(law)
    if all(law == 1.0 for law in laws):
        return trajectory
    return _joined(trajectory, moves, laws, carried, limits)


def slowing_factor(
    trajectory: Trajectory, carried: CarriedPayload, limits: PathLimits | None = None
) -> float:
    """Return the factor by which all moves must be slowed to be possible, infinite for none."""
    limits = limits or PathLimits()
    moves = [part for part in parts_of(trajectory) if isinstance(part, Move)]

    def factor_of(move: Move) -> float:
        return _least_factor(
            lambda k: _possible(move, k, trajectory.yaw, carried, limits),
        )

    return max((factor_of(move) for move in moves), default=1.0)


def best_law(
    move: Move,
    carried: CarriedPayload,
    limits: PathLimits,
    yaw: float,
    wanted: float = 0.0,
    *,
    optimize: bool = False,
) -> Law | None:
    """Return the fastest law that was found for a move, slowed to `wanted` [s] if it is faster.

    Candidates are the move's own timing, the motions of `fastest_progress`, whose jumps of
    acceleration a spline rounds, and, with `optimize`, the best of those improved by `faster_law`.
    Each is scaled to keep all limits. None if no law does.
    """
    best: Law | None = None
    spline: SplineLaw | None = None
    for law in _candidates(move, carried, limits, yaw):
        scaled = _scaled(law, best, move, carried, limits, yaw)
        best = best if scaled is None else scaled
        if isinstance(law, SplineLaw):
            spline = scaled if isinstance(scaled, SplineLaw) else spline or law
    if optimize and spline is not None and best is not None:
        law = faster_law(spline, move, carried, limits, yaw)
        scaled = _scaled(law, best, move, carried, limits, yaw)
        best = best if scaled is None else scaled
    if best is None:
        return None
    return slowed(best, max(1.0, wanted / duration_of(best, move.duration)))


def _scaled(
    law: Law,
    best: Law | None,
    move: Move,
    carried: CarriedPayload,
    limits: PathLimits,
    yaw: float,
) -> Law | None:
    """Return a law scaled to keep all limits; None if it is slower than the best one."""

    def possible(factor: float) -> bool:
        return _possible(move, slowed(law, factor), yaw, carried, limits)

    own = duration_of(law, move.duration)
    # One check tells whether a law can be faster than the best one.
    if best is not None and not possible(0.99 * duration_of(best, move.duration) / own):
        return None
    factor = _least_factor(possible, lowest=0.2)
    return slowed(law, factor) if np.isfinite(factor) else None


def _candidates(
    move: Move, carried: CarriedPayload, limits: PathLimits, yaw: float
) -> Iterator[Law]:
    """Yield laws of a move, not yet scaled."""
    yield 1.0
    for share in _SHARES:
        try:
            times, progress = fastest_progress(move, carried, limits, yaw, share)
        except RuntimeError:
            continue
        for spacing in _SPACINGS:
            yield _rounded(times, progress, spacing)


def _rounded(times: Array, progress: Array, spacing: float) -> SplineLaw:
    """Return the law whose control points lie on a motion."""
    count = max(2, int(np.ceil(times[-1] / spacing)) + 1)
    points = np.interp(np.linspace(0.0, times[-1], count), times, progress)
    return SplineLaw(float(times[-1]) / (count - 1), tuple(np.maximum.accumulate(points).tolist()))


def _least_factor(possible: Callable[[float], bool], lowest: float = 1.0) -> float:
    """Return the least factor, from `lowest` on, for which a scaled motion is possible.

    Infinite if there is none up to 50.
    """
    if possible(lowest):
        return lowest
    low, high = lowest, 1.1 * lowest
    while not possible(high):
        low, high = high, 1.3 * high
        if high > _SLOWEST:
            return np.inf
    while high / low > 1.0 + _PRECISION:
        middle = np.sqrt(low * high)
        low, high = (low, middle) if possible(middle) else (middle, high)
    return float(high)


def _possible(
    move: Move, law: Law, yaw: float, carried: CarriedPayload, limits: PathLimits
) -> bool:
    """Return whether a move under a law keeps all limits but the clearances."""
    demands = path_demands(MoveTrajectory.of(move, law, yaw), carried, limits)
    return all(demand.kept for demand in demands)


def _joined(
    trajectory: Trajectory,
    moves: list[Move],
    laws: list[Law],
    carried: CarriedPayload,
    limits: PathLimits,
) -> Trajectory:
    """Return the trajectory under laws; moves that disturb their neighbours are slowed."""
    for _ in range(_ROUNDS):
        retimed = RetimedTrajectory(
            start=trajectory.start, yaw=trajectory.yaw, base=trajectory, laws=tuple(laws)
        )
        check = check_path(retimed, carried, limits)
        if check.feasible:
            return retimed
        late, begin, k = check.violations[0].time, 0.0, 0
        for part in parts_of(retimed):
            if isinstance(part, Move):
                if begin - _NEAR < late < begin + part.duration + _NEAR:
                    laws[k] = slowed(laws[k], _SLOWED)
                k += 1
            begin += part.duration
    raise JobError(f"no timing makes the path possible: {check.violations[0]}")


def _why_not(trajectory: Trajectory, carried: CarriedPayload, limits: PathLimits) -> str:
    """Return why not even a rest is possible."""
    rest = HoverTrajectory(start=trajectory.start, yaw=trajectory.yaw, hover_time=1.0)
    violations = check_path(rest, carried, limits).violations
    return str(violations[0]).replace("the path", "rest") if violations else "rest is possible"
