"""Elastic cables over one step of the plant: their mean pull, and the stability of the step."""

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.plant.cable import CableParameters

_SUBSTEPS_TAUT = 4
_SUBSTEPS_MEETING = 20


def pull(stretch: Array, rate: Array, stiffness: Array, damping: Array) -> Array:
    """Return the tensions (n,) [N] of cables from their stretches [m] and rates [m/s], (n,) each.

    A slack cable has no tension, and no cable pushes.
    """
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
    """Return the constant tensions (n,) [N] that act on the plant during one step.

    Their impulse is that of cables that tighten and slacken within the step. The plant adds the
    impulse of a step to the velocities first and then moves the positions by the new velocities,
    so its velocities are those of half a step before its positions (leapfrog). The step therefore
    begins half a step before the given positions. In it the stretches s follow
    s'' = other - D T(s, s'), integrated by the midpoint rule in parts of the step. A cable that
    goes taut within a step pulls from there on, which an explicit force at either end of the step
    could not do.

    Parameters
    ----------
    stretch, rate : (n,) arrays
        Distance from quadrotor to contact less the cable's length [m], and its rate [m/s], as the
        plant has them.
    other : (n,) array
        Accelerations of the stretches from everything but the cables [m/s^2].
    matrix : (n, n) array
        D, which takes tensions to the rates at which they shorten the cables [1/kg]; see
        `tension_matrix`.
    stiffness, damping : (n,) arrays
        [N/m], [N s/m]
    time_step : float
        [s]
    """
    # The largest change of a stretch within the step, without any tension.
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


def tension_matrix(
    quadrotor_masses: Array, mass: float, inertia: Array, p_LoC: Array, xi: Array
) -> Array:
    """Return the matrix (n, n) from tensions [N] to shortening accelerations of the cables [m/s^2].

    Its elements are d_ij/m_i + xi_i.xi_j/M + (a_i x xi_i).J^-1 (a_j x xi_j), with all vectors in
    the payload's frame.

    Parameters
    ----------
    quadrotor_masses : (n,) array [kg]
    mass, inertia : float, (3, 3) array
        Of the payload with its grippers [kg], about its centre of mass [kg m^2].
    p_LoC : (n, 3) array
        Contacts from the centre of mass [m].
    xi : (n, 3) array
        Cable directions, from quadrotor to contact.
    """
    arms = np.cross(p_LoC, xi)
    return (
        np.diag(1.0 / quadrotor_masses) + xi @ xi.T / mass + arms @ np.linalg.solve(inertia, arms.T)
    )


def check_elastic_step(parameters: CableParameters, time_step: float, largest: float) -> float:
    """Return the stability number of the explicit step of an elastic cable.

    The number is dt^2 k lambda + 2 dt c lambda. The step is stable below 4 and accepted below 2.

    Parameters
    ----------
    parameters : CableParameters
    time_step : float
        dt [s]
    largest : float
        lambda, the largest eigenvalue of `tension_matrix` [1/kg].

    Raises
    ------
    InputError
        If the number is 2 or more; the message gives admissible values of step, damping and
        stiffness.
    """
    k, c, dt, limit = parameters.stiffness, parameters.damping, time_step, 2.0
    number = (dt**2 * k + 2.0 * dt * c) * largest
    if number < limit:
        return number
    budget = limit / largest
    c_max, k_max = (budget - dt**2 * k) / (2.0 * dt), (budget - 2.0 * dt * c) / dt**2
    dt_max = (-c + np.sqrt(c**2 + k * budget)) / k
    options = [f"`time_step` below {1e3 * dt_max:.3g} ms"]
    if c_max > 0.0:
        options.append(f"`damping` below {c_max:.3g} N s/m")
    if k_max > 0.0:
        options.append(f"`stiffness` below {k_max:.3g} N/m")
    raise InputError(
        f"the stability number of an elastic cable must be below {limit:g}, got {number:.2f} with "
        f"stiffness {k:g} N/m, damping {c:g} N s/m and a step of {1e3 * dt:g} ms: use "
        f"{' or '.join(options)}"
    )
