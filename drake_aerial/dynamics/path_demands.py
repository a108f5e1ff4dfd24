"""Demands of a path on thrusts, cables, grippers and distances, with their limits."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from drake_aerial.dynamics.flatness import Reference
from drake_aerial.dynamics.path_limits import CarriedPayload, PathLimits
from drake_aerial.geometry import Array

CROSSING = "cable through payload"
"""Name of the demand of a cable that crosses the payload."""


class Demand(NamedTuple):
    """Value of one quantity on a path, at the time of its smallest margin, and its limit.

    Attributes
    ----------
    what : str
        "thrust", "least thrust", "tilt", "tension", "gripper", "distance", "clearance", "cable
        through payload", "position step" or "velocity step".
    value, limit : float
        Value on the path, and the limit less the margin of `PathLimits`.
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
            "thrust": f"the path needs {value} N {where}, the propellers of quadrotor {i} give "
            f"at most {limit} N with the margin",
            "least thrust": f"the path needs only {value} N of quadrotor {i} {where}, its "
            f"propellers give at least {limit} N with the margin",
            "tilt": f"the path needs a tilt of {value} rad {where} of quadrotor {i}, the limit is "
            f"{limit} rad",
            "tension": f"the path leaves cable {i} a tension of {value} N {where}, it must have "
            f"{limit} N to stay taut",
            "gripper": f"the path pulls at gripper {i} with {value} N {where}, it holds at most "
            f"{limit} N with the margin",
            "distance": f"the path brings quadrotor {i} to {value} m of another {where}, guard to "
            f"guard; the limit is {limit} m",
            "clearance": f"the path brings the guard of quadrotor {i} to {value} m of the payload "
            f"{where}, the limit is {limit} m",
            CROSSING: f"the path pulls cable {i} through the payload {where}",
            "position step": f"the path jumps by {value} m {where}",
            "velocity step": f"the path has a velocity step of {value} m/s {where}",
        }
        return sentences[self.what]


def force_demands(
    carried: CarriedPayload, limits: PathLimits, t: Array, reference: Reference, rest: Reference
) -> Iterator[Demand]:
    """Yield the demands of a reference on thrusts, tilts, tensions and grippers.

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
        choose = largest if quantity.upper else smallest
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
    least = _shortened(model.min_thrust, hover, margin, upper=False)
    quantities = [
        Quantity("thrust", "N", thrust, _shortened(model.max_thrust, hover, margin)),
        Quantity("least thrust", "N", thrust, least, False),
        Quantity("tilt", "rad", tilt, np.full(model.n, limits.tilt)),
    ]
    taut = np.maximum(limits.tension * _tensions(rest)[0], 0.0)
    quantities.append(Quantity("tension", "N", _tensions(reference), taut, False))
    if np.isfinite(carried.holding_force).any():
        load = _pulls(carried, rest)[0]
        held = _shortened(carried.holding_force, load, limits.gripper_margin)
        quantities.append(Quantity("gripper", "N", _pulls(carried, reference), held))
    return quantities


def _shortened(limits: Array, rest: Array, margin: float, *, upper: bool = True) -> Array:
    """Return limits that are closer to rest by a part of their distance from it.

    A limit that rest exceeds stays as it is.
    """
    side = 1.0 if upper else -1.0
    with np.errstate(invalid="ignore"):
        left = np.maximum(side * (limits - rest), 0.0)
        kept: Array = np.where(np.isfinite(limits), limits - side * margin * left, limits)
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


def largest(what: str, unit: str, t: Array, values: Array, limits: Array) -> Demand:
    """Return the demand of values (T, n) that have upper limits (n,)."""
    k, i = np.unravel_index(int(np.argmax(values - limits)), values.shape)
    return Demand(what, float(values[k, i]), float(limits[i]), unit, float(t[k]), int(i) + 1)


def smallest(what: str, unit: str, t: Array, values: Array, limits: Array) -> Demand:
    """Return the demand of values (T, n) that have lower limits (n,)."""
    k, i = np.unravel_index(int(np.argmin(values - limits)), values.shape)
    low = float(limits[i])
    return Demand(what, float(values[k, i]), low, unit, float(t[k]), int(i) + 1, upper=False)
