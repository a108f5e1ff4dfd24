"""Accepted names of methods, beliefs, controllers and cables, for library and command line.

Importing this module loads nothing else, so the command line can list the names in its help.
"""

from typing import Literal, get_args

METHODS = {
    "task": ("hull", "normalised"),
    "paper": ("paper", "resampled"),
    "kopicki": ("none", "resampled"),
    "control": ("none", "normalised"),
    "registration": ("none", "none"),
    "obb": ("none", "none"),
    "centroid": ("none", "none"),
}
"""Method of `transfer` to (votes, sampling). `control` is `task` without its votes."""
BASELINES = tuple(method for method, (_, sampling) in METHODS.items() if sampling == "none")
"""Methods without densities."""
Method = Literal["task", "paper", "kopicki", "control", "registration", "obb", "centroid"]
Belief = Literal["below_contact", "geometric", "true"]
BELIEFS: tuple[Belief, ...] = get_args(Belief)
"""Source of the centre of mass and inertia that a controller assumes."""
ControllerKind = Literal["mpc", "geometric_ff", "geometric"]
CONTROLLERS: tuple[ControllerKind, ...] = get_args(ControllerKind)
"""Kinds of controllers."""
CableKind = Literal["inextensible", "elastic"]
CABLES: tuple[CableKind, ...] = get_args(CableKind)
"""Kinds of cables."""
Retiming = Literal["slower", "fastest"]
RETIMINGS: tuple[Retiming, ...] = get_args(Retiming)
"""Ways to change the timing of a path before take-off."""
SensorLevel = Literal["payload", "cables", "vehicles"]
SENSOR_LEVELS: tuple[SensorLevel, ...] = get_args(SensorLevel)
"""What the sensors of a flight measure."""
