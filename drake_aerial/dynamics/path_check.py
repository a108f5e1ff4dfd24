"""Check of a path before take-off: what it needs, by differential flatness, and what there is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from drake_aerial.dynamics.flatness import GRID, Reference, ReferenceTable
from drake_aerial.dynamics.path_clearance import cables_inside, surface_distances
from drake_aerial.dynamics.path_limits import CarriedPayload, PathLimits
from drake_aerial.geometry import Array
from drake_aerial.io.records import Vector
from drake_aerial.references.trajectory import Trajectory

_POSITION_STEP, _VELOCITY_STEP = 1e-3, 0.05
"""Largest steps of position [m] and velocity [m/s] between two segments of a path."""
BEFORE = np.array([-np.inf])
"""A time before every path, for `ReferenceTable.at`: at rest [s]."""
_ROUNDING = 0.02
"""Positions in L that are closer than this count as one for the clearance [m]."""


class Demand(NamedTuple):
    """What a path needs of one quantity where it is closest to, or farthest beyond, its limit.

    Attributes
    ----------
    what : str
        "thrust", "least thrust", "tilt", "tension", "gripper", "distance", "clearance", "cable
        through payload", "position step" or "velocity step".
    value, limit : float
        What the path needs, and what it may need: the limit with its margin.
    unit : str
    time : float
        Time on the path [s].
    number : int
        Number of the quadrotor, from 1.
    upper : bool
        True if the value must not exceed the limit, False if it must reach it.
    """

    what: str
    value: float
    limit: float
    unit: str
    time: float
    number: int
    upper: bool = True

    @property
    def kept(self) -> bool:
        """True if the limit is kept."""
        return self.value <= self.limit if self.upper else self.value >= self.limit

    @property
    def margin(self) -> float:
        """Distance to the limit in the quantity's unit; negative beyond it."""
        return self.limit - self.value if self.upper else self.value - self.limit

    def __str__(self) -> str:
        value, limit, where = f"{self.value:.2f}", f"{self.limit:.2f}", f"at t = {self.time:.2f} s"
        i = self.number
        sentences = {
            "thrust": f"the path needs {value} N {where}, the propellers of quadrotor {i} have "
            f"{limit} N with the margin",
            "least thrust": f"the path lets quadrotor {i} pull only {value} N {where}, its "
            f"propellers cannot pull less than {limit} N with the margin",
            "tilt": f"the path needs a tilt of {value} rad {where} of quadrotor {i}, the limit is "
            f"{limit} rad",
            "tension": f"the path leaves cable {i} a tension of {value} N {where}, it must have "
            f"{limit} N to stay taut",
            "gripper": f"the path pulls at gripper {i} with {value} N {where}, it holds {limit} N "
            "with the margin",
            "distance": f"the path brings quadrotor {i} to {value} m of another {where}, guard to "
            f"guard; the limit is {limit} m",
            "clearance": f"the path brings the guard of quadrotor {i} to {value} m of the payload "
            f"{where}, the limit is {limit} m",
            "cable through payload": f"the path pulls cable {i} through the payload {where}",
            "position step": f"the path jumps by {value} m {where}",
            "velocity step": f"the path has a velocity step of {value} m/s {where}",
        }
        return sentences[self.what]


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
        """True if every limit is kept."""
        return all(demand.kept for demand in self.demands)

    @property
    def violations(self) -> tuple[Demand, ...]:
        """The demands beyond their limits."""
        return tuple(demand for demand in self.demands if not demand.kept)

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
            _clearances(carried, limits, *_sampled(trajectory, carried, wind)[:2])
            for wind in winds_of(carried)
        ]
        demands += _worst(found)
    else:
        unchecked = ("clearance of the payload: its surface is not known",)
    return PathCheck(tuple(demands), limits, winds_of(carried), unchecked)


def winds_of(carried: CarriedPayload) -> tuple[Vector, ...]:
    """Return the winds for which a path is checked; none but still air without air in the model."""
    return carried.winds if carried.model.air is not None else ((0.0, 0.0, 0.0),)


