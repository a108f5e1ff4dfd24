"""Simulated annealing of the grippers' configurations, and its initial configurations."""

from collections.abc import Callable

import numpy as np

from drake_aerial.contacts.likelihood.contact_likelihood import ContactLikelihood
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.density.mixture import systematic_resample
from drake_aerial.geometry import (
    Array,
    Pose,
    quat_about_axis,
    quat_exp,
    quat_multiply,
    quat_normalize,
    rotate,
)

_Z = np.array([0.0, 0.0, 1.0])
# Placements of the formation that are weighed for several grippers.
_PLACEMENTS = 5000


def draw_initial_configurations(
    likelihood: ContactLikelihood, parameters: TransferParameters, rng: np.random.Generator
) -> Pose:
    """Draw configurations X_NG, batch (starts, n), with probability proportional to J.

    One gripper starts at candidates of its query density. For several grippers, one of them is
    placed on one of its candidates. The demonstrated formation is placed around it, at a random yaw
    and a scale from the prior, and the others move to their own nearest candidates.
    """
    if len(likelihood.queries) == 1:
        candidates = likelihood.queries[0].candidates
        placed = Pose(candidates.p[:, None], candidates.q[:, None])
        log_j = likelihood(placed, log_queries=[likelihood.queries[0].log_candidates])
    else:
        placed = _placements(likelihood, rng)
        log_j = likelihood(placed)
    return placed.take(systematic_resample(np.exp(log_j - log_j.max()), parameters.starts, rng))


def _placements(likelihood: ContactLikelihood, rng: np.random.Generator) -> Pose:
    from scipy.spatial import cKDTree

    n, configuration = len(likelihood.queries), likelihood.configuration
    yaw = rng.uniform(0.0, 2.0 * np.pi, _PLACEMENTS)
    scale = np.exp(
        likelihood.prior.log_mean + likelihood.prior.sigma * rng.standard_normal(_PLACEMENTS)
    )
    first = rng.integers(n, size=_PLACEMENTS)
    origin = np.empty((_PLACEMENTS, 3))
    offset = rotate(quat_about_axis(_Z, yaw), configuration.X_FG.p[first]) * scale[:, None]
    for k, query in enumerate(likelihood.queries):
        rows = np.flatnonzero(first == k)
        at: Array = query.candidates.p[rng.integers(len(query.candidates.p), size=len(rows))]
        origin[rows] = at - offset[rows]
    wanted = configuration.demonstrated_at(origin, yaw, scale)
    p, q = np.empty_like(wanted.p), np.empty_like(wanted.q)
    for k, query in enumerate(likelihood.queries):
        _, nearest = cKDTree(query.candidates.p).query(wanted.p[:, k])
        p[:, k], q[:, k] = query.candidates.p[nearest], query.candidates.q[nearest]
    return Pose(p, q)


def anneal(
    log_likelihood: Callable[[Pose], Array],
    starts: Pose,
    parameters: TransferParameters,
    rng: np.random.Generator,
    progress: Callable[[float], None] | None = None,
) -> tuple[Pose, Array]:
    """Maximise a log-likelihood over n poses by Metropolis chains that cool down.

    Steps shrink with the square root of the temperature. After a tenth of the steps only the best
    chains continue. With several grippers, steps alternate between moves of the whole formation and
    moves of each gripper by itself.

    Parameters
    ----------
    log_likelihood : callable
        Poses (C, n) to log J (C,).
    starts : Pose
        Start poses: p (C, n, 3) [m], q (C, n, 4).
    parameters : TransferParameters
        Steps, chains, temperatures.
    rng : numpy.random.Generator
        Random generator; it draws the steps.
    progress : callable, optional
        Called now and then with the fraction of the steps done.

    Returns
    -------
    best : Pose
        The most likely configuration of each remaining chain, batch (chains, n).
    log_j : (chains,) array
        Their log-likelihoods, best first.
    """
    X, value = starts, log_likelihood(starts)
    best, best_value = X, value
    first, last = parameters.temperature
    drop_at = parameters.steps // 10
    for step in range(parameters.steps):
        if step == drop_at and len(value) > parameters.chains:
            keep = np.sort(np.argsort(-value, kind="stable")[: parameters.chains])
            X, value, best, best_value = (
                X.take(keep),
                value[keep],
                best.take(keep),
                best_value[keep],
            )
        cooled = (last / first) ** (step / max(parameters.steps - 1, 1))
        size = np.sqrt(cooled)
        whole = X.p.shape[1] > 1 and step % 2 == 0
        trial = (_move_formation if whole else _move_each)(
            X, size * parameters.step_position, size * parameters.step_rotation, rng
        )
        trial_value = log_likelihood(trial)
        with np.errstate(over="ignore"):
            accepted = np.log(rng.random(len(value))) < (trial_value - value) / (first * cooled)
        X = _where(accepted, trial, X)
        value = np.where(accepted, trial_value, value)
        if progress is not None and step % 10 == 0:
            progress(step / parameters.steps)
        better = value > best_value
        best, best_value = _where(better, X, best), np.where(better, value, best_value)
    order = np.argsort(-best_value, kind="stable")
    return best.take(order), best_value[order]


def _move_each(X: Pose, step_p: float, step_q: float, rng: np.random.Generator) -> Pose:
    p = X.p + step_p * rng.standard_normal(X.p.shape)
    q = quat_multiply(X.q, quat_exp(step_q * rng.standard_normal(X.p.shape)))
    return Pose(p, quat_normalize(q))


def _move_formation(X: Pose, step_p: float, step_q: float, rng: np.random.Generator) -> Pose:
    """Shift the formation, turn it about its vertical, and stretch it."""
    chains = len(X.p)
    origin = X.p.mean(axis=1, keepdims=True)
    turn = quat_about_axis(_Z, step_q * rng.standard_normal(chains))[:, None, :]
    stretch = np.exp(0.5 * step_q * rng.standard_normal((chains, 1, 1)))
    shift = step_p * rng.standard_normal((chains, 1, 3))
    return Pose(
        origin + shift + rotate(turn, stretch * (X.p - origin)),
        quat_normalize(quat_multiply(turn, X.q)),
    )


def _where(mask: np.ndarray, a: Pose, b: Pose) -> Pose:
    wide = mask[:, None, None]
    return Pose(np.where(wide, a.p, b.p), np.where(wide, a.q, b.q))
