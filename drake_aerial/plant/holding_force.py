"""Holding forces of grippers: the cable tensions that pull a gripper off its payload."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_aerial.geometry import Array
from drake_aerial.plant.cable import Cable
from drake_aerial.statics.gravity import GRAVITY


class HoldingForces:
    """Holding forces of the grippers of n cables.

    Attributes
    ----------
    limit : (n,) array
        Holding force along the contact's normal [N]; infinite for a gripper that never lets go.
    """

    def __init__(self, cables: list[Cable]):
        self.limit = np.array([cable.gripper.parameters.holding_force for cable in cables])
        self._normal_L = np.stack([cable.gripper.normal_L for cable in cables])

    @property
    def are_finite(self) -> bool:
        """True if a gripper has a finite holding force, so that it can release."""
        return bool(np.isfinite(self.limit).any())

    def exceeded(self, tension: Array, xi: Array, R_WL: Array) -> NDArray[np.bool_]:
        """Return which grippers (n,) are pulled by more than their holding force.

        Parameters
        ----------
        tension : (n,) array [N]
        xi : (n, 3) array
            Cable directions in the world, from quadrotor to contact.
        R_WL : (3, 3) array
            Rotation of the payload.
        """
        normal_W = self._normal_L @ R_WL.T
        pull = tension * np.maximum(0.0, -np.einsum("ij,ij->i", xi, normal_W))
        return pull > self.limit


def safe_slide_rate(cable: Cable, time_step: float) -> float:
    """Return the rate of a cable's prismatic joint below which no overload is possible [m/s].

    A taut cable pulls with less than 1.5 times the thrust and weight of its quadrotor, swinging
    included. A larger tension needs an impact, which stops the quadrotor's mass within one step.
    """
    quadrotor = cable.quadrotor.parameters
    steady = 1.5 * (quadrotor.thrust_limits[1] + quadrotor.mass * GRAVITY)
    return (cable.gripper.parameters.holding_force - steady) * time_step / quadrotor.mass
