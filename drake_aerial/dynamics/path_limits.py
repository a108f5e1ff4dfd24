"""Limits that a path must keep, with their margins; and the team and payload on the path."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from annotated_types import Lt

from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.geometry import Array
from drake_aerial.io.records import NonNegative, Positive, Vector, record


@record(frozen=True)
class PathLimits:
    """Margins and limits of the check of a path before take-off.

    Examples
    --------
    >>> from drake_aerial import FlightOptions, PathLimits
    >>> FlightOptions(path_limits=PathLimits(thrust_margin=0.1)).path_limits.tilt
    1.05
    """

    thrust_margin: Annotated[NonNegative, Lt(1.0)] = 0.15
    """Fraction of the thrust between hover and a limit that stays free (dimensionless)."""
    tilt: Annotated[Positive, Lt(np.pi / 2)] = 1.05
    """Largest angle between a quadrotor's thrust and the vertical [rad]."""
    tension: Annotated[NonNegative, Lt(1.0)] = 0.05
    """Lowest tension of a cable, as a fraction of its tension at rest (dimensionless)."""
    gripper_margin: Annotated[NonNegative, Lt(1.0)] = 0.1
    """Part of a gripper's holding force beyond its load at rest that stays free (dimensionless)."""
    distance: NonNegative = 0.05
    """Smallest free distance between the rotor guards of two quadrotors [m], or half of that at
    rest if this is smaller."""
    clearance: NonNegative = 0.02
    """Smallest free distance between a quadrotor's rotor guard and the payload [m], or half of that
    at rest if this is smaller."""


LIMITS = PathLimits()
"""The limits of a flight that names none."""


@dataclass(frozen=True, eq=False)
class CarriedPayload:
    """A payload on the cables of a team, as the check of a path needs it.

    Attributes
    ----------
    model : PayloadModelParameters
        Mass properties and drag of the plant, not those that a controller believes in.
    normal_L : (n, 3) array
        Outward unit normals at the contacts, in L.
    holding_force : (n,) array
        Pull along the normal above which each gripper lets go [N]; may be infinite.
    guard_radius : (n,) array
        Radius of the rotor guard of each quadrotor [m].
    vertices, faces : (V, 3) array [m], (F, 3) int array
        Surface of the payload in L; empty to leave the clearance unchecked.
    winds : tuple of (3,) tuples
        Velocities of the air in the world for each of which a path must be possible [m/s]; they
        count only if the model has air.

    Examples
    --------
    >>> import numpy as np
    >>> from drake_aerial import CarriedPayload
    >>> from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
    >>> box = PayloadModelParameters(0.25, 0.006 * np.eye(3), [[0.0, 0.0, 0.1]])
    >>> CarriedPayload.of_model(box).holding_force
    array([inf])
    """

    model: PayloadModelParameters
    normal_L: Array
    holding_force: Array
    guard_radius: Array
    vertices: Array = field(default_factory=lambda: np.zeros((0, 3)), repr=False)
    faces: Array = field(default_factory=lambda: np.zeros((0, 3), dtype=int), repr=False)
    winds: tuple[Vector, ...] = ((0.0, 0.0, 0.0),)

    @classmethod
    def of_model(cls, model: PayloadModelParameters) -> CarriedPayload:
        """Return a payload that is given by its model only.

        Grippers hold any load along the upward normal, quadrotors are points, and the clearance of
        the payload is not checked.
        """
        n = model.n
        up = np.tile([0.0, 0.0, 1.0], (n, 1))
        return cls(model, up, np.full(n, np.inf), np.zeros(n))
