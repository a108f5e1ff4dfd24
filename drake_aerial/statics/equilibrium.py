"""Balance of forces and moments on a payload that hangs on cables."""

from __future__ import annotations

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
