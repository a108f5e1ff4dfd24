"""Extrapolation of delayed measurements to the present, by measured velocities."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_aerial.estimation.sensor_suite import SensorSuite
from drake_aerial.geometry import Array, matrix_from_quat, quat_exp, quat_multiply
from drake_aerial.plant.cable_geometry import cable_directions
from drake_aerial.statics.gravity import GRAVITY

_PARTS = ("attitude", "position", "velocity")


class DelayCompensation(LeafSystem):
    """Extrapolation of measured states to the present; it has no state.

    Positions move on with the measured velocities, attitudes turn with the measured rates, and the
    velocities of the quadrotors change with the specific force that their accelerometers measure.
    The velocity of the payload is as old as it is measured.

    | port | size | meaning | unit | frame |
    |---|---|---|---|---|
    | in, out `payload_state` | 13 | w x y z, p, angular, linear velocity of L | - | world |
    | in, out `quadrotor_states` | 13 n | the same of each Q | m, rad/s, m/s | world |
    | in, out `cable_directions` | 6 n | unit vector quadrotor to contact, rate | -, 1/s | world |
    | in `imu` | 6 n | specific force, angular velocity | m/s^2, rad/s | Q |

    Ports of quantities that the sensors do not measure are absent. At the level payload there is no
    input `cable_directions`: the directions are computed from the extrapolated states.

    Parameters
    ----------
    sensors : SensorSuite
        The system whose delays are compensated.
    p_LC : (n, 3) array
        Contacts in L [m].
    """

    def __init__(self, sensors: SensorSuite, p_LC: ArrayLike):
        super().__init__()
        self._p_LC = np.asarray(p_LC, dtype=float).reshape(-1, 3)
        n, level = len(self._p_LC), sensors.parameters.level
        self._delays = {
            body: np.array(
                [sensors.delay(f"{body}_{part}") for part in ("attitude", "position", "velocity")]
            )
            for body in ("payload", "quadrotor")
            if body == "quadrotor" or level == "payload"
        }
        self._cable_delay = sensors.delay("cable_direction") if level == "cables" else 0.0
        self._quadrotors = self.DeclareVectorInputPort("quadrotor_states", 13 * n)
        self._imu = self.DeclareVectorInputPort("imu", 6 * n)
        self.DeclareVectorOutputPort("quadrotor_states", 13 * n, self._calc_quadrotors)
        if level == "payload":
            self._payload = self.DeclareVectorInputPort("payload_state", 13)
            self.DeclareVectorOutputPort("payload_state", 13, self._calc_payload)
            self.DeclareVectorOutputPort("cable_directions", 6 * n, self._calc_directions)
        if level == "cables":
            self._cables = self.DeclareVectorInputPort("cable_directions", 6 * n)
            self.DeclareVectorOutputPort("cable_directions", 6 * n, self._calc_cables)

    def _payload_now(self, context: Context) -> Array:
        states = self._payload.Eval(context).reshape(1, 13)
        return _extrapolated(states, self._delays["payload"], np.zeros((1, 3)))

    def _quadrotors_now(self, context: Context) -> Array:
        states = self._quadrotors.Eval(context).reshape(-1, 13)
        force = self._imu.Eval(context).reshape(-1, 6)[:, 0:3]
        acceleration = np.matvec(matrix_from_quat(states[:, 0:4]), force)
        acceleration[:, 2] -= GRAVITY
        return _extrapolated(states, self._delays["quadrotor"], acceleration)

    def _calc_payload(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._payload_now(context).ravel())

    def _calc_quadrotors(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._quadrotors_now(context).ravel())

    def _calc_directions(self, context: Context, output: BasicVector) -> None:
        payload = self._payload_now(context).ravel().tolist()
        quadrotors = self._quadrotors_now(context).ravel().tolist()
        output.SetFromVector(cable_directions(payload, quadrotors, self._p_LC.tolist()))

    def _calc_cables(self, context: Context, output: BasicVector) -> None:
        cables = self._cables.Eval(context).reshape(-1, 6).copy()
        xi = cables[:, 0:3] + self._cable_delay * cables[:, 3:6]
        cables[:, 0:3] = xi / np.linalg.norm(xi, axis=1, keepdims=True)
        output.SetFromVector(cables.ravel())


def _extrapolated(states: Array, delays: Array, acceleration: Array) -> Array:
    """Return states (k, 13) at the present.

    Parameters
    ----------
    states : (k, 13) array
    delays : (3,) array
        Of attitude, position and velocity [s].
    acceleration : (k, 3) array
        In the world [m/s^2].
    """
    by_attitude, by_position, by_velocity = delays
    states = states.copy()
    turn = quat_exp(by_attitude * states[:, 7:10])
    states[:, 0:4] = quat_multiply(turn, states[:, 0:4])
    states[:, 10:13] += by_velocity * acceleration
    # The mean velocity since the position was taken.
    states[:, 4:7] += by_position * states[:, 10:13] - 0.5 * by_position**2 * acceleration
    return states
