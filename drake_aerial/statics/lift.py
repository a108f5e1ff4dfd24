"""Lift of quadrotors: the largest tension of each cable, and overload by a level payload."""

from typing import Annotated

import numpy as np
from annotated_types import Len

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.io.records import Positive, record
from drake_aerial.statics.gravity import GRAVITY
from drake_aerial.statics.tensions import level_balance


@record(frozen=True)
class Lift:
    """Mass of a payload, and masses and thrust limits of the n quadrotors that lift it.

    Raises
    ------
    InputError
        If a number is not positive and finite, or the tuples are empty or differ in length.
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
        """Return the largest cable tension (n,) [N] at which each quadrotor can hover.

        The thrust balances tension and own weight: |T d + m g e_z| = max_thrust. Zero for a
        quadrotor that cannot lift itself.

        Parameters
        ----------
        direction : (n, 3) array
            Unit directions from each gripper to its quadrotor, z up.
        """
        own, thrust = GRAVITY * np.asarray(self.quadrotor_mass), np.asarray(self.max_thrust)
        up = own * direction[:, 2]
        room = thrust**2 - own**2
        return np.where(room > 0.0, np.sqrt(np.maximum(up**2 + room, 0.0)) - up, 0.0)


def smallest_overload(p_LoC: Array, weight: float, spare: Array) -> tuple[float, Array] | None:
    """Return the smallest overload [N] of vertical cables that hold a payload level.

    Parameters
    ----------
    p_LoC : (n, 3) array
        Contacts from the payload's centre of mass [m].
    weight : float
        Weight of the payload [N].
    spare : (n,) array
        Tension that each quadrotor can bear [N].

    Returns
    -------
    (float, (n,) array) or None
        The largest excess of a tension over `spare` [N], as small as the tensions can make it, and
        those tensions [N]. None if no non-negative tensions hold the payload level.
    """
    from scipy.optimize import linprog

    n = len(p_LoC)
    A, b = level_balance(p_LoC, weight)
    # Unknowns: the tensions, and the largest excess.
    best = linprog(
        np.append(np.zeros(n), 1.0),
        A_ub=np.hstack([np.eye(n), -np.ones((n, 1))]),
        b_ub=spare,
        A_eq=np.hstack([A, np.zeros((len(A), 1))]),
        b_eq=b,
        bounds=[*[(0.0, None)] * n, (None, None)],
    )
    return (float(best.fun), np.asarray(best.x[:n], float)) if best.success else None
