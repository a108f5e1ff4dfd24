"""One measured state as a controller reads it, and the filter of the payload's position."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_aerial.geometry import IDENTITY, Array, cross, skew
from drake_aerial.io.records import NonNegative, record
from drake_aerial.plant.cable_geometry import rotation


class Observation(NamedTuple):
    """One measured state.

    Attributes
    ----------
    p, v : (3,) arrays
        Position and velocity of L's origin in the world [m, m/s].
    R : (3, 3) array
        R_WL.
    W : (3,) array
        Angular velocity of the payload in the axes of L [rad/s].
    p_WQ, v_WQ : (n, 3) arrays
        Position and velocity of the quadrotors [m, m/s].
    z_WQ : (n, 3) array
        Thrust axis of each quadrotor in the world.
    xi, xi_dot : (n, 3) arrays
        Cable directions, from quadrotor to contact, and their rates [1/s].
    """

    p: Array
    v: Array
    R: Array
    W: Array
    p_WQ: Array
    v_WQ: Array
    z_WQ: Array
    xi: Array
    xi_dot: Array

    @property
    def w(self) -> Array:
        """Angular velocities (n, 3) of the cables in the world [rad/s]."""
        return cross(self.xi, self.xi_dot)

    def after(self, time: float) -> Observation:
        """Return the observation extrapolated by a short `time` [s] at constant velocities."""
        turn = IDENTITY + time * skew(self.W)
        xi = self.xi + time * self.xi_dot
        return self._replace(
            p=self.p + time * self.v,
            R=1.5 * (R := self.R @ turn) - 0.5 * R @ R.T @ R,
            p_WQ=self.p_WQ + time * self.v_WQ,
            xi=xi / np.sqrt(np.vecdot(xi, xi))[:, None],
        )

    def of_quadrotors(self, index: NDArray[np.intp]) -> Observation:
        """Return the observation of the quadrotors and cables in `index` (k,) only."""
        fields = ("p_WQ", "v_WQ", "z_WQ", "xi", "xi_dot")
        return self._replace(**{name: getattr(self, name)[index] for name in fields})


def observe(payload: Array, quadrotors: Array, cables: Array) -> Observation:
    """Return the observation in the vectors of a controller's input ports.

    Parameters
    ----------
    payload : (13,) array
        Quaternion w, x, y, z, position, angular and linear velocity of L in the world.
    quadrotors : (13 n,) array
        The same of each quadrotor.
    cables : (6 n,) array
        Direction from quadrotor to contact and its rate, per cable, in the world.
    """
    quadrotors, cables = quadrotors.reshape(-1, 13), cables.reshape(-1, 6)
    R = rotation(payload[0:4])
    xi, rate = cables[:, 0:3], cables[:, 3:6]
    xi = xi / np.sqrt(np.vecdot(xi, xi))[:, None]
    w, x, y, z = quadrotors[:, 0:4].T
    z_WQ = np.empty((len(quadrotors), 3))
    z_WQ[:, 0] = 2 * (x * z + w * y)
    z_WQ[:, 1] = 2 * (y * z - w * x)
    z_WQ[:, 2] = 1 - 2 * (x * x + y * y)
    return Observation(
        payload[4:7],
        payload[10:13],
        R,
        payload[7:10] @ R,
        quadrotors[:, 4:7],
        quadrotors[:, 10:13],
        z_WQ,
        xi,
        rate - xi * np.vecdot(xi, rate)[:, None],
    )


class FilterState(NamedTuple):
    """State of a `PositionFilter`.

    Attributes
    ----------
    p : (3,) array
        Estimated position [m].
    v : (3,) array
        Last measured velocity [m/s].
    variance : float
        Variance of each coordinate of p [m^2]; negative before the first measurement.
    """

    p: Array
    v: Array
    variance: float

    @classmethod
    def initial(cls) -> FilterState:
        """Return the state before the first measurement."""
        return cls(np.zeros(3), np.zeros(3), -1.0)

    @classmethod
    def unpack(cls, values: Array) -> FilterState:
        """Return the state in a vector (7,); its arrays are views."""
        return cls(values[0:3], values[3:6], float(values[6]))

    def pack(self) -> Array:
        """Return the state as a vector (7,)."""
        values = np.empty(7)
        values[0:3], values[3:6], values[6] = self
        return values


@record(frozen=True)
class PositionFilter:
    """Kalman filter of a measured position whose velocity is measured too.

    The velocity is integrated and corrected by the noisy position, so that the estimate is smooth
    and does not lag. All three axes share one variance.
    """

    position_noise: NonNegative = 0.01
    """Standard deviation of each measured coordinate [m]; 0 for no filtering."""
    velocity_noise: NonNegative = 0.01
    """Standard deviation of the velocity's error, as white noise per step [m/s]."""

    def step(self, state: FilterState, measured: Array, velocity: Array, dt: float) -> FilterState:
        """Return the state after a measurement.

        Parameters
        ----------
        state : FilterState
        measured, velocity : (3,) arrays
            Position [m] and its rate [m/s].
        dt : float
            Time since the last measurement [s].
        """
        noise = self.position_noise**2
        if state.variance < 0.0 or noise == 0.0:
            return FilterState(measured, velocity, noise)
        variance = state.variance + (self.velocity_noise * dt) ** 2
        gain = variance / (variance + noise)
        predicted = state.p + 0.5 * dt * (state.v + velocity)
        p = predicted + gain * (measured - predicted)
        return FilterState(p, velocity, (1.0 - gain) * variance)
