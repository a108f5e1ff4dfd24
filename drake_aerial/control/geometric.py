"""The geometric tracking law of a cable-suspended payload, with the paper's gains."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_aerial.control.controller import PayloadController
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.observation import Observation
from drake_aerial.geometry import Array, cross, matrix_from_quat
from drake_aerial.references.trajectory import Trajectory, TrajectorySample
from drake_aerial.statics.gravity import GRAVITY

Gain = tuple[float, float, float]


@dataclass(frozen=True)
class GeometricGains:
    """The payload's rows of the paper's table, and its rows for the cable's direction; along x, y, z.

    Attributes
    ----------
    position, velocity : (3,)
        Of the payload [1/s^2, 1/s].
    rotation, rate : (3,)
        Of the payload's attitude [N m, N m s].
    direction, direction_rate : (3,)
        Of the cables' directions [1/s^2, 1/s], scaled by m l.
    """

    position: Gain = (1.45, 1.45, 3.0)
    velocity: Gain = (3.7, 3.2, 2.5)
    rotation: Gain = (0.5, 0.5, 0.02)
    rate: Gain = (0.16, 0.16, 0.04)
    direction: Gain = (16.0, 16.0, 16.0)
    direction_rate: Gain = (6.7, 6.7, 3.1)


def cable_forces(
    model: PayloadModelParameters,
    gains: GeometricGains,
    seen: Observation,
    desired: TrajectorySample,
) -> tuple[Array, Array]:
    """Return the desired cable forces on the payload mu (n, 3) [N], in the world, and F/M (3,) [m/s^2].

    One quadrotor carries the whole force; several share force and moment with the least sum of squares, and none
    pushes down.
    """
    M = model.mass
    feedback = desired.a + np.multiply(gains.position, desired.p - seen.p)
    feedback = feedback + np.multiply(gains.velocity, desired.v - seen.v)
    feedback[2] += GRAVITY
    if model.n == 1:
        mu = M * feedback[None]
    else:
        error = matrix_from_quat(desired.q).T @ seen.R
        error = 0.5 * (error - error.T)
        e_R = np.array([error[2, 1], error[0, 2], error[1, 0]])
        moment = -np.multiply(gains.rotation, e_R) - np.multiply(gains.rate, seen.W)
        wrench = np.concatenate([M * seen.R.T @ feedback, moment])
        mu = (np.linalg.pinv(model.grasp_matrix) @ wrench).reshape(-1, 3) @ seen.R.T
    mu[:, 2] = np.maximum(mu[:, 2], 0.0)
    return mu, feedback


def geometric_thrust(
    model: PayloadModelParameters,
    gains: GeometricGains,
    seen: Observation,
    mu: Array,
    feedback: Array,
    mu_rate: Array,
) -> Array:
    """Return the thrust vectors (n, 3) [N] that turn the cables towards -mu and pull with mu along them.

    Parameters
    ----------
    model, gains, seen :
        The model, the gains, the measured state.
    mu, feedback :
        What `cable_forces` returns.
    mu_rate : (n, 3) array
        Rate of mu [N/s], for the desired rate of the cables; zeros for the law without feed-forward.
    """
    m, l = model.quadrotor_mass[:, None], model.cable_length[:, None]
    xi, w = seen.xi, seen.w
    size = np.maximum(np.sqrt((mu * mu).sum(-1, keepdims=True)), 1e-6)
    xi_d = -mu / size
    rate = -mu_rate / size
    w_d = cross(xi_d, rate)
    contact = feedback + cross(seen.W, cross(seen.W[None], model.arms)) @ seen.R.T
    along = (xi * (mu + m * contact)).sum(-1, keepdims=True) * xi
    parallel = along + m * l * (w * w).sum(-1, keepdims=True) * xi
    e_xi = cross(xi_d, xi)
    e_w = w + cross(xi, cross(xi, w_d))
    turn = np.multiply(gains.direction, e_xi) + np.multiply(gains.direction_rate, e_w)
    return parallel - m * l * cross(xi, turn) - m * cross(xi, cross(xi, contact))


class GeometricController(PayloadController):
    """Cascade of payload, cable directions and thrust: `geometric`, and `geometric_ff` with `feedforward`.

    Ports and the other parameters are those of `PayloadController`.

    Parameters
    ----------
    model : PayloadModelParameters
        What the controller believes.
    feedforward : bool
        Whether the desired cables' rate is fed forward, by differencing mu between ticks.
    gains : GeometricGains

    Examples
    --------
    >>> from drake_aerial import GeometricController
    >>> from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
    >>> belief = PayloadModelParameters(mass=0.25, inertia=[[6e-3, 0, 0], [0, 5.9e-3, 0], [0, 0, 1.07e-2]], p_LC=[[0, 0, 0.14]])
    >>> GeometricController(belief, feedforward=True).GetInputPort("quadrotor_states").size()
    13
    """

    def __init__(
        self,
        model: PayloadModelParameters,
        *,
        feedforward: bool = False,
        gains: GeometricGains | None = None,
        **keywords: Any,
    ):
        self.feedforward = feedforward
        self.gains = gains or GeometricGains()
        self._n = model.n
        super().__init__(model, **keywords)

    def _initial_memory(self) -> Array:
        return np.zeros(1 + 3 * self._n)  # whether there is a last mu, and the last mu

    def _reduced(self, model: PayloadModelParameters) -> GeometricController:
        return GeometricController(
            model, feedforward=self.feedforward, gains=self.gains, period=self.period
        )

    def _fly(
        self, t: float, seen: Observation, reference: Trajectory, thrust: Array, memory: Array
    ) -> Array:
        mu, feedback = cable_forces(self.model, self.gains, seen, reference.sample(t))
        rate = np.zeros_like(mu)
        if self.feedforward and memory[0]:
            rate = (mu - memory[1:].reshape(-1, 3)) / self.period
        memory[0], memory[1:] = 1.0, mu.ravel()
        return geometric_thrust(self.model, self.gains, seen, mu, feedback, rate)
