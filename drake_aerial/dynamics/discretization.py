"""Discretisation of the linearised payload model, and change of its charts; in batches."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_aerial.dynamics.linearization import Linearization
from drake_aerial.dynamics.payload_model import PayloadState
from drake_aerial.geometry import IDENTITY, Array, skew, vee

_SERIES_REACH = 1.7
"""Largest ratio of a step to a thrust lag at which the series is exact to 1e-3."""


class DiscreteModel(NamedTuple):
    """Steps delta(h) = drift + Phi delta(0) + Gamma (u - u_bar), in the charts at their beginnings.

    Attributes
    ----------
    flow : (B, nx, 3 n + nx + 1) array
        Gamma, Phi and drift side by side.
    """

    flow: Array

    @property
    def Phi(self) -> Array:
        """Transition matrices (B, nx, nx), a view."""
        return self.flow[:, :, -1 - self.flow.shape[1] : -1]

    @property
    def Gamma(self) -> Array:
        """Input matrices (B, nx, 3 n), a view."""
        return self.flow[:, :, : -1 - self.flow.shape[1]]

    @property
    def drift(self) -> Array:
        """Drift (B, nx) at zero deviation, a view."""
        return self.flow[:, :, -1]


def discretize(linear: Linearization, step: float) -> DiscreteModel:
    """Return the flow of the linearised model over `step` [s] with constant input, exact to 1e-3.

    Short thrust lags make the model stiff. Where a lag is below step / 1.7, the step is halved
    until the series holds, and the result is squared as often. With air it is exact to 2e-3.
    """
    halvings = max(0, math.ceil(math.log2(step * float(linear.B_F.max()) / _SERIES_REACH)))
    discrete = _series(linear, step / 2**halvings)
    for _ in range(halvings):
        discrete = repeated(discrete, np.full(len(discrete.flow), 2))
    return discrete


def _series(linear: Linearization, step: float) -> DiscreteModel:
    """Return the flow over `step` [s] by Taylor series.

    The matrix exponential and its integrals are series of the core y to the seventh order; p and v
    are integrals of y.
    """
    B, ny = linear.A_y.shape[:2]
    nx, nu = ny + 6, len(linear.B_F)
    Z = step * linear.A_y
    Z2 = Z @ Z
    tail = Z * (1 / 720)
    tail += Z2 * (1 / 5040)
    S3 = Z2 @ tail
    S3 += Z * (1 / 24)
    S3 += Z2 * (1 / 120)
    _diagonal(S3)[:] += 1 / 6
    S2 = Z @ S3
    _diagonal(S2)[:] += 0.5
    S1 = Z @ S2
    _diagonal(S1)[:] += 1.0
    # Effect of a constant rate of y on y, v and p, shared by inputs and drift.
    flow = np.zeros((B, nx, nu + nx + 1))
    sources = np.zeros((B, ny, nu + 1))
    sources.reshape(B, -1)[:, (ny - nu) * (nu + 1) :: nu + 2] = linear.B_F
    sources[:, :, nu] = linear.rate[:, 6:]
    Gamma, Phi, drift = flow[:, :, :nu], flow[:, :, nu:-1], flow[:, :, -1]
    v = (step * linear.A_v) @ S1
    Phi[:, 3:6, 6:] = v
    np.matmul(Z, S1, out=Phi[:, 6:, 6:])
    A2 = (step**2 * linear.A_v) @ S2
    Phi[:, 0:3, 6:] = A2
    moved = np.concatenate([(step**3 * linear.A_v) @ S3, A2, step * S1], axis=1) @ sources
    Gamma[:] = moved[:, :, :nu]
    drift[:] = moved[:, :, nu]
    f_v = step * linear.rate[:, 3:6]
    drift[:, 0:3] += step * linear.rate[:, 0:3] + 0.5 * step * f_v
    drift[:, 3:6] += f_v
    flow.reshape(B, -1)[:, nu :: nu + nx + 2] += 1.0
    Phi[:, 0:3, 3:6] = step * IDENTITY
    if linear.by_v is not None:
        _add_damping(flow, linear.by_v, step)
    return DiscreteModel(flow)


def _add_damping(flow: Array, by_v: Array, step: float) -> None:
    """Add the effect of v on (v', y') to a flow (B, nx, nu + nx + 1) over `step` [s], in place.

    Half of it acts before the flow and half after it (Strang splitting), which is exact to the
    second order of the step.
    """
    nu = flow.shape[2] - flow.shape[1] - 1
    half = (0.5 * step) * by_v
    half += 0.5 * half @ half[:, 0:3]
    v = slice(nu + 3, nu + 6)
    flow[:, :, v] += flow[:, :, nu + 3 : -1] @ half
    flow[:, 3:] += half @ flow[:, 3:6]


def repeated(discrete: DiscreteModel, times: Array) -> DiscreteModel:
    """Return longer steps: step k is taken times[k] times in its own chart, with the same input.

    The given matrices are changed in place.

    Parameters
    ----------
    discrete : DiscreteModel
        Batch B.
    times : (B,) int array
    """
    flow, longest = discrete.flow, int(times.max())
    nu = flow.shape[2] - flow.shape[1] - 1
    once = flow.copy() if longest > 2 else flow
    for k in range(1, longest):
        more = _run(np.flatnonzero(times > k))
        step = once[more]
        after = step[:, :, nu:-1] @ flow[more]
        after[:, :, :nu] += step[:, :, :nu]
        after[:, :, -1] += step[:, :, -1]
        flow[more] = after
    return discrete


def _run(index: NDArray[np.intp]) -> slice | NDArray[np.intp]:
    """Return an ascending index as a slice if it has no gaps; a slice takes no copy."""
    first, end = int(index[0]), int(index[-1]) + 1
    return slice(first, end) if end - first == len(index) else index


def _diagonal(matrices: Array) -> Array:
    """Return a writable view of the diagonals (B, k) of contiguous matrices (B, k, k)."""
    return matrices.reshape(len(matrices), -1)[:, :: matrices.shape[-1] + 1]


def change_chart(
    discrete: DiscreteModel, x: PayloadState, E: Array, y: PayloadState, E_y: Array
) -> DiscreteModel:
    """Express the results of steps that start in the charts at x in the charts at y.

    The given matrices are changed in place and returned.

    Parameters
    ----------
    discrete : DiscreteModel
        Steps in the charts at x (batch B).
    x, y : PayloadState
        Where each step starts, and about where it ends. The distance of its end from y enters to
        first order.
    E, E_y : (B, n, 3, 2) arrays
        Tangent bases at x and y.
    """
    B, n = x.xi.shape[:2]
    flow, drift, c = discrete.flow, discrete.drift, 12 + 2 * n
    drift[:, 0:3] += x.p - y.p
    drift[:, 3:6] += x.v - y.v
    drift[:, 9:12] += x.W - y.W
    drift[:, c + 2 * n :] += (x.F - y.F).reshape(B, 3 * n)
    # exp(d) = exp(phi) exp(c) with phi the rotation from x to y: c = J_r(phi) (d - phi) near y.
    turned = x.R.mT @ y.R
    phi = _arc(vee(turned))
    K = skew(phi)
    turn = K @ K
    turn /= 6
    turn -= 0.5 * K
    _diagonal(turn)[:] += 1.0
    drift[:, 6:9] -= phi
    flow[:, 6:9] = turn @ flow[:, 6:9]
    # Cables: where y lies in the chart at x, and how the bases turn on the shortest arc to there.
    to_y = np.vecmat(y.xi, E)
    to_x = np.vecmat(x.xi, E_y)
    cosine = np.vecdot(x.xi, y.xi)[:, :, None]
    frame = E_y.mT @ E
    frame -= to_x[..., :, None] * (to_y / (1.0 + cosine))[..., None, :]
    place = np.empty_like(to_y)
    place[..., 0] = -to_y[..., 1]
    place[..., 1] = to_y[..., 0]
    drift[:, 12:c] -= _arc(place).reshape(B, 2 * n)
    drift[:, c : c + 2 * n] += np.vecmat(x.w, E).reshape(B, 2 * n)
    block = flow[:, 12 : c + 2 * n].reshape(B, 2, n, 2, -1)
    np.matmul(frame[:, None], block.copy(), out=block)
    drift[:, c : c + 2 * n] -= np.vecmat(y.w, E_y).reshape(B, 2 * n)
    return discrete


def _arc(sine: Array) -> Array:
    """Return rotation vectors from their axes times the sines of their angles (..., 3).

    A series for angles well below 1 rad.
    """
    s = np.vecdot(sine, sine)[..., None]
    return sine * (1.0 + s * (1 / 6 + s * (3 / 40 + s * (15 / 336))))
