"""Selection of distinct solutions among the final states of annealing chains."""

import numpy as np

from drake_aerial.geometry import Array, Pose

# Difference in length below which two cables are equally long [m].
_SAME_LENGTH = 1e-3


def distinct(
    X_NG: Pose, log_j: Array, top: int, distance: float, cable_length: Array | None = None
) -> np.ndarray:
    """Return the indices of at most `top` distinct configurations, the likeliest first.

    Two configurations are the same if their grippers can be paired, each once, so that all pairs
    are nearer than `distance`. Grippers on equally long cables are interchangeable.

    Parameters
    ----------
    X_NG : Pose
        Configurations, batch (K, n).
    log_j : (K,) array
        Their log-likelihoods.
    top : int
        Largest number of indices.
    distance : float
        Distance between paired grippers from which on configurations differ [m].
    cable_length : (n,) array, optional
        Cable lengths of the grippers [m]. None makes all grippers interchangeable.
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
