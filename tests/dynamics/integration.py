"""Oracles for the payload model: Runge-Kutta integration, and differences of states."""

import numpy as np

from drake_aerial.dynamics.payload_model import (
    PayloadState,
    derivative,
    rotation_exp,
    rotation_log,
    tangent_basis,
)
from drake_aerial.geometry import small_cross


def transport(a, b, vector):
    """Rotate `vector` (..., 3) by the smallest rotation from unit a (..., 3) to unit b (..., 3)."""
    c = small_cross(a, b)
    cv = small_cross(c, vector)
    return vector + cv + small_cross(c, cv) / (1.0 + (a * b).sum(-1))[..., None]


def difference(x, y):
    """Return the error states (B, nx) that `retract` x to y."""
    B, n = x.xi.shape[:2]
    ET = np.swapaxes(tangent_basis(x.xi), -1, -2)
    c = small_cross(x.xi, y.xi)
    sine = np.sqrt((c * c).sum(-1, keepdims=True))
    angle = np.arctan2(sine, (x.xi * y.xi).sum(-1, keepdims=True))
    rho = c * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-300), 1.0)
    dw = transport(y.xi, x.xi, y.w) - x.w
    theta = rotation_log(np.swapaxes(x.R, 1, 2) @ y.R)
    return np.concatenate(
        [
            y.p - x.p,
            y.v - x.v,
            theta,
            y.W - x.W,
            (ET @ rho[..., None]).reshape(B, 2 * n),
            (ET @ dw[..., None]).reshape(B, 2 * n),
            (y.F - x.F).reshape(B, 3 * n),
        ],
        axis=1,
    )


def integrate(model, x, u, step, steps=1, wind=None):
    """Return the states after `steps` Runge-Kutta steps of 4th order, `step` [s], u constant."""

    def flow(rate, scale):
        if rate is None:
            return x
        xi = x.xi + scale * rate.xi
        return PayloadState(
            x.p + scale * rate.p,
            x.v + scale * rate.v,
            x.R @ rotation_exp(scale * rate.R),
            x.W + scale * rate.W,
            xi / np.linalg.norm(xi, axis=-1, keepdims=True),
            x.w + scale * rate.w,
            x.F + scale * rate.F,
        )

    def rates(before, scale):
        at = flow(before, scale)
        d = derivative(model, at, u, wind=wind)
        # The rotation is integrated in the exponential chart at x: theta' is a series of W.
        theta = np.zeros_like(d.W) if before is None else scale * before.R
        half = small_cross(theta, d.W)
        theta_dot = d.W + half / 2 + small_cross(theta, half) / 12
        return PayloadState(d.v, d.a, theta_dot, d.dW, small_cross(at.w, at.xi), d.dw, d.dF)

    for _ in range(steps):
        k1 = rates(None, 0.0)
        k2 = rates(k1, step / 2)
        k3 = rates(k2, step / 2)
        k4 = rates(k3, step)
        x = flow(
            PayloadState(*((a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4))), step
        )
        x = x._replace(w=x.w - x.xi * (x.w * x.xi).sum(-1, keepdims=True))
    return x
