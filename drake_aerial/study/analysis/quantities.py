"""What the study measures of a flight: key in the records, words, unit, and how it is written."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

# Colours that stay apart for every kind of colour vision (Okabe and Ito); one a method, everywhere.
METHOD_COLORS = {
    "task": "#0072B2",
    "paper": "#009E73",
    "kopicki": "#D55E00",
    "centroid": "#7F7F7F",
    "control": "#CC79A7",
    "head": "#0072B2",
    "middle": "#E69F00",
    "thigh": "#D55E00",
}
# And one line style and mark each, for prints without colour.
METHOD_LINES = {
    "task": "-",
    "paper": "--",
    "kopicki": "-.",
    "centroid": ":",
    "middle": "--",
    "thigh": "-.",
}
METHOD_MARKS = {
    "task": "o",
    "paper": "s",
    "kopicki": "^",
    "centroid": "D",
    "middle": "s",
    "thigh": "^",
}
METHOD_ORDER = ("task", "paper", "kopicki", "control", "centroid", "head", "middle", "thigh")
METHOD_WORDS = {
    "task": "this package's method: the demonstration's edges vote for where the gripper belongs, relative to the object's size",
    "paper": "the paper's method as published: the same votes, as rigid displacements, by sampling",
    "kopicki": "the baseline: the surface must look like the demonstrated one, anywhere on the object (Kopicki et al., 2016)",
    "control": "this package's method without its votes",
    "centroid": "no learning at all: the surface point above the middle of what is seen",
    "head": "contact given: on the bunny's head",
    "middle": "contact given: on the middle of the bunny's back",
    "thigh": "contact given: on the bunny's thigh",
}
BELIEF_ORDER = ("below_contact", "geometric", "true")
BELIEF_WORDS = {
    "below_contact": "the controller takes the centre of mass to lie straight below the contact",
    "geometric": "the controller takes the centre of mass to be the middle of the scan's hull",
    "true": "the controller knows the true centre of mass",
}
INERTIA_ORDER = ("table", "mesh")
INERTIA_WORDS = {
    "table": "mass and moments of inertia of the paper's table, the same for every payload",
    "mesh": "moments of inertia of the payload's own shape, of uniform density",
}
FAILURES = ("dropped", "crashed", "diverged")


@dataclass(frozen=True)
class Quantity:
    """One number of a flight.

    Attributes
    ----------
    key : str
        In a record's metrics, in SI units.
    name : str
        In words.
    unit : str
        As written.
    factor : float
        From SI to `unit`.
    digits : int
        Behind the point.
    """

    key: str
    name: str
    unit: str
    factor: float
    digits: int = 1

    def write(self, value: float | None, sign: bool = False) -> str:
        """Return a value in SI as text in `unit`, without the unit; a dash for None."""
        if value is None:
            return "–"
        text = f"{self.factor * value:{'+' if sign else ''}.{self.digits}f}"
        return text.replace("-", "−")


DEGREES = 57.29577951308232
QUANTITIES = (
    Quantity("position_rmse_m", "distance from the path, RMS", "cm", 100.0),
    Quantity("velocity_rmse_m_s", "velocity error, RMS", "cm/s", 100.0),
    Quantity("attitude_rmse_rad", "attitude error, RMS", "°", DEGREES),
    Quantity("position_max_m", "distance from the path, peak", "cm", 100.0),
    Quantity("tilt_mean_rad", "tilt, mean", "°", DEGREES),
    Quantity("tilt_max_rad", "tilt, peak", "°", DEGREES),
    Quantity("thrust_mean_N", "thrust per quadrotor, mean", "N", 1.0, 3),
    Quantity("thrust_max_N", "thrust per quadrotor, peak", "N", 1.0, 2),
    Quantity("moment_rms_N_m", "moment per quadrotor, RMS", "mN m", 1000.0, 2),
    Quantity("slack_fraction", "time with a slack cable", "%", 100.0),
    Quantity("saturated_fraction", "time at a propeller's limit", "%", 100.0, 2),
    Quantity("tension_max_N", "cable tension, peak", "N", 1.0, 2),
)
BY_KEY = {quantity.key: quantity for quantity in QUANTITIES}
MAIN = "position_rmse_m"
"""The one by which contacts are judged first."""


_OTHER_COLORS = ("#56B4E9", "#E69F00", "#CC79A7", "#B8A500", "#000000")


def method_color(method: str) -> str:
    """Return the colour of a method, or of contacts that a plan gives by a name of its own."""
    return (
        METHOD_COLORS.get(method) or _OTHER_COLORS[zlib.crc32(method.encode()) % len(_OTHER_COLORS)]
    )


def position(order: tuple[str, ...], name: str) -> tuple[int, str]:
    """Return a sorting key: the place in `order`; names that are not in it come last, by the alphabet."""
    return (order.index(name) if name in order else len(order), name)
