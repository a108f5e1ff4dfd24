"""Wind observer: the velocity of the air, and the remaining unmodelled force and moment."""

from __future__ import annotations

from typing import Literal

import numpy as np

from drake_aerial.dynamics.air_forces import drag_by_velocity, payload_wrench
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.errors import InputError
from drake_aerial.estimation.disturbance_observer import Disturbance, ObserverMemory, residual
from drake_aerial.estimation.observation import Observation
from drake_aerial.geometry import IDENTITY, Array, cross
from drake_aerial.io.records import NonNegative, Positive, record
from drake_aerial.plant.air import rotor_drag

_SIZE = 9
"""Wind, force and moment, three each."""


@record(frozen=True)
class WindObserver:
    """Extended Kalman filter of the wind, an unmodelled force and a moment on the payload.

    The measurements are the forces and the moment behind the change of the measured velocities
    between two control steps, as for `DisturbanceObserver`. The wind explains what the drag of the
    model can explain: a horizontal force, on the quadrotors too, that changes with the velocity.
    The rest, such as an error of the mass or of the thrust, is a force and a moment. All three are
    random walks. Nothing is limited: an estimate may have any size.

    It needs a model with air. In calm air the payload's quadratic drag says nothing of a small
    wind; there the rotor drag does, which is linear.

    Examples
    --------
    >>> from drake_aerial import FlightOptions, MpcParameters
    >>> from drake_aerial.estimation.wind_observer import WindObserver
    >>> options = FlightOptions(controller=MpcParameters(observer=WindObserver(wind_change=1.0)))
    >>> options.controller_parameters.observer.kind
    'wind'
    """

    kind: Literal["wind"] = "wind"
    """wind; force is the other observer, `DisturbanceObserver`."""
    velocity_noise: Positive = 0.01
    """Standard deviation of the error of measured velocities [m/s]."""
    rate_noise: Positive = 0.02
    """Standard deviation of the error of measured angular velocities [rad/s]."""
    wind_change: Positive = 0.7
    """Change of the horizontal wind in one second, standard deviation [m/s]."""
    vertical_share: NonNegative = 0.3
    """Vertical over horizontal change of the wind (dimensionless)."""
    force_change: NonNegative = 0.05
    """Change of the remaining force in one second over the payload's weight, standard deviation
    (dimensionless); a fifth of it sideways, where wind is the better explanation."""
    moment_change: NonNegative = 0.02
    """Change of the remaining moment in one second over the payload's weight [m]."""

    @staticmethod
    def size(n: int) -> int:
        """Return the length of the memory for n quadrotors; zeros are the initial state."""
        return 7 + 12 * n + _SIZE + _SIZE * _SIZE

    def advance(
        self,
        model: PayloadModelParameters,
        memory: Array,
        observation: Observation,
        thrust: Array,
        dt: float,
    ) -> tuple[Disturbance, Array]:
        """Return the disturbance and the memory after an observation.

        Parameters
        ----------
        model : PayloadModelParameters
            With air.
        memory : array
            Last velocities, and the estimate with its covariance.
        observation : Observation
        thrust : (n, 3) array
            Thrusts commanded since the last observation, in the world [N].
        dt : float
            Time since the last observation [s].

        Raises
        ------
        InputError
            If the model has no air.
        """
        if model.air is None:
            raise InputError(
                "`observer` of kind wind needs a model with air, got one without: give the station "
                "`air`, or choose the kind force"
            )
        n, o = model.n, observation
        v = o.v + o.R @ cross(o.W, model.p_LLcm)
        quadrotors = np.concatenate([o.v_WQ, o.xi, o.xi @ o.R, o.z_WQ]).reshape(4, n, 3)
        last, first = memory[: 7 + 12 * n], 7 + 12 * n
        x, P = memory[first : first + _SIZE], memory[first + _SIZE :].reshape(_SIZE, _SIZE)
        weight = model.weight
        if last[0]:
            before = ObserverMemory(
                1.0, last[1:4], last[4:7], last[7:].reshape(4, n, 3), np.zeros(0)
            )
            found = residual(model, before, v, o.W, quadrotors, thrust, dt)
            P = P + dt * np.diag(self._changes(weight))
            x, P = self._update(model, x, P, found, 0.5 * (v + before.v), o, quadrotors, dt)
        else:
            P = np.diag(self._changes(weight))
            x = np.zeros(_SIZE)
        after = np.concatenate([[1.0], v, o.W, quadrotors.ravel(), x, P.ravel()])
        return Disturbance(x[3:6], x[6:9], np.zeros((n, 3)), limited=False, wind=x[0:3]), after

    def _changes(self, weight: float) -> Array:
        """Return the variances (9,) of the changes in one second."""
        up = (1.0, 1.0, self.vertical_share)
        wind = np.multiply(self.wind_change, up)
        force = self.force_change * weight * np.array([0.2, 0.2, 1.0])
        return np.concatenate([wind, force, np.full(3, self.moment_change * weight)]) ** 2

    def _update(
        self,
        model: PayloadModelParameters,
        x: Array,
        P: Array,
        found: Array,
        v: Array,
        o: Observation,
        quadrotors: Array,
        dt: float,
    ) -> tuple[Array, Array]:
        """Return estimate and covariance after forces and moment `found` (6 + 3 n,)."""
        assert model.air is not None
        n, wind, xi, eta = model.n, x[0:3], o.xi, quadrotors[2]
        payload = payload_wrench(model, o.R[None], o.W[None], v[None], wind)
        c = model.air.rotor_drag
        drag = rotor_drag(c, o.z_WQ, wind - o.v_WQ)
        by_wind = c[:, None, None] * (IDENTITY - o.z_WQ[:, :, None] * o.z_WQ[:, None, :])
        # What acts along a cable counts as its pull, and so as force on the payload.
        along = (drag * xi).sum(-1, keepdims=True)
        H = np.zeros((6 + 3 * n, _SIZE))
        expected = np.empty(6 + 3 * n)
        expected[0:6] = payload.wrench[0]
        expected[0:3] += (along * xi).sum(0) + x[3:6]
        levers = cross(model.arms, eta)
        expected[3:6] += (along * levers).sum(0) + x[6:9]
        expected[6:] = (drag - along * xi).ravel()
        by_along = np.vecmat(xi, by_wind)
        D = drag_by_velocity(model, payload)[0]
        H[0:3, 0:3] = o.R @ D @ o.R.T + xi.T @ by_along
        H[3:6, 0:3] = model.drag_lever @ D @ o.R.T + levers.T @ by_along
        H[6:, 0:3] = (by_wind - xi[:, :, None] * by_along[:, None]).reshape(3 * n, 3)
        H[0:3, 3:6] = H[3:6, 6:9] = IDENTITY
        noise = self._noise(model, xi, levers, dt)
        gain = np.linalg.solve(H @ P @ H.T + noise, H @ P).T
        left = np.eye(_SIZE) - gain @ H
        return x + gain @ (found - expected), left @ P @ left.T + gain @ noise @ gain.T

    def _noise(self, model: PayloadModelParameters, xi: Array, levers: Array, dt: float) -> Array:
        """Return the covariance (6 + 3 n, 6 + 3 n) of forces from noisy velocities."""
        n, m = model.n, model.quadrotor_mass
        # Columns: velocity of the payload, its angular velocity, velocities of the quadrotors.
        J = np.zeros((6 + 3 * n, 6 + 3 * n))
        scale = np.sqrt(2.0) / dt
        J[0:3, 0:3] = scale * self.velocity_noise * model.mass * IDENTITY
        J[3:6, 3:6] = scale * self.rate_noise * model.inertia
        for i in range(n):
            own = slice(6 + 3 * i, 9 + 3 * i)
            size = scale * self.velocity_noise * m[i]
            J[0:3, own] = size * np.outer(xi[i], xi[i])
            J[3:6, own] = size * np.outer(levers[i], xi[i])
            J[own, own] = size * (IDENTITY - np.outer(xi[i], xi[i]))
        return J @ J.T + 1e-9 * np.eye(6 + 3 * n)
