"""Choosing distinct solutions among the chains' ends."""

from __future__ import annotations

import numpy as np

from drake_aerial.geometry import Array, Pose


def distinct(X_NG: Pose, log_j: Array, top: int, distance: float) -> np.ndarray:
    """Return the indices of at most `top` solutions, the likeliest first, that are not the same as a
    likelier one.

    Two configurations of n grippers are the same if every gripper of one has a gripper of the other nearer
    than `distance` [m], each paired once: equal grippers are interchangeable.

    Parameters
    ----------
    X_NG : Pose
        Configurations, batch (K, n).
    log_j : (K,) array
        Their log-likelihoods.
    """
    chosen: list[int] = []
    for k in np.argsort(-log_j, kind="stable"):
        if len(chosen) == top:
            break
        if all(_largest_gap(X_NG.p[k], X_NG.p[other]) >= distance for other in chosen):
            chosen.append(int(k))
    return np.array(chosen, dtype=int)


def _largest_gap(a: Array, b: Array) -> float:
    from scipy.optimize import linear_sum_assignment

    gaps = np.linalg.norm(a[:, None] - b, axis=-1)
    rows, columns = linear_sum_assignment(gaps)
    return float(gaps[rows, columns].max())
