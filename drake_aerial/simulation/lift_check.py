"""Whether a team can carry its payload at all, and a formation hold it, looked at before anything flies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import linprog

from drake_aerial.errors import InputError, JobError
from drake_aerial.geometry import Array
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.quadrotor import QuadrotorParameters
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.statics.gravity import GRAVITY

if TYPE_CHECKING:
    from drake_aerial.statics.lift import Lift


FORCE = "it is flown all the same by force (force=True, on the command line --force)"
"""How a refusal ends that can be overruled."""


def level_balance(p_LoC: Array, weight: float) -> tuple[Array, Array]:
    """Return A (k, n) and b (k,) of A T = b, the equilibrium of a level payload on n vertical cables of tensions T.

    Force along z, and the moments about the horizontal axes. Contacts in one line (two of them always are) cannot bear a
    moment about that line, and the payload turns until there is none: that row is left out.

    Parameters
    ----------
    p_LoC : (n, 3) array
        Contacts from the payload's centre of mass [m].
    weight : float
        [N]
    """
    arms = p_LoC[:, :2]
    spread = arms - arms.mean(axis=0)
    _, sizes, axes = np.linalg.svd(np.vstack([spread, np.zeros((2, 2))]))
    kept = axes[sizes > 1e-6]
    return np.vstack([np.ones(len(arms)), kept @ arms.T]), np.array([weight, *np.zeros(len(kept))])


def level_tensions(p_LoC: Array, weight: float) -> Array:
    """Return the tensions (n,) [N] of least squared sum with which n vertical cables hold a level payload, none negative."""
    A, b = level_balance(p_LoC, weight)
    return np.maximum(np.linalg.pinv(A) @ b, 0.0)


def own_masses(
    quadrotors: Sequence[QuadrotorParameters], cables: Sequence[CableParameters]
) -> Array:
    """Return what each of n quadrotors must lift besides its share of the payload (n,) [kg]: itself, and its cable's link."""
    return np.array(
        [
            q.mass + (c.link_mass if c.kind == "inextensible" else 0.0)
            for q, c in zip(quadrotors, cables)
        ]
    )


def team_lift(
    mass: float, quadrotors: Sequence[QuadrotorParameters], cables: Sequence[CableParameters]
) -> Lift:
    """Return the lift of a team as a transfer judges it (`TransferParameters.lift`).

    Parameters
    ----------
    mass : float
        Of what hangs, grippers included [kg].
    quadrotors, cables : n of each
    """
    from drake_aerial.statics.lift import Lift

    thrust = tuple(float(quadrotor.thrust_limits[1]) for quadrotor in quadrotors)
    return Lift(mass, thrust, tuple(own_masses(quadrotors, cables).tolist()))


def default_lift(payload_mass: float, n: int) -> Lift:
    """Return what n of the default quadrotors lift of a payload [kg] that hangs on the default grippers and cables.

    Raises InputError for a mass that is not positive.
    """
    parameters = StationParameters()
    grippers = sum(gripper.mass for gripper in parameters.grippers(n))
    if not payload_mass > 0.0:
        raise InputError(f"the payload's mass is {payload_mass!r} kg; a positive number accepted")
    return team_lift(payload_mass + grippers, parameters.quadrotors(n), parameters.cables(n))


def check_formation(
    p_LoC: Array,
    mass: float,
    quadrotors: Sequence[QuadrotorParameters],
    cables: Sequence[CableParameters],
) -> None:
    """Refuse several contacts from which taut, vertical cables cannot hold the payload level.

    Parameters
    ----------
    p_LoC : (n, 3) array
        Contacts from the centre of mass of what hangs [m].
    mass : float
        Of what hangs [kg].
    quadrotors, cables : n of each

    Raises
    ------
    JobError
        If all contacts are on one side of the centre of mass, the cables do not balance, or one must pull more than its quadrotor
        can.
    """
    if len(p_LoC) == 1:
        return
    from drake_aerial.contacts.feasibility.reasons import hanging_reasons

    up = np.array([[0.0, 0.0, cable.length] for cable in cables])
    reasons = hanging_reasons(p_LoC, p_LoC + up, np.zeros(2), team_lift(mass, quadrotors, cables))
    if reasons:
        raise JobError(f"these contacts cannot be flown: {'; '.join(reasons)}; {FORCE}")


def check_team(
    payload: Payload,
    mass: float,
    quadrotors: Sequence[QuadrotorParameters],
    cables: Sequence[CableParameters],
) -> None:
    """Refuse a team that cannot lift its weight, or in which a quadrotor cannot lift its own.

    Parameters
    ----------
    payload : Payload
    mass : float
        Of what hangs, grippers included [kg].
    quadrotors, cables : n of each

    Raises
    ------
    InputError
        With what the propellers give and what they need.
    """
    n = len(quadrotors)
    lift = np.array([quadrotor.thrust_limits[1] for quadrotor in quadrotors])
    own = own_masses(quadrotors, cables)
    weight = GRAVITY * (mass + own.sum())
    if lift.sum() <= weight:
        raise InputError(
            f"the propellers of {n} quadrotor(s) push with {lift.sum():.2f} N at most, the weight of all that flies is "
            f"{weight:.2f} N (payload {payload.mass:g} kg); a lighter payload or stronger propellers accepted"
        )
    spare = lift - GRAVITY * own
    if (spare <= 0.0).any():
        i = int(np.argmin(spare))
        raise InputError(
            f"quadrotor {i + 1} of {n} pushes with {lift[i]:.2f} N at most and weighs {GRAVITY * own[i]:.2f} N itself; "
            "stronger propellers accepted"
        )


def check_lift(
    payload: Payload,
    p_LoC: Array,
    mass: float,
    quadrotors: Sequence[QuadrotorParameters],
    cables: Sequence[CableParameters],
) -> None:
    """Refuse a team that cannot lift its weight, or in which a quadrotor cannot lift its own share.

    Contacts that no pulling cables can hold level, all on one side of the centre of mass, are not judged here.

    Parameters
    ----------
    payload : Payload
    p_LoC : (n, 3) array
        Contacts from the centre of mass of what hangs [m].
    mass : float
        Of what hangs [kg].
    quadrotors, cables : n of each

    Raises
    ------
    InputError
        With what the propellers give and what they need.
    """
    check_team(payload, mass, quadrotors, cables)
    n = len(quadrotors)
    spare = np.array(
        [quadrotor.thrust_limits[1] for quadrotor in quadrotors]
    ) - GRAVITY * own_masses(quadrotors, cables)
    A, b = level_balance(p_LoC, mass * GRAVITY)
    if linprog(np.ones(n), A_eq=A, b_eq=b, bounds=(0.0, None)).status != 0:
        return
    # The least that the most overloaded cable must carry beyond what its quadrotor has to spare.
    cost, rows = np.eye(1, n + 1, n)[0], np.hstack([np.eye(n), -np.ones((n, 1))])
    least = linprog(
        cost,
        A_ub=rows,
        b_ub=spare,
        A_eq=np.hstack([A, np.zeros((len(A), 1))]),
        b_eq=b,
        bounds=[(0.0, None)] * n + [(None, None)],
    )
    if least.status == 0 and least.fun >= 0.0:
        i = int(np.argmax(least.x[:n] - spare))
        raise InputError(
            f"quadrotor {i + 1} of {n} has {spare[i]:.2f} N to spare above its own weight, its share of a level payload of "
            f"{payload.mass:g} kg is {least.x[i]:.2f} N; a lighter payload, stronger propellers or other contacts accepted"
        )
