"""Changes of a reference by an external wrench and by wind."""

import numpy as np

from drake_aerial.dynamics.air_forces import payload_wrench
from drake_aerial.dynamics.flatness import Reference, producible_attitude
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.geometry import (
    Array,
    cross,
    matrix_from_quat,
    quat_conjugate,
    quat_multiply,
    small_cross,
)
from drake_aerial.plant.air import rotor_drag


def disturbed(
    model: PayloadModelParameters, yaw: float, desired: Reference, wrench: Array
) -> Reference:
    """Return the reference (batch B) of a payload under an external wrench.

    The cables' forces balance the wrench; for contacts on a line the attitude does its part. At
    rest the result is an equilibrium of the model under the wrench. In motion the effect of the
    wrench on the accelerations of the cables and on the payload's rotation is neglected.

    Parameters
    ----------
    model : PayloadModelParameters
    yaw : float
        Yaw of the trajectory [rad].
    desired : Reference
        Reference without the wrench.
    wrench : (6,) or (B, 6) array
        Force on the CoM in the world [N], moment in the axes of L [N m].
    """
    force = desired.mu.sum(1)
    changed, moment, R = force - wrench[..., 0:3], desired.moment - wrench[..., 3:6], desired.R
    if model.hinged:
        before = producible_attitude(model, yaw, force, desired.moment)
        after = producible_attitude(model, yaw, changed, moment)
        R = matrix_from_quat(quat_multiply(after, quat_conjugate(before))) @ R
    needed = np.concatenate([(changed[:, None] @ R)[:, 0], moment], axis=1)
    mu = (needed @ model.grasp_inverse.T).reshape(-1, model.n, 3) @ np.swapaxes(R, 1, 2)
    size = np.sqrt((mu * mu).sum(-1, keepdims=True))
    xi = -mu / size
    # The direction of a smaller force turns faster.
    rate = cross(desired.w, desired.xi) * (np.sqrt((desired.mu**2).sum(-1, keepdims=True)) / size)
    more = mu - desired.mu
    return desired._replace(
        R=R,
        xi=xi,
        w=cross(xi, rate),
        F=desired.F + more,
        u=desired.u + more,
        pull=changed / np.sqrt((changed * changed).sum(-1, keepdims=True)),
        mu=mu,
        moment=moment,
    )


def blown(
    model: PayloadModelParameters, yaw: float, desired: Reference, wind: Array, step: float
) -> Reference:
    """Return the reference at equal time steps for a constant wind, from that in still air.

    The cables balance the drag, and their directions and the thrusts follow its change along the
    path, by differences of second order. The payload's attitude does its part where contacts are
    on a line; the effect of its own acceleration is neglected.

    Parameters
    ----------
    model : PayloadModelParameters
        With air.
    yaw : float
        Yaw of the trajectory [rad].
    desired : Reference
        Reference in still air at times `step` apart (batch B > 2).
    wind : (3,) array
        Velocity of the air in the world [m/s].
    step : float
        [s]
    """
    assert model.air is not None
    W = np.vecmat(desired.omega, desired.R)
    v = desired.v + small_cross(desired.omega, desired.R @ model.p_LLcm)
    still = payload_wrench(model, desired.R, W, v).wrench
    new = desired
    for _ in range(4 if model.hinged else 1):
        more = payload_wrench(model, new.R, W, v, wind).wrench - still
        new = disturbed(model, yaw, desired, more)
    change = new.xi - desired.xi
    rate = _differentiate(change, step)
    l, m = model.cable_length[:, None], model.quadrotor_mass[:, None]
    xi_dot = cross(desired.w, desired.xi) + rate
    xi_dot -= np.vecdot(xi_dot, new.xi)[..., None] * new.xi
    arms = small_cross(desired.omega[:, None], model.p_LC @ desired.R.mT)
    v_Q = desired.v[:, None] + arms - l * xi_dot
    F = new.F - m * l * _differentiate(rate, step)
    for _ in range(2):
        axis = F / np.sqrt(np.vecdot(F, F))[..., None]
        drag = rotor_drag(model.air.rotor_drag, axis, np.broadcast_to(wind, v_Q.shape))
        F = new.F - m * l * _differentiate(rate, step) - drag
    more_F = F - desired.F
    u = desired.u + more_F + model.thrust_lag * _differentiate(more_F, step)
    return new._replace(w=cross(new.xi, xi_dot), F=F, u=u)


def _differentiate(values: Array, step: float) -> Array:
    """Return time derivatives of values (B, ...) at equal steps [s]."""
    rate = np.empty_like(values)
    rate[1:-1] = values[2:] - values[:-2]
    rate[0] = -3.0 * values[0] + 4.0 * values[1] - values[2]
    rate[-1] = 3.0 * values[-1] - 4.0 * values[-2] + values[-3]
    rate *= 0.5 / step
    return rate
