"""Check of a path before take-off: its demands, by differential flatness, and their limits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from drake_aerial.dynamics.flatness import GRID, Reference, ReferenceTable
from drake_aerial.dynamics.path_clearance import clearances, free_distances
from drake_aerial.dynamics.path_demands import CROSSING, Demand, force_demands
from drake_aerial.dynamics.path_limits import CarriedPayload, PathLimits
from drake_aerial.geometry import Array
from drake_aerial.io.records import Vector
from drake_aerial.references.trajectory import Trajectory

_POSITION_STEP, _VELOCITY_STEP = 1e-3, 0.05
"""Largest steps of position [m] and velocity [m/s] between two segments of a path."""
BEFORE = np.array([-np.inf])
"""A time before every path, for `ReferenceTable.at`: at rest [s]."""


@dataclass(frozen=True)
class PathCheck:
    """Result of the check of a path.

    Attributes
    ----------
    demands : tuple of Demand
        One for each quantity that was checked.
    limits : PathLimits
    winds : tuple of (3,) tuples
        Velocities of the air for which the path was checked [m/s].
    unchecked : tuple of str
        What was not checked, with the reason.

    Examples
    --------
    >>> import numpy as np
    >>> from drake_aerial import CarriedPayload, check_path
    >>> from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
    >>> from drake_aerial.references.trajectory import LineTrajectory
    >>> box = PayloadModelParameters(0.25, 0.006 * np.eye(3), [[0.0, 0.0, 0.1]])
    >>> check = check_path(LineTrajectory(), CarriedPayload.of_model(box))
    >>> check.feasible, [demand.what for demand in check.demands if demand.unit == "N"]
    (True, ['thrust', 'least thrust', 'tension'])
    """

    demands: tuple[Demand, ...]
    limits: PathLimits
    winds: tuple[Vector, ...] = ((0.0, 0.0, 0.0),)
    unchecked: tuple[str, ...] = ()

    @property
    def feasible(self) -> bool:
        """True if every limit is kept; a cable that crosses the payload is a warning."""
        return not self.violations

    @property
    def violations(self) -> tuple[Demand, ...]:
        """The demands that exceed their limits, without warnings."""
        return tuple(d for d in self.demands if not (d.kept or d.what == CROSSING))

    @property
    def warnings(self) -> tuple[Demand, ...]:
        """Cables that cross the payload: the plant does not model their contact."""
        return tuple(d for d in self.demands if d.what == CROSSING and not d.kept)

    def to_dict(self) -> dict[str, Any]:
        """Return the result as JSON values, for the record of a flight."""
        return {
            "feasible": self.feasible,
            "margins": {
                d.what: {
                    "value": round(d.value, 4),
                    "limit": round(d.limit, 4) if np.isfinite(d.limit) else str(d.limit),
                    "unit": d.unit,
                    "time_s": round(d.time, 3),
                    "quadrotor": d.number,
                }
                for d in self.demands
            },
            "limits": asdict(self.limits),
            "winds": [list(wind) for wind in self.winds],
            "unchecked": list(self.unchecked),
        }


def check_path(
    trajectory: Trajectory, carried: CarriedPayload, limits: PathLimits | None = None
) -> PathCheck:
    """Check whether a team can fly a path with its payload.

    Thrusts, cable directions and attitude follow from the path by differential flatness: they are
    the reference that `PayloadMpc` tracks.

    Parameters
    ----------
    trajectory : Trajectory
    carried : CarriedPayload
    limits : PathLimits, optional

    Notes
    -----
    Jumps of the acceleration are averaged over `flatness.SMOOTHING`, as in the reference. Before
    the lift the payload stands on the ground; the path is checked as if it hung there at rest.

    Examples
    --------
    >>> import numpy as np
    >>> from drake_aerial import CarriedPayload, check_path
    >>> from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
    >>> from drake_aerial.references.trajectory import LineTrajectory
    >>> box = PayloadModelParameters(0.25, 0.006 * np.eye(3), [[0.0, 0.0, 0.1]])
    >>> check = check_path(LineTrajectory(line_time=1.0), CarriedPayload.of_model(box))
    >>> check.feasible, check.violations[0].what
    (False, 'thrust')
    """
    limits = limits or PathLimits()
    demands = path_demands(trajectory, carried, limits)
    unchecked: tuple[str, ...] = ()
    if len(carried.faces):
        found = [
            clearances(carried, limits, *_sampled(trajectory, carried, wind)[:2])
            for wind in winds_of(carried)
        ]
        demands += _worst(found)
    else:
        unchecked = ("clearance of the payload: its surface is not known",)
    return PathCheck(tuple(demands), limits, winds_of(carried), unchecked)


def winds_of(carried: CarriedPayload) -> tuple[Vector, ...]:
    """Return the winds for which a path is checked; only still air if the model has no air."""
    return carried.winds if carried.model.air is not None else ((0.0, 0.0, 0.0),)


def path_demands(
    trajectory: Trajectory, carried: CarriedPayload, limits: PathLimits
) -> list[Demand]:
    """Return the demands of a path except the clearance from the payload, which takes longer."""
    found = []
    for wind in winds_of(carried):
        t, reference, rest = _sampled(trajectory, carried, wind)
        demands = [*force_demands(carried, limits, t, reference, rest)]
        found.append([*demands, *free_distances(carried, limits, t, reference)])
    return [*_steps(trajectory), *_worst(found)]


def _sampled(
    trajectory: Trajectory, carried: CarriedPayload, wind: Vector
) -> tuple[Array, Reference, Reference]:
    """Return times (T,) [s], the reference there, and at rest (batch 1)."""
    t: Array = np.arange(np.ceil(trajectory.duration / GRID) + 1.0) * GRID
    table = table_of(carried, trajectory, wind)
    return t, table.at(t), table.at(BEFORE)


def table_of(carried: CarriedPayload, trajectory: Trajectory, wind: Vector) -> ReferenceTable:
    """Return the table of a trajectory in a wind."""
    return ReferenceTable(carried.model, trajectory, wind if any(wind) else None)


def _worst(found: list[list[Demand]]) -> list[Demand]:
    """Return of lists of the same demands, one for each wind, those with the least margins."""
    return [min(demands, key=lambda demand: demand.margin) for demands in zip(*found)]


def _steps(trajectory: Trajectory) -> Iterator[Demand]:
    """Yield the largest steps of position and velocity between two segments, and at both ends."""
    ends = np.zeros((2, 3))
    ends[0] = trajectory.start
    begin, times, steps = 0.0, [0.0], [np.zeros(2)]
    for segment in trajectory.segments:
        stack = segment.derivatives(np.array([0.0, segment.duration]))[:2]
        times.append(begin)
        steps.append(np.linalg.norm(stack[:, 0] - ends, axis=1))
        ends, begin = stack[:, 1], begin + segment.duration
    times.append(begin)
    steps.append(np.array([0.0, np.linalg.norm(ends[1])]))
    table = np.array(steps)
    limits = (("position step", "m", _POSITION_STEP), ("velocity step", "m/s", _VELOCITY_STEP))
    for k, (what, unit, limit) in enumerate(limits):
        worst = int(np.argmax(table[:, k]))
        yield Demand(what, float(table[worst, k]), limit, unit, times[worst], 1)
