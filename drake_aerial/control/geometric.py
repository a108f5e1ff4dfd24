"""Geometric tracking law of a cable-suspended payload, with the paper's gains."""

from __future__ import annotations

import numpy as np

from drake_aerial.control.controller import OFFSET, PayloadController
from drake_aerial.control.controller_parameters import GeometricGains, GeometricParameters
from drake_aerial.dynamics.air_forces import payload_wrench
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.observation import Observation
from drake_aerial.geometry import Array, cross, matrix_from_quat
from drake_aerial.plant.air import rotor_drag
from drake_aerial.references.trajectory import Trajectory, TrajectorySample
from drake_aerial.statics.gravity import GRAVITY


def cable_forces(
    model: PayloadModelParameters,
    gains: GeometricGains,
    observation: Observation,
    desired: TrajectorySample,
) -> tuple[Array, Array]:
    """Return the desired cable forces on the payload.

    One cable carries the whole force. Several share force and moment with the least sum of
    squares. No force points down.

    Parameters
    ----------
    model : PayloadModelParameters
    gains : GeometricGains
    observation : Observation
    desired : TrajectorySample

    Returns
    -------
    mu : (n, 3) array
        Forces in the world [N].
    feedback : (3,) array
        Desired acceleration of the payload plus gravity, in the world [m/s^2].
    """
    M, around = model.mass, np.zeros(6)
    if model.air is not None:
        omega = cross(observation.R @ observation.W, observation.R @ model.p_LLcm)
        v = (observation.v + omega)[None]
        around = payload_wrench(model, observation.R[None], observation.W[None], v).wrench[0]
    feedback = desired.a + np.multiply(gains.position, desired.p - observation.p)
    feedback = feedback + np.multiply(gains.velocity, desired.v - observation.v)
    feedback[2] += GRAVITY
    if model.n == 1:
        mu = M * feedback[None] - around[None, 0:3]
    else:
        error = matrix_from_quat(desired.q).T @ observation.R
        error = 0.5 * (error - error.T)
        e_R = np.array([error[2, 1], error[0, 2], error[1, 0]])
        moment = -np.multiply(gains.rotation, e_R) - np.multiply(gains.rate, observation.W)
        force = M * observation.R.T @ feedback
        if model.air is not None:
            force, moment = force - around[0:3] @ observation.R, moment - around[3:6]
        wrench = np.concatenate([force, moment])
        mu = (model.grasp_inverse @ wrench).reshape(-1, 3) @ observation.R.T
    mu[:, 2] = np.maximum(mu[:, 2], 0.0)
    return mu, feedback


def geometric_thrust(
    model: PayloadModelParameters,
    gains: GeometricGains,
    observation: Observation,
    mu: Array,
    feedback: Array,
    mu_rate: Array,
) -> Array:
    """Return the thrust vectors (n, 3) [N] that turn the cables towards -mu and pull with mu.

    Parameters
    ----------
    model, gains, observation :
        As in `cable_forces`.
    mu, feedback :
        Results of `cable_forces`.
    mu_rate : (n, 3) array
        Rate of mu [N/s], for the desired rate of the cables; zeros without feed-forward.
    """
    m, l = model.quadrotor_mass[:, None], model.cable_length[:, None]
    xi, w = observation.xi, observation.w
    size = np.maximum(np.sqrt((mu * mu).sum(-1, keepdims=True)), 1e-6)
    xi_d = -mu / size
    rate = -mu_rate / size
    w_d = cross(xi_d, rate)
    contact = (
        feedback + cross(observation.W, cross(observation.W[None], model.arms)) @ observation.R.T
    )
    along = (xi * (mu + m * contact)).sum(-1, keepdims=True) * xi
    parallel = along + m * l * (w * w).sum(-1, keepdims=True) * xi
    e_xi = cross(xi_d, xi)
    e_w = w + cross(xi, cross(xi, w_d))
    turn = np.multiply(gains.direction, e_xi) + np.multiply(gains.direction_rate, e_w)
    thrust = parallel - m * l * cross(xi, turn) - m * cross(xi, cross(xi, contact))
    if model.air is None:
        return thrust
    return thrust - rotor_drag(model.air.rotor_drag, observation.z_WQ, -observation.v_WQ)


class GeometricController(PayloadController):
    """Cascade of payload, cable directions and thrusts.

    The kind "geometric" is the law as published. The kind "geometric_ff" feeds forward the desired
    rate of the cables, by differences of mu between control steps. The ports are those of
    `PayloadController`.

    Parameters
    ----------
    model : PayloadModelParameters
        Believed model.
    parameters : GeometricParameters, optional
        `GeometricParameters("geometric")` if not given.
    offset : float
        Delay from a sensor sample to the control step that reads it [s].

    Examples
    --------
    >>> from drake_aerial import GeometricController, GeometricParameters
    >>> from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
    >>> inertia = [[6e-3, 0, 0], [0, 5.9e-3, 0], [0, 0, 1.07e-2]]
    >>> belief = PayloadModelParameters(mass=0.25, inertia=inertia, p_LC=[[0, 0, 0.14]])
    >>> controller = GeometricController(belief, GeometricParameters("geometric_ff"))
    >>> controller.GetInputPort("quadrotor_states").size()
    13
    """

    default_parameters = GeometricParameters("geometric")

    def __init__(
        self,
        model: PayloadModelParameters,
        parameters: GeometricParameters | None = None,
        *,
        offset: float = OFFSET,
    ):
        self.parameters = p = parameters or self.default_parameters
        self._n = model.n
        super().__init__(
            model,
            period=p.period,
            offset=offset,
            take_off=p.take_off,
            position_filter=p.position_filter,
        )

    def initial_memory(self) -> Array:
        """Return zeros: a flag (1 if there is a previous mu) and the previous mu (3 n)."""
        return np.zeros(1 + 3 * self._n)

    def for_smaller_team(self, model: PayloadModelParameters) -> GeometricController | None:
        """Return the same law for a smaller team."""
        return GeometricController(model, self.parameters, offset=self.offset)

    def compute_thrusts(
        self,
        t: float,
        observation: Observation,
        reference: Trajectory,
        thrust: Array,
        memory: Array,
    ) -> Array:
        """Return the thrusts (n, 3) [N] of the law; see `PayloadController`."""
        gains = self.parameters.gains
        mu, feedback = cable_forces(self.model, gains, observation, reference.sample(t))
        rate = np.zeros_like(mu)
        if self.parameters.kind == "geometric_ff" and memory[0]:
            rate = (mu - memory[1:].reshape(-1, 3)) / self.period
        memory[0], memory[1:] = 1.0, mu.ravel()
        return geometric_thrust(self.model, gains, observation, mu, feedback, rate)