def path_demands(
    trajectory: Trajectory, carried: CarriedPayload, limits: PathLimits
) -> list[Demand]:
    """Return what a path needs, without its clearance from the payload, which takes longer."""
    found = []
    for wind in winds_of(carried):
        t, reference, rest = _sampled(trajectory, carried, wind)
        demands = [*force_demands(carried, limits, t, reference, rest)]
        found.append([*demands, *_distances(carried, limits, t, reference)])
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
    return ReferenceTable(carried.model, trajectory, *((np.array(wind),) if any(wind) else ()))


def _worst(found: list[list[Demand]]) -> list[Demand]:
    """Return of lists of the same demands, one for each wind, those with the least margins."""
    return [min(demands, key=lambda demand: demand.margin) for demands in zip(*found)]


def force_demands(
    carried: CarriedPayload, limits: PathLimits, t: Array, reference: Reference, rest: Reference
) -> Iterator[Demand]:
    """Yield what a reference needs of thrusts, tilts, tensions and grippers.

    Parameters
    ----------
    carried : CarriedPayload
    limits : PathLimits
    t : (T,) array
        Times [s].
    reference, rest : Reference
        As in `force_quantities`.
    """
    for quantity in force_quantities(carried, limits, reference, rest):
        choose = _largest if quantity.upper else _smallest
        yield choose(quantity.what, quantity.unit, t, quantity.values, quantity.limits)


class Quantity(NamedTuple):
    """A quantity of every quadrotor along a reference, and its limits.

    Attributes
    ----------
    what, unit : str
        As in `Demand`.
    values : (T, n) array
    limits : (n,) array
    upper : bool
        True if the limits are upper ones.
    """

    what: str
    unit: str
    values: Array
    limits: Array
    upper: bool = True

    @property
    def margins(self) -> Array:
        """Distances (T, n) to the limits, as fractions of them; negative beyond them."""
        sign = 1.0 if self.upper else -1.0
        return sign * (self.limits - self.values) / np.maximum(self.limits, 1e-3)


def force_quantities(
    carried: CarriedPayload, limits: PathLimits, reference: Reference, rest: Reference
) -> list[Quantity]:
    """Return thrusts, tilts, tensions and loads of the grippers along a reference (batch T).

    Parameters
    ----------
    carried : CarriedPayload
    limits : PathLimits
    reference : Reference
        Batch T.
    rest : Reference
        At rest, batch 1; margins are parts of what is left of a limit there.
    """
    model = carried.model
    thrust, hover = _thrusts(reference), _thrusts(rest)[0]
    tilt = np.arccos(np.clip(reference.F[:, :, 2] / np.maximum(thrust, 1e-9), -1.0, 1.0))
    margin = limits.thrust_margin
    quantities = [
        Quantity("thrust", "N", thrust, _shortened(model.max_thrust, hover, margin)),
        Quantity("least thrust", "N", thrust, _shortened(model.min_thrust, hover, margin), False),
        Quantity("tilt", "rad", tilt, np.full(model.n, limits.tilt)),
    ]
    taut = np.maximum(limits.tension * _tensions(rest)[0], 0.0)
    quantities.append(Quantity("tension", "N", _tensions(reference), taut, False))
    if np.isfinite(carried.holding_force).any():
        load = _pulls(carried, rest)[0]
        held = _shortened(carried.holding_force, load, limits.gripper_margin)
        quantities.append(Quantity("gripper", "N", _pulls(carried, reference), held))
    return quantities


def _shortened(limits: Array, rest: Array, margin: float) -> Array:
    """Return limits that are closer to rest by a part of their distance from it."""
    with np.errstate(invalid="ignore"):
        kept: Array = np.where(np.isfinite(limits), limits - margin * (limits - rest), limits)
    return kept


def _thrusts(reference: Reference) -> Array:
    """Return the thrusts (T, n) [N]."""
    thrusts: Array = np.linalg.norm(reference.F, axis=2)
    return thrusts


