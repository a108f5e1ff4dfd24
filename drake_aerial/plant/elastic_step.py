"""The mean pull of elastic cables over one step of the plant, from the motion of their stretches within it."""

from __future__ import annotations

import numpy as np

from drake_aerial.geometry import Array

_SUBSTEPS_TAUT = 4
_SUBSTEPS_MEETING = 20


def pull(stretch: Array, rate: Array, stiffness: Array, damping: Array) -> Array:
    """Return the tensions (n,) [N] of cables with these stretches (n,) [m] and rates (n,) [m/s]: none while slack, never a push."""
    return np.where(stretch > 0.0, np.maximum(0.0, stiffness * stretch + damping * rate), 0.0)


def mean_pull(
    stretch: Array,
    rate: Array,
    other: Array,
    matrix: Array,
    stiffness: Array,
    damping: Array,
    time_step: float,
) -> Array:
    """Return the tensions (n,) [N] whose impulse over one step is that of cables that tighten and slacken within it.

    The plant adds the impulse of a step to velocities first and moves positions by the new ones, so its velocities are those of
    half a step before its positions (leapfrog). The step that one impulse stands for therefore begins half a step before the
    positions given. In it the stretches s follow s'' = other - D T(s, s'), integrated by the midpoint rule in parts of the step;
    a cable that goes taut in the middle of a step pulls from there on, as an explicit force at either end of it could not.

    Parameters
    ----------
    stretch, rate : (n,) arrays
        Distance from quadrotor to contact less the cable's length [m], and its rate [m/s], as the plant has them.
    other : (n,) array
        The stretches' accelerations from everything but the cables [m/s^2].
    matrix : (n, n) array
        D: takes tensions to the rates at which they shorten the cables [1/kg]; see `tension_matrix`.
    stiffness, damping : (n,) arrays
        [N/m], [N s/m]
    time_step : float
        [s]
    """
    # How far a stretch can get within the step, were no cable to hold it back.
    reach = time_step * (np.abs(rate) + time_step * np.abs(other))
    if (stretch + reach <= 0.0).all():
        return np.zeros_like(stretch)
    meets = np.abs(stretch) <= 2.0 * reach
    count = _SUBSTEPS_MEETING if meets.any() else _SUBSTEPS_TAUT
    h = time_step / count
    s, r = stretch - 0.5 * time_step * rate, rate
    total = np.zeros_like(stretch)
    for _ in range(count):
        middle = r + 0.5 * h * (other - matrix @ pull(s, r, stiffness, damping))
        tension = pull(s + 0.5 * h * r, middle, stiffness, damping)
        total += tension
        s = s + h * middle
        r = r + h * (other - matrix @ tension)
    return total / count
