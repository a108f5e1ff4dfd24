"""What is known of a payload's weight and of the thrust there is to lift it."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from annotated_types import Len

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.io.records import Positive, record
from drake_aerial.statics.gravity import GRAVITY


@record(frozen=True)
class Lift:
    """Mass of a payload, and masses and thrust limits of the n quadrotors that lift it.

    Raises
    ------
    InputError
        If a number is not positive, or the tuples differ in length.
    """

    payload_mass: Positive
    """Mass of the payload [kg]."""
    max_thrust: Annotated[tuple[Positive, ...], Len(1)]
    """Largest total thrust of each quadrotor [N]."""
    quadrotor_mass: tuple[Positive, ...]
    """Mass of each quadrotor [kg]."""

    def __post_init__(self) -> None:
        if len(self.quadrotor_mass) != len(self.max_thrust):
            raise InputError(
                f"`quadrotor_mass` must have {len(self.max_thrust)} entries like max_thrust, "
                f"got {len(self.quadrotor_mass)}"
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
