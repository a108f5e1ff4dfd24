"""Equilibrium of a payload at rest: cable tensions and load shares."""

import numpy as np

from drake_aerial.geometry import IDENTITY, Array, cross

BALANCE_TOLERANCE = 0.02
"""Largest residual in equilibrium: force over weight, moment over weight times size."""
# Contacts whose spread across their line is a smaller fraction of their size count as collinear.
_COLLINEAR = 0.05


def moment_axes(p_NC: Array) -> Array:
    """Return the unit axes about which cables at some contacts can exert a moment.

    Parameters
    ----------
    p_NC : (n, 3) array
        Contacts [m].

    Returns
    -------
    (k, 3) array
        Axes in rows: all three, or the two across the line on which the contacts lie.
    """
    offset = p_NC - p_NC.mean(axis=0)
    size = max(float(np.linalg.norm(offset, axis=1).max()), 1e-6)
    _, spread, axes = np.linalg.svd(offset / size)
    collinear = len(spread) < 2 or spread[1] < _COLLINEAR
    return axes[1:] if collinear else np.eye(3)


def balance_matrix(arm: Array, direction: Array, axes: Array = IDENTITY) -> Array:
    """Return the matrix (3 + k, n) from cable tensions to the force and moments on the payload.

    Parameters
    ----------
    arm : (n, 3) array
        Contacts from the point that moments are about, in any unit of length.
    direction : (n, 3) array
        Unit directions of the cables, from the payload upwards.
    axes : (k, 3) array, optional
        Axes of the moments; x, y and z by default.
    """
    return np.vstack([direction.T, (cross(arm, direction) @ axes.T).T])


def level_balance(p_LoC: Array, weight: float) -> tuple[Array, Array]:
    """Return A (k, n) and b (k,) of A T = b, the equilibrium of a level payload on vertical cables.

    The rows are the force along z and the moments about horizontal axes. Collinear contacts leave
    out the moment about their line: the payload turns about it until that moment is zero. These
    are rows of `balance_matrix`, about other axes, and collinear is to be taken literally here.

    Parameters
    ----------
    p_LoC : (n, 3) array
        Contacts from the payload's centre of mass [m].
    weight : float
        Weight of the payload [N].
    """
    arm = p_LoC[:, :2]
    spread = arm - arm.mean(axis=0)
    _, sizes, axes = np.linalg.svd(np.vstack([spread, np.zeros((2, 2))]))
    kept = axes[sizes > 1e-6]
    return np.vstack([np.ones(len(arm)), kept @ arm.T]), np.array([weight, *np.zeros(len(kept))])


TAUT = 1e-3
"""Least tension of a taut cable, as a part of the weight."""


def tensions(p_NC: Array, p_NQ: Array, centre: Array, largest: Array | None = None) -> Array | None:
    """Return the cable tensions of a payload at rest, as fractions of its weight.

    Among the non-negative tensions that balance the weight, those with the smallest residual. If
    there are many (four cables, or three at collinear contacts), the smallest in norm; if that
    leaves a cable slack or beyond `largest`, those whose smallest tension is the largest. Moments
    that the contacts cannot exert (`moment_axes`) are left out: one or two contacts let the payload
    swing. Leaning cables add up to more than one.

    Parameters
    ----------
    p_NC, p_NQ : (n, 3) arrays
        Contacts and quadrotors, z up [m].
    centre : (2,) array
        Horizontal position of the centre of mass [m].
    largest : (n,) array, optional
        Upper bounds, as parts of the weight.

    Returns
    -------
    (n,) array or None
        None if they cannot balance to within `BALANCE_TOLERANCE`, or exceed `largest`.
    """
    tension = np.ones(1) if len(p_NC) == 1 else _balancing(p_NC, p_NQ, centre, largest)
    if tension is None or largest is None or np.all(tension <= largest * (1.0 + 1e-9)):
        return tension
    return None


def load_shares(p_NC: Array, p_NQ: Array, centre: Array) -> Array | None:
    """Return the `tensions` (n,) over their sum, or None; parameters as there."""
    tension = tensions(p_NC, p_NQ, centre)
    return None if tension is None else tension / max(tension.sum(), 1e-12)


def level_tensions(p_LoC: Array, weight: float) -> Array:
    """Return tensions (n,) [N] with which vertical cables hold a level payload, none negative.

    Among all that balance it, those with the smallest sum of squares.

    Parameters
    ----------
    p_LoC : (n, 3) array
        Contacts from the payload's centre of mass [m].
    weight : float
        Weight of the payload [N].
    """
    A, b = level_balance(p_LoC, weight)
    return np.maximum(np.linalg.pinv(A) @ b, 0.0)


def one_sided(p_NC: Array, centre: Array) -> bool:
    """Return whether all contacts lie on one side of a vertical plane through the centre of mass.

    Collinear contacts (two always are) count as one-sided if they are on one side of it along
    their line.

    Parameters
    ----------
    p_NC : (n, 3) array
        Contacts, z up [m].
    centre : (2,) array
        Horizontal position of the centre of mass [m].
    """
    offset = p_NC[:, :2] - centre
    if len(moment_axes(p_NC)) < 3:
        line = np.linalg.svd(p_NC[:, :2] - p_NC[:, :2].mean(axis=0))[2][0]
        along = offset @ line
        return bool(np.all(along > 0.0) or np.all(along < 0.0))
    angle = np.sort(np.arctan2(offset[:, 1], offset[:, 0]))
    gaps = np.diff(np.append(angle, angle[0] + 2.0 * np.pi))
    return bool(gaps.max() > np.pi)


def _balancing(p_NC: Array, p_NQ: Array, centre: Array, largest: Array | None) -> Array | None:
    """Return the tensions (n,) of several cables, or None if they do not balance the weight."""
    from scipy.optimize import nnls

    direction = (p_NQ - p_NC) / np.linalg.norm(p_NQ - p_NC, axis=1, keepdims=True)
    mean = p_NC.mean(axis=0)
    size = float(np.linalg.norm(p_NC - mean, axis=1).max())
    if size < 1e-6:
        return None
    # Moments about the mean contact, over the size.
    axes = moment_axes(p_NC)
    matrix = balance_matrix((p_NC - mean) / size, direction, axes)
    at = np.array([centre[0] - mean[0], centre[1] - mean[1], 0.0]) / size
    load = np.concatenate([[0.0, 0.0, 1.0], np.cross(at, [0.0, 0.0, 1.0]) @ axes.T])
    tension, residual = nnls(matrix, load)
    if residual > BALANCE_TOLERANCE:
        return None
    if np.linalg.matrix_rank(matrix, tol=1e-6) < len(tension):
        return _redistributed(matrix, tension, largest)
    return np.asarray(tension, float)


def _redistributed(matrix: Array, tension: Array, largest: Array | None) -> Array:
    """Return the preferred ones (see `tensions`) of all tensions (n,) that balance as these do."""
    from scipy.optimize import linprog

    balance = matrix @ tension
    smallest: Array = np.asarray(np.linalg.lstsq(matrix, balance, rcond=1e-6)[0], float)
    n, bound = len(tension), np.full(len(tension), np.inf) if largest is None else largest
    if smallest.min() >= TAUT * smallest.sum() and np.all(smallest <= bound):
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
