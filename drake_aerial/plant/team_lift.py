"""Lift of a team of quadrotors, from their parameters and those of their cables."""

from collections.abc import Sequence

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.gripper import GripperParameters
from drake_aerial.plant.quadrotor import QuadrotorParameters
from drake_aerial.statics.lift import Lift


def own_masses(
    quadrotors: Sequence[QuadrotorParameters], cables: Sequence[CableParameters]
) -> Array:
    """Return the mass (n,) [kg] that each quadrotor lifts besides its share of the payload.

    That is its own mass and that of its cable's link.
    """
    return np.array(
        [
            q.mass + (c.link_mass if c.kind == "inextensible" else 0.0)
            for q, c in zip(quadrotors, cables)
        ]
    )


def team_lift(
    mass: float, quadrotors: Sequence[QuadrotorParameters], cables: Sequence[CableParameters]
) -> Lift:
    """Return the lift of a team, for `TransferParameters.lift`.

    Parameters
    ----------
    mass : float
        Mass of all that hangs on the cables, grippers included [kg].
    quadrotors, cables : sequences of n parameters
        The team.
    """
    thrust = tuple(float(quadrotor.thrust_limits[1]) for quadrotor in quadrotors)
    return Lift(mass, thrust, tuple(own_masses(quadrotors, cables).tolist()))


def default_lift(payload_mass: float, n: int) -> Lift:
    """Return the lift of n default quadrotors with default cables and grippers.

    Parameters
    ----------
    payload_mass : float
        Mass of the payload without grippers [kg].
    n : int
        Number of quadrotors.

    Raises
    ------
    InputError
        If the mass is not positive.
    """
    if not payload_mass > 0.0:
        raise InputError(f"the payload's mass must be positive, got {payload_mass!r} kg")
    grippers = sum([GripperParameters().mass] * n)
    return team_lift(
        payload_mass + grippers, (QuadrotorParameters(),) * n, (CableParameters(),) * n
    )
