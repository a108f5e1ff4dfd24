"""Checks before a flight that the team can carry its payload by its contacts."""

from collections.abc import Sequence

import numpy as np

from drake_aerial.contacts.feasibility.checks import hanging_reasons
from drake_aerial.errors import InputError, JobError
from drake_aerial.geometry import Array
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.quadrotor import QuadrotorParameters
from drake_aerial.plant.team_lift import own_masses, team_lift
from drake_aerial.statics.gravity import GRAVITY
from drake_aerial.statics.lift import smallest_overload

FORCE = "use --force (force=True) to fly it anyway"
"""End of the messages about what can be flown by force."""
_ADVICE = "reduce the payload's mass or raise the thrust limit"


def check_formation(
    p_LoC: Array,
    mass: float,
    quadrotors: Sequence[QuadrotorParameters],
    cables: Sequence[CableParameters],
) -> None:
    """Raise an error if taut vertical cables cannot hold a payload level; one contact always can.

    Parameters
    ----------
    p_LoC : (n, 3) array
        Contacts from the centre of mass of all that hangs on the cables [m].
    mass : float
        Mass of all that hangs on the cables [kg].
    quadrotors, cables : sequences of n parameters
        The team.

    Raises
    ------
    JobError
        If all contacts are on one side of the centre of mass, the cables do not balance, or one of
        them must pull more than its quadrotor can.
    """
    if len(p_LoC) == 1:
        return
    up = np.array([[0.0, 0.0, cable.length] for cable in cables])
    reasons = hanging_reasons(p_LoC, p_LoC + up, np.zeros(2), team_lift(mass, quadrotors, cables))
    if reasons:
        raise JobError(f"these contacts cannot be flown: {'; '.join(map(str, reasons))}; {FORCE}")


def check_team(
    payload: Payload,
    mass: float,
    quadrotors: Sequence[QuadrotorParameters],
    cables: Sequence[CableParameters],
) -> None:
    """Raise an error if a team cannot lift its weight, or a quadrotor cannot lift its own.

    Parameters
    ----------
    payload : Payload
        The payload, for the message.
    mass : float
        Mass of all that hangs on the cables, grippers included [kg].
    quadrotors, cables : sequences of n parameters
        The team.

    Raises
    ------
    InputError
        With the thrust that there is and the thrust that is needed.
    """
    n = len(quadrotors)
    thrust, own = _largest_thrusts(quadrotors), own_masses(quadrotors, cables)
    weight = GRAVITY * (mass + own.sum())
    if thrust.sum() <= weight:
        raise InputError(
            f"the thrust of {n} quadrotor(s) must exceed the weight of all that flies, "
            f"{weight:.2f} N (payload {payload.mass:g} kg), got {thrust.sum():.2f} N at most; "
            f"{_ADVICE}"
        )
    spare = thrust - GRAVITY * own
    if (spare <= 0.0).any():
        i = int(np.argmin(spare))
        raise InputError(
            f"the thrust of quadrotor {i + 1} of {n} must exceed its own weight, "
            f"{GRAVITY * own[i]:.2f} N, got {thrust[i]:.2f} N at most; raise the thrust limit"
        )


def check_lift(
    payload: Payload,
    p_LoC: Array,
    mass: float,
    quadrotors: Sequence[QuadrotorParameters],
    cables: Sequence[CableParameters],
) -> None:
    """Raise an error if a team cannot lift its weight, or a quadrotor cannot lift its share.

    Contacts from which no cables can hold the payload level, all on one side of the centre of
    mass, are not judged here.

    Parameters
    ----------
    payload : Payload
        The payload, for the message.
    p_LoC : (n, 3) array
        Contacts from the centre of mass of all that hangs on the cables [m].
    mass : float
        Mass of all that hangs on the cables [kg].
    quadrotors, cables : sequences of n parameters
        The team.

    Raises
    ------
    InputError
        With the thrust that there is and the thrust that is needed.
    """
    check_team(payload, mass, quadrotors, cables)
    spare = _largest_thrusts(quadrotors) - GRAVITY * own_masses(quadrotors, cables)
    overload = smallest_overload(p_LoC, mass * GRAVITY, spare)
    if overload is not None and overload[0] >= 0.0:
        i = int(np.argmax(overload[1] - spare))
        raise InputError(
            f"quadrotor {i + 1} of {len(spare)} must bear its share of a level payload of "
            f"{payload.mass:g} kg, {overload[1][i]:.2f} N, got {spare[i]:.2f} N above its own "
            f"weight; {_ADVICE}, or choose other contacts"
        )


def _largest_thrusts(quadrotors: Sequence[QuadrotorParameters]) -> Array:
    return np.array([quadrotor.thrust_limits[1] for quadrotor in quadrotors])
