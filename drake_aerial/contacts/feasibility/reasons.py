"""Why a contact cannot be flown: named reasons instead of discarding by hand (docs/method.md)."""

from __future__ import annotations

import numpy as np

from drake_aerial.contacts.feasibility.local_surface import LocalSurface
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, Pose, axis_of
from drake_aerial.statics.lift import Lift

FOOT = 0.03
"""The part of a cable next to its contact near which points are no obstacle [m]."""
# Smallest part of the weight that a taut cable carries.
_TAUT = 1e-3
# Residual of force (over the weight) and moment (over weight times size) up to which a payload hangs as it lies.
_BALANCED = 0.02


def reasons_against(
    X_NG: Pose,
    X_NQ: Pose,
    distance: Array,
    centre: Array,
    surface: LocalSurface,
    parameters: TransferParameters,
) -> tuple[str, ...]:
    """Return what makes one solution infeasible; empty if nothing does.

    Parameters
    ----------
    X_NG, X_NQ : Pose
        Grippers and quadrotors of one solution, batches (n,), in a frame N whose z is up.
    distance : (n,) array
        Distances of the contacts from the nearest point of the cloud [m].
    centre : (2,) array
        Where the centre of mass is believed to be, seen from above [m].
    surface : LocalSurface
        The visible surface, in N.
    parameters : TransferParameters
        Limits.
    """
    n = len(X_NG.p)
    reasons = []
    for i in range(n):
        name = f"gripper {i + 1}: " if n > 1 else ""
        elevation = np.arcsin(np.clip(axis_of(X_NG.q[i], 2)[2], -1.0, 1.0))
        if elevation < parameters.min_elevation:
            reasons.append(
                f"{name}upside down (its axis points {np.rad2deg(elevation):.0f} deg above the horizontal)"
            )
        elif _cable_hits(
            X_NG.take(i), X_NQ.p[i], surface.points, max(parameters.clearance, surface.spacing)
        ):
            reasons.append(f"{name}cable through the payload")
        if distance[i] > max(parameters.off_surface, surface.hole):
            reasons.append(f"{name}off the surface (nearest point {100 * distance[i]:.1f} cm away)")
    reasons += _too_close(X_NQ.p, parameters.separation)
    reasons += hanging_reasons(X_NG.p, X_NQ.p, centre, parameters.lift)
    return tuple(reasons)


def hanging_reasons(p_G: Array, p_Q: Array, centre: Array, lift: Lift | None = None) -> list[str]:
    """Return what keeps taut cables from holding a payload as it lies; empty if nothing does.

    Parameters
    ----------
    p_G, p_Q : (n, 3) arrays
        Contacts and quadrotors, z up [m].
    centre : (2,) array
        The centre of mass seen from above [m].
    lift : Lift, optional
        The payload's weight and the thrust there is; without it nothing is too heavy.

    Raises
    ------
    InputError
        If `lift` is of another number of quadrotors.
    """
    tension = tensions(p_G, p_Q, centre)
    if tension is None or tension.min() < _TAUT:
        why = (
            "all contacts on one side of the centre of mass"
            if one_sided(p_G, centre)
            else "cables do not balance"
        )
        return [f"no positive-tension equilibrium ({why})"]
    return [] if lift is None else _too_heavy(p_G, p_Q, centre, tension, lift)


def _too_heavy(p_G: Array, p_Q: Array, centre: Array, tension: Array, lift: Lift) -> list[str]:
    n = len(p_G)
    if len(lift.max_thrust) != n:
        raise InputError(
            f"the known thrusts are of {len(lift.max_thrust)} quadrotors, the contacts of {n}"
        )
    largest = lift.largest_tension((p_Q - p_G) / np.linalg.norm(p_Q - p_G, axis=1, keepdims=True))
    if tensions(p_G, p_Q, centre, largest / lift.weight) is not None:
        return []
    names = [f"gripper {i + 1}: " if n > 1 else "" for i in range(n)]
    return [
        f"{names[i]}more tension than the propellers lift ({lift.weight * tension[i]:.1f} N, at most {largest[i]:.1f} N)"
        for i in np.flatnonzero(lift.weight * tension > largest)
    ]


def _cable_hits(X_NG: Pose, p_Q: Array, points: Array, clearance: float) -> bool:
    length = np.linalg.norm(p_Q - X_NG.p)
    direction = (p_Q - X_NG.p) / length
    if direction @ axis_of(X_NG.q, 2) < 0.0:
        return True
    offset = points - X_NG.p
    along = offset @ direction
    radial = np.linalg.norm(offset - along[:, None] * direction, axis=1)
    return bool(np.any((along > FOOT) & (along < length) & (radial < clearance)))


def _too_close(p_Q: Array, separation: float) -> list[str]:
    reasons = []
    for i in range(len(p_Q)):
        for j in range(i):
            d = np.linalg.norm(p_Q[i] - p_Q[j])
            if d < separation:
                reasons.append(
                    f"quadrotors {j + 1} and {i + 1} too close ({d:.2f} m, at least {separation:.2f} m)"
                )
    return reasons


