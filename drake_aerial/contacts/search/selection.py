"""Choosing distinct solutions among the chains' ends."""

from __future__ import annotations

import numpy as np

from drake_aerial.geometry import Array, Pose

# Cables whose lengths differ by less are equally long [m].
_SAME_LENGTH = 1e-3


def distinct(
    X_NG: Pose, log_j: Array, top: int, distance: float, cable_length: Array | None = None
) -> np.ndarray:
    """Return the indices of at most `top` solutions, the likeliest first, that are not the same as a
    likelier one.

    Two configurations of n grippers are the same if their grippers can be paired, each once, so that every pair is
    nearer than `distance` [m]. Equal grippers, those on equally long cables, are interchangeable.

    Parameters
    ----------
    X_NG : Pose
        Configurations, batch (K, n).
    log_j : (K,) array
        Their log-likelihoods.
    cable_length : (n,) array, optional
        The grippers' cable lengths [m]; None: all grippers are equal.
    """
    n = X_NG.p.shape[1]
    length = np.zeros(n) if cable_length is None else np.asarray(cable_length, float)
    equal = np.abs(length[:, None] - length) < _SAME_LENGTH
    chosen: list[int] = []
    for k in np.argsort(-log_j, kind="stable"):
        if len(chosen) == top:
            break
        if not any(_same(X_NG.p[k], X_NG.p[other], distance, equal) for other in chosen):
            chosen.append(int(k))
    return np.array(chosen, dtype=int)


def _same(a: Array, b: Array, distance: float, equal: np.ndarray) -> bool:
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import maximum_bipartite_matching

    near = (np.linalg.norm(a[:, None] - b, axis=-1) < distance) & equal
    if not near.any(axis=1).all():
        return False
    return bool(np.all(maximum_bipartite_matching(csr_array(near)) >= 0))
