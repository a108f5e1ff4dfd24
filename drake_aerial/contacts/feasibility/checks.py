"""Feasibility checks of a contact solution."""

import numpy as np

from drake_aerial.contacts.feasibility.local_surface import LocalSurface
from drake_aerial.contacts.feasibility.reasons import Reason, ReasonKind
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, Pose, axis_of
from drake_aerial.statics.lift import Lift
from drake_aerial.statics.tensions import TAUT, one_sided, tensions

FOOT = 0.03
"""Length of a cable next to its contact along which points are no obstacle [m]."""


def reasons_against(
    X_NG: Pose,
    X_NQ: Pose,
    distance: Array,
    centre: Array,
    surface: LocalSurface,
    parameters: TransferParameters,
) -> tuple[Reason, ...]:
    """Return the reasons why one solution is infeasible; empty if it is feasible.

    Parameters
    ----------
    X_NG, X_NQ : Pose
        Grippers and quadrotors of the solution, batches (n,), in a frame N whose z is up.
    distance : (n,) array
        Distances of the contacts from the nearest point of the cloud [m].
    centre : (2,) array
        Horizontal position of the believed centre of mass [m].
    surface : LocalSurface
        The visible surface, in N.
    parameters : TransferParameters
        Limits.
    """
    n = len(X_NG.p)
    reasons = []
    for i in range(n):
        gripper = i if n > 1 else None
        elevation = float(np.arcsin(np.clip(axis_of(X_NG.q[i], 2)[2], -1.0, 1.0)))
        clearance = max(parameters.clearance, surface.spacing)
        if elevation < parameters.min_elevation:
            reasons.append(_not_upright(elevation, parameters.min_elevation, gripper))
        elif _cable_hits(X_NG.take(i), X_NQ.p[i], surface.points, clearance):
            reasons.append(Reason(ReasonKind.CABLE_THROUGH_PAYLOAD, gripper))
        if distance[i] > max(parameters.off_surface, surface.hole):
            reasons.append(Reason(ReasonKind.OFF_SURFACE, gripper, value=float(distance[i])))
    reasons += _too_close(X_NQ.p, parameters.separation)
    reasons += hanging_reasons(X_NG.p, X_NQ.p, centre, parameters.lift)
    return tuple(reasons)


def _not_upright(elevation: float, limit: float, gripper: int | None) -> Reason:
    """Return the reason against a gripper whose axis is not far enough above the horizontal."""
    if round(np.rad2deg(elevation)) < 0:
        return Reason(ReasonKind.UPSIDE_DOWN, gripper, value=elevation)
    return Reason(ReasonKind.SIDEWAYS, gripper, value=max(elevation, 0.0), limit=limit)


def hanging_reasons(
    p_NC: Array, p_NQ: Array, centre: Array, lift: Lift | None = None
) -> list[Reason]:
    """Return the reasons why taut cables cannot hold a payload at rest; empty if they can.

    Parameters
    ----------
    p_NC, p_NQ : (n, 3) arrays
        Contacts and quadrotors, z up [m].
    centre : (2,) array
        Horizontal position of the centre of mass [m].
    lift : Lift, optional
        Weight and thrusts; without it no tension is too large.

    Raises
    ------
    InputError
        If `lift` is for another number of quadrotors.
    """
    tension = tensions(p_NC, p_NQ, centre)
    if tension is None or tension.min() < TAUT:
        kind = ReasonKind.ONE_SIDED if one_sided(p_NC, centre) else ReasonKind.UNBALANCED
        return [Reason(kind)]
    return [] if lift is None else _too_much_tension(p_NC, p_NQ, centre, tension, lift)


def _too_much_tension(
    p_NC: Array, p_NQ: Array, centre: Array, tension: Array, lift: Lift
) -> list[Reason]:
    n = len(p_NC)
    if len(lift.max_thrust) != n:
        raise InputError(
            f"`lift` must have the thrusts of {n} quadrotor(s), one for each contact, "
            f"got {len(lift.max_thrust)}"
        )
    direction = (p_NQ - p_NC) / np.linalg.norm(p_NQ - p_NC, axis=1, keepdims=True)
    largest = lift.largest_tension(direction)
    if tensions(p_NC, p_NQ, centre, largest / lift.weight) is not None:
        return []
    force = lift.weight * tension
    return [
        Reason(
            ReasonKind.TOO_MUCH_TENSION,
            int(i) if n > 1 else None,
            value=float(force[i]),
            limit=float(largest[i]),
        )
        for i in np.flatnonzero(force > largest)
    ]


def _cable_hits(X_NG: Pose, p_NQ: Array, points: Array, clearance: float) -> bool:
    """Return whether a cable leaves its gripper inwards, or comes nearer to points than allowed."""
    length = np.linalg.norm(p_NQ - X_NG.p)
    direction = (p_NQ - X_NG.p) / length
    if direction @ axis_of(X_NG.q, 2) < 0.0:
        return True
    offset = points - X_NG.p
    along = offset @ direction
    radial = np.linalg.norm(offset - along[:, None] * direction, axis=1)
    return bool(np.any((along > FOOT) & (along < length) & (radial < clearance)))


def _too_close(p_NQ: Array, separation: float) -> list[Reason]:
    distance = np.linalg.norm(p_NQ[:, None] - p_NQ, axis=2)
    return [
        Reason(
            ReasonKind.QUADROTORS_TOO_CLOSE,
            pair=(j, i),
            value=float(distance[i, j]),
            limit=separation,
        )
        for i in range(len(p_NQ))
        for j in range(i)
        if distance[i, j] < separation
    ]
