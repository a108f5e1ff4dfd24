"""What is known of a payload's weight and of the thrust there is to lift it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.statics.gravity import GRAVITY


@dataclass(frozen=True)
class Lift:
    """The payload's mass, and what each quadrotor lifts, its own weight included.

    Attributes
    ----------
    payload_mass : float
        [kg].
    max_thrust : tuple of n floats
        Largest total thrust of each quadrotor [N].
    quadrotor_mass : tuple of n floats
        [kg].

    Raises
    ------
    InputError
        If a number is not positive, or the tuples differ in length.
    """

    payload_mass: float
    max_thrust: tuple[float, ...]
    quadrotor_mass: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.max_thrust) != len(self.quadrotor_mass) or not self.max_thrust:
            raise InputError(
                f"max_thrust and quadrotor_mass should have one number per quadrotor each, got {len(self.max_thrust)} "
                f"and {len(self.quadrotor_mass)}"
            )
        numbers = np.array([self.payload_mass, *self.max_thrust, *self.quadrotor_mass], float)
        if not np.all(np.isfinite(numbers) & (numbers > 0.0)):
            raise InputError(
                f"masses and thrusts should be positive and finite, got {numbers.tolist()}"
            )

    @property
    def weight(self) -> float:
        """The payload's weight [N]."""
        return GRAVITY * self.payload_mass

    def largest_tension(self, direction: Array) -> Array:
        """Return the largest tension (n,) [N] that each quadrotor holds at rest along its cable.

        The thrust balances tension and own weight: |T d + m g e_z| = max_thrust; zero where it does not lift itself.

        Parameters
        ----------
        direction : (n, 3) array
            Unit directions from each gripper to its quadrotor, z up.
        """
        own, thrust = GRAVITY * np.asarray(self.quadrotor_mass), np.asarray(self.max_thrust)
        up = own * direction[:, 2]
        room = thrust**2 - own**2
        return np.where(room > 0.0, np.sqrt(np.maximum(up**2 + room, 0.0)) - up, 0.0)