def _tensions(reference: Reference) -> Array:
    """Return the tensions (T, n) [N]; negative where a cable would have to push."""
    size = np.linalg.norm(reference.mu, axis=2)
    return np.where(reference.mu[:, :, 2] > 0.0, size, -size)


def _pulls(carried: CarriedPayload, reference: Reference) -> Array:
    """Return the pulls (T, n) at the grippers along their normals [N]."""
    pulls: Array = np.vecdot(reference.mu, carried.normal_L @ np.swapaxes(reference.R, 1, 2))
    return pulls


def _distances(
    carried: CarriedPayload, limits: PathLimits, t: Array, reference: Reference
) -> Iterator[Demand]:
    """Yield the smallest free distance between two quadrotors."""
    n = carried.model.n
    if n < 2:
        return
    p_WQ = _quadrotors(carried, reference) @ np.swapaxes(reference.R, 1, 2)
    gap = np.linalg.norm(p_WQ[:, :, None] - p_WQ[:, None], axis=3)
    gap -= carried.guard_radius[:, None] + carried.guard_radius
    gap[:, np.arange(n), np.arange(n)] = np.inf
    yield _smallest("distance", "m", t, gap.min(axis=2), np.full(n, limits.distance))


def _clearances(
    carried: CarriedPayload, limits: PathLimits, t: Array, reference: Reference
) -> list[Demand]:
    """Return the smallest distance of a guard from the payload, and cables that cross it."""
    p_LQ, n = _quadrotors(carried, reference), carried.model.n
    low, high = carried.vertices.min(axis=0), carried.vertices.max(axis=0)
    outside = np.maximum(np.maximum(low - p_LQ, p_LQ - high), 0.0)
    # The distance from the bounding box is a lower bound.
    distance = np.linalg.norm(outside, axis=2)
    near = distance < (carried.guard_radius + limits.clearance)
    demands = []
    crossed: Demand | None = None
    for i in range(n):
        cells = np.round(p_LQ[:, i] / _ROUNDING).astype(int)
        first = np.unique(cells, axis=0, return_index=True)[1]
        exact = first[near[first, i]]
        if len(exact):
            found = surface_distances(carried.vertices, carried.faces, p_LQ[exact, i])
            distance[:, i] = np.where(near[:, i], np.inf, distance[:, i])
            distance[exact, i] = found
        contacts = np.broadcast_to(carried.model.p_LC[i], (len(first), 3))
        inside = cables_inside(carried.vertices, carried.faces, contacts, p_LQ[first, i])
        if inside.any() and crossed is None:
            when = float(t[first[inside]].min())
            crossed = Demand("cable through payload", 1.0, 0.0, "-", when, i + 1)
    gap = distance - carried.guard_radius
    demands.append(_smallest("clearance", "m", t, gap, np.full(n, limits.clearance)))
    none = Demand("cable through payload", 0.0, 0.0, "-", 0.0, 1)
    return [*demands, crossed or none]


def _quadrotors(carried: CarriedPayload, reference: Reference) -> Array:
    """Return the positions (T, n, 3) of the quadrotors in L [m]."""
    model = carried.model
    up = -(reference.xi @ reference.R)
    positions: Array = model.p_LC + model.cable_length[:, None] * up
    return positions


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


def _largest(what: str, unit: str, t: Array, values: Array, limits: Array) -> Demand:
    """Return the demand of values (T, n) that have upper limits (n,)."""
    k, i = np.unravel_index(int(np.argmax(values - limits)), values.shape)
    return Demand(what, float(values[k, i]), float(limits[i]), unit, float(t[k]), int(i) + 1)


def _smallest(what: str, unit: str, t: Array, values: Array, limits: Array) -> Demand:
    """Return the demand of values (T, n) that have lower limits (n,)."""
    k, i = np.unravel_index(int(np.argmin(values - limits)), values.shape)
    low = float(limits[i])
    return Demand(what, float(values[k, i]), low, unit, float(t[k]), int(i) + 1, upper=False)
