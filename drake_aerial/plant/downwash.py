"""Downwash: the share of a quadrotor's jet that meets the payload below it, by momentum."""

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.quadrotor import QuadrotorParameters

SPREAD = 0.194
"""Tangent of the angle, 11 degrees, by which a free jet widens to each side (Rajaratnam, Turbulent
Jets, 1976)."""
ROTOR_RADIUS = 0.62
"""Radius of a propeller over the quadrotor's arm, as drawn."""


def downwash_share(
    payload: Payload,
    p_PC: Array,
    cable_length: float,
    quadrotor: QuadrotorParameters | None = None,
    samples: int = 101,
) -> float:
    """Return the share of the thrust that the jet puts on a level payload, from 0 to 1.

    The jets of the four propellers are taken as one. It begins with the radius that the rotors
    reach, widens by `SPREAD` and keeps its momentum, which is the thrust, with a Gaussian profile:
    86 % of it within the radius. What meets the horizontal outline of the payload's hull is turned
    aside and presses with all of its momentum; the rest passes by.

    Parameters
    ----------
    payload : Payload
    p_PC : (3,) array
        Contact in P [m]; the quadrotor is straight above it.
    cable_length : float
        [m]
    quadrotor : QuadrotorParameters, optional
    samples : int
        Number of points along each axis at which the jet is sampled.

    Raises
    ------
    InputError
        If the length is not positive.
    """
    if not (np.isfinite(cable_length) and cable_length > 0.0):
        raise InputError(f"`cable_length` must be in (0, inf) m, got {cable_length!r}")
    from matplotlib.path import Path as Outline
    from scipy.spatial import ConvexHull

    quadrotor = quadrotor or QuadrotorParameters()
    corners = payload.vertices[:, :2]
    outline = Outline(corners[ConvexHull(corners).vertices])
    radius = (1.0 + ROTOR_RADIUS) * quadrotor.arm + SPREAD * cable_length
    axis = np.linspace(-2.0 * radius, 2.0 * radius, samples)
    x, y = np.meshgrid(axis, axis)
    momentum = np.exp(-2.0 * (x**2 + y**2) / radius**2)
    points = np.stack([x.ravel(), y.ravel()], axis=1) + np.asarray(p_PC, dtype=float)[:2]
    met = outline.contains_points(points).reshape(x.shape)
    return float((momentum * met).sum() / momentum.sum())