def load_shares(p_G: Array, p_Q: Array, centre: Array) -> Array | None:
    """Return the parts (n,) of the weight that cables carry while the payload hangs at rest as it lies.

    Among the non-negative tensions along the cables that balance weight and moment about the believed
    centre, those with the smallest residual; None where a residual of over 2 % of weight times size remains.
    Where many do (four cables, or three on a line), the smallest in norm, or those whose least is the largest.
    One or two contacts let the payload swing about the line through them, which takes that moment out of the
    balance.

    Parameters
    ----------
    p_G, p_Q : (n, 3) arrays
        Contacts and quadrotors, z up [m].
    centre : (2,) array
        The centre of mass seen from above [m].
    """
    tension = tensions(p_G, p_Q, centre)
    return None if tension is None else tension / max(tension.sum(), 1e-12)


def tensions(p_G: Array, p_Q: Array, centre: Array, largest: Array | None = None) -> Array | None:
    """Return the tensions (n,) of `load_shares`, as parts of the weight: leaning cables add up to more than one.

    Parameters
    ----------
    p_G, p_Q, centre : arrays
        As for `load_shares`.
    largest : (n,) array, optional
        Upper bounds; None is returned where the choice cannot keep them.
    """
    from scipy.optimize import nnls

    n = len(p_G)
    if n == 1:
        tension: Array | None = np.ones(1)
    else:
        direction = (p_Q - p_G) / np.linalg.norm(p_Q - p_G, axis=1, keepdims=True)
        mean = p_G.mean(axis=0)
        size = float(np.linalg.norm(p_G - mean, axis=1).max())
        if size < 1e-6:
            return None
        # Moments about the mean contact, over the size; only those that the contacts can take up.
        keep = moment_axes(p_G)
        arm = (p_G - mean) / size
        moments = np.cross(arm, direction) @ keep.T
        at = np.array([centre[0] - mean[0], centre[1] - mean[1], 0.0]) / size
        load = np.concatenate([[0.0, 0.0, 1.0], np.cross(at, [0.0, 0.0, 1.0]) @ keep.T])
        matrix = np.vstack([direction.T, moments.T])
        tension, residual = nnls(matrix, load)
        if residual > _BALANCED:
            return None
        if np.linalg.matrix_rank(matrix, tol=1e-6) < n:
            tension = _shared(matrix, tension, largest)
    if tension is not None and largest is not None and np.any(tension > largest * (1.0 + 1e-9)):
        return None
    return tension


def one_sided(p_G: Array, centre: Array) -> bool:
    """Return whether all contacts p_G (n, 3) lie on one side of a vertical plane through `centre` (2,) [m].

    Contacts on one line (two always are): on one side of the centre along that line.
    """
    offset = p_G[:, :2] - centre
    if len(moment_axes(p_G)) < 3:
        line = np.linalg.svd(p_G[:, :2] - p_G[:, :2].mean(axis=0))[2][0]
        along = offset @ line
        return bool(np.all(along > 0.0) or np.all(along < 0.0))
    angle = np.sort(np.arctan2(offset[:, 1], offset[:, 0]))
    gaps = np.diff(np.append(angle, angle[0] + 2.0 * np.pi))
    return bool(gaps.max() > np.pi)


def _shared(matrix: Array, tension: Array, largest: Array | None = None) -> Array:
    """Return tensions (n,) with the same forces and moments as `tension`, of which there are many: the smallest in
    norm, or, if that leaves a cable slack or beyond `largest` (n,), those whose least is the largest.
    """
    from scipy.optimize import linprog

    balance = matrix @ tension
    smallest: Array = np.asarray(np.linalg.lstsq(matrix, balance, rcond=1e-6)[0], float)
    n, bound = len(tension), np.full(len(tension), np.inf) if largest is None else largest
    if smallest.min() >= _TAUT * smallest.sum() and np.all(smallest <= bound):
        return smallest
    # Unknowns: the tensions, and a lower bound of all of them.
    best = linprog(
        np.append(np.zeros(n), -1.0),
        A_ub=np.hstack([-np.eye(n), np.ones((n, 1))]),
        b_ub=np.zeros(n),
        A_eq=np.column_stack([matrix, np.zeros(len(matrix))]),
        b_eq=balance,
        bounds=[*((0.0, top) for top in bound), (0.0, None)],
    )
    return np.asarray(best.x[:n], float) if best.success else tension


def moment_axes(p_G: Array) -> Array:
    """Return the axes (k, 3), in rows, about which contacts p_G (n, 3) [m] can take up a moment: all three, or the two
    across the line on which they lie.
    """
    offset = p_G - p_G.mean(axis=0)
    size = max(float(np.linalg.norm(offset, axis=1).max()), 1e-6)
    _, spread, axes = np.linalg.svd(offset / size)
    line = len(spread) < 2 or spread[1] < 0.05
    return axes[1:] if line else np.eye(3)
