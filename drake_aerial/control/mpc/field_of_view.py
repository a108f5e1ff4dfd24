"""Penalty on a payload outside the view of a quadrotor's downward camera, for the MPC."""

import numpy as np

from drake_aerial.dynamics.payload_model import PayloadState
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.geometry import Array, skew


def view_violation(
    model: PayloadModelParameters, x: PayloadState, E: Array, half_angle: float
) -> tuple[Array, Array]:
    """Return the violation of the cones of view, and its Jacobian on the error state.

    A camera looks against its quadrotor's thrust. With d the vector from the quadrotor to L's
    origin and F the thrust, the violation is cos(half_angle) + d.F / (|d| |F|): zero on the cone of
    view, positive outside.

    Parameters
    ----------
    model : PayloadModelParameters
    x : PayloadState
        Batch B.
    E : (B, n, 3, 2) array
        Tangent bases at x.
    half_angle : float
        Half angle of the cone of view [rad].

    Returns
    -------
    violation : (B, n) array
    jacobian : (B, n, nx) array
    """
    B, n = x.xi.shape[:2]
    l = model.cable_length[:, None]
    d = l * x.xi - model.p_LC @ np.swapaxes(x.R, 1, 2)
    size_d = np.sqrt((d * d).sum(-1, keepdims=True))
    size_F = np.maximum(np.sqrt((x.F * x.F).sum(-1, keepdims=True)), 1e-6)
    d, F = d / size_d, x.F / size_F
    cosine = (d * F).sum(-1, keepdims=True)
    by_d = (F - cosine * d) / size_d
    J = np.zeros((B, n, 12 + 7 * n))
    J[:, :, 6:9] = (by_d[:, :, None] @ (x.R[:, None] @ skew(model.p_LC)))[:, :, 0]
    tilt = np.stack([-E[..., 1], E[..., 0]], axis=-1)
    by_tilt = l * (by_d[:, :, None] @ tilt)[:, :, 0]
    by_F = (d - cosine * F) / size_F
    for i in range(n):
        J[:, i, 12 + 2 * i : 14 + 2 * i] = by_tilt[:, i]
        J[:, i, 12 + 4 * n + 3 * i : 15 + 4 * n + 3 * i] = by_F[:, i]
    return cosine[:, :, 0] + np.cos(half_angle), J


def view_penalty(violation: Array, jacobian: Array, weight: float | Array) -> tuple[Array, Array]:
    """Return Hessians and gradients of weight/2 sum max(0, violation)^2, by Gauss-Newton.

    Parameters
    ----------
    violation : (B, n) array
    jacobian : (B, n, nx) array
    weight : float or (B, 1) array

    Returns
    -------
    hessian, gradient : (B, nx, nx), (B, nx) arrays
    """
    outside = weight * np.maximum(violation, 0.0)
    active = weight * (violation > 0.0)
    hessian = np.swapaxes(jacobian, 1, 2) @ (active[:, :, None] * jacobian)
    return hessian, (outside[:, None] @ jacobian)[:, 0]
