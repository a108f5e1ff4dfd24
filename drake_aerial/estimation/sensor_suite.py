"""Sensors of a flight as one system: what is measured of payload, cables and quadrotors."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteStateIndex,
    DiscreteValues,
    LeafSystem,
)

from drake_aerial.estimation.sensor_channel import Channel, ErrorStream
from drake_aerial.estimation.sensor_parameters import SensorParameters
from drake_aerial.geometry import Array, cross, matrix_from_quat, quat_exp, quat_multiply
from drake_aerial.plant.cable_geometry import cable_directions
from drake_aerial.plant.world import TIME_STEP
from drake_aerial.statics.gravity import GRAVITY

# Quantity: numbers of a sample and of its noise, for the payload or for each quadrotor.
_OF_PAYLOAD = {
    "payload_position": (3, 3),
    "payload_attitude": (4, 3),
    "payload_velocity": (3, 3),
    "payload_rate": (3, 3),
}
_OF_QUADROTORS = {
    "quadrotor_position": (3, 3),
    "quadrotor_attitude": (4, 3),
    "quadrotor_velocity": (3, 3),
    "quadrotor_rate": (3, 3),
    "specific_force": (3, 3),
    "rotor_speed": (4, 4),
}
_OF_CABLES = {"cable_direction": (3, 3), "cable_rate": (3, 3)}
_SIZES = {**_OF_PAYLOAD, **_OF_QUADROTORS, **_OF_CABLES}
_NAMES = tuple(_SIZES)
_MEASURED = {
    "payload": (*_OF_PAYLOAD, *_OF_QUADROTORS),
    "cables": (*_OF_QUADROTORS, *_OF_CABLES),
    "vehicles": tuple(_OF_QUADROTORS),
}
_STATE = ("attitude", "position", "rate", "velocity")
"""Order of a state of 13 numbers."""


class SensorSuite(LeafSystem):
    """Sampler of every measured quantity with noise, bias, rate and delay of its own.

    Which output ports there are depends on the level: payload has all, cables has no
    `payload_state`, vehicles has neither `payload_state` nor `cable_directions`.

    | port | size | meaning | unit | frame |
    |---|---|---|---|---|
    | in `payload_state` | 13 | w x y z, p, angular, linear velocity of L | m, rad/s, m/s | world |
    | in `quadrotor_states` | 13 n | the same of each Q | m, rad/s, m/s | world |
    | in `attached` | n | 1: gripper attached, 0: released; optional (1) | - | - |
    | in `payload_acceleration` | 6 | angular, linear of L; optional | rad/s^2, m/s^2 | world |
    | in `quadrotor_accelerations` | 6 n | the same of each Q; optional | rad/s^2, m/s^2 | world |
    | in `squared_speeds` | 4 n | of the propellers; optional (0) | rpm^2 | - |
    | out `payload_state` | 13 | measured state of L | m, rad/s, m/s | world |
    | out `quadrotor_states` | 13 n | measured states of the Q | m, rad/s, m/s | world |
    | out `cable_directions` | 6 n | unit vector quadrotor to contact, rate | -, 1/s | world |
    | out `attached` | n | 1: gripper attached, 0: released; exact and without delay | - | - |
    | out `imu` | 6 n | specific force, angular velocity of each Q | m/s^2, rad/s | Q |
    | out `rotor_speeds` | 4 n | speeds of the propellers | rpm | - |

    Angular velocities of the Q are measured in their own axes and turned by the measured attitude.
    Attitude errors are rotation vectors in the body's axes. At the level payload, the cables'
    directions are computed from the measured states. If accelerations are connected, velocities are
    those at the time of the sample, half a step of the plant after its own.

    A sample is read when it is `delay` old, and until the next one of that age. Errors depend on
    the seed, the quantity and the number of the sample only. The seed is a parameter in the Context
    (`set_seed`).

    Parameters
    ----------
    p_LC : (n, 3) array
        Contacts in L [m].
    parameters : SensorParameters, optional
    time_step : float
        Time step of the plant [s], of which periods and delays are multiples.

    Raises
    ------
    InputError
        If a period or delay is not a multiple of the time step.
    """

    def __init__(
        self,
        p_LC: ArrayLike,
        parameters: SensorParameters | None = None,
        *,
        time_step: float = TIME_STEP,
    ):
        super().__init__()
        self.parameters = parameters = parameters or SensorParameters()
        self._p_LC = np.asarray(p_LC, dtype=float).reshape(-1, 3)
        n = len(self._p_LC)
        self.n = n
        measured = _MEASURED[parameters.level]
        self._channels: dict[str, Channel] = {}
        first = 0
        for name in _NAMES:
            # Every quantity has its part of the errors, measured or not.
            count = 1 if name in _OF_PAYLOAD else n
            size, noises = (count * k for k in _SIZES[name])
            if name in measured:
                given = getattr(parameters, name)
                self._channels[name] = Channel.of(name, given, first, size, noises, time_step)
            first += noises
        self._errors = ErrorStream(first)
        self._payload = self.DeclareVectorInputPort("payload_state", 13)
        self._quadrotors = self.DeclareVectorInputPort("quadrotor_states", 13 * n)
        self._attached = self.DeclareVectorInputPort("attached", n)
        self._payload_acceleration = self.DeclareVectorInputPort("payload_acceleration", 6)
        self._accelerations = self.DeclareVectorInputPort("quadrotor_accelerations", 6 * n)
        self._speeds = self.DeclareVectorInputPort("squared_speeds", 4 * n)
        self._seed = self.DeclareNumericParameter(BasicVector([0.0]))
        self._time_step = time_step
        times = [t for c in self._channels.values() for t in (c.period, c.delay)]
        self._steps = math.gcd(*times)
        self._declare_state()
        self._declare_outputs()

    def _declare_state(self) -> None:
        """Declare the samples of every quantity, newest first, and the number of steps."""
        identity = np.tile(np.eye(1, 4)[0], self.n)
        self._samples: dict[str, DiscreteStateIndex] = {}
        for name, channel in self._channels.items():
            first = identity[: channel.size] if "attitude" in name else np.zeros(channel.size)
            self._samples[name] = self.DeclareDiscreteState(np.tile(first, channel.depth))
        self._counter = self.DeclareDiscreteState(np.zeros(1))
        self._held = self.DeclareDiscreteState(np.ones(self.n))
        period = self._steps * self._time_step
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._sample)

    def _declare_outputs(self) -> None:
        n, level = self.n, self.parameters.level
        ticket = {self.all_state_ticket()}
        if level == "payload":
            self.DeclareVectorOutputPort("payload_state", 13, self._calc_payload, ticket)
        self.DeclareVectorOutputPort("quadrotor_states", 13 * n, self._calc_quadrotors, ticket)
        if level != "vehicles":
            self.DeclareVectorOutputPort("cable_directions", 6 * n, self._calc_cables, ticket)
        self.DeclareStateOutputPort("attached", self._held)
        self.DeclareVectorOutputPort("imu", 6 * n, self._calc_imu, ticket)
        self.DeclareVectorOutputPort("rotor_speeds", 4 * n, self._calc_speeds, ticket)

    def set_seed(self, context: Context, seed: int) -> None:
        """Set the seed of noise and bias in this system's context."""
        context.get_mutable_numeric_parameter(self._seed).SetFromVector([float(seed)])

    def delay(self, name: str) -> float:
        """Return the delay of a quantity [s], by the name of its parameter."""
        return self._channels[name].delay * self._time_step

    def _sample(self, context: Context, discrete: DiscreteValues) -> None:
        steps = round(context.get_time() / self._time_step)
        seed = int(context.get_numeric_parameter(self._seed).GetAtIndex(0))
        if self._attached.HasValue(context):
            discrete.set_value(self._held, self._attached.Eval(context))
        discrete.set_value(self._counter, [float(steps)])
        due = {name: c for name, c in self._channels.items() if c.is_due(steps)}
        if not due:
            return
        true = self._true(context)
        normal, constant = self._errors.numbers(seed, steps + 1), self._errors.numbers(seed, 0)
        for name, channel in due.items():
            measured = _disturbed(name, true[name], channel.error(normal, constant))
            kept = context.get_discrete_state(self._samples[name]).value()
            rows = kept.reshape(channel.depth, channel.size)[:-1]
            if steps == 0:
                # Before the first sample is old enough, it is read all the same.
                rows = np.tile(measured, (channel.depth - 1, 1))
            discrete.set_value(self._samples[name], np.concatenate([measured[None], rows]).ravel())

    def _true(self, context: Context) -> dict[str, Array]:
        """Return the true values of all quantities."""
        h = 0.5 * self._time_step
        bodies = np.concatenate([self._payload.Eval(context), self._quadrotors.Eval(context)])
        bodies = bodies.reshape(-1, 13).copy()
        acceleration = np.zeros((self.n, 3))
        if self._accelerations.HasValue(context) and self._payload_acceleration.HasValue(context):
            of_quadrotors = self._accelerations.Eval(context)
            rates = np.concatenate([self._payload_acceleration.Eval(context), of_quadrotors])
            bodies[:, 7:13] += h * rates.reshape(-1, 6)
            acceleration = of_quadrotors.reshape(-1, 6)[:, 3:6]
        payload, quadrotors = bodies[0], bodies[1:]
        R = matrix_from_quat(quadrotors[:, 0:4])
        lifted = acceleration + [0.0, 0.0, GRAVITY]
        true = {
            **_parts("payload", payload[None]),
            **_parts("quadrotor", quadrotors),
            "quadrotor_rate": np.vecmat(quadrotors[:, 7:10], R).ravel(),
            "specific_force": np.vecmat(lifted, R).ravel(),
            "rotor_speed": np.zeros(4 * self.n),
        }
        if self._speeds.HasValue(context):
            true["rotor_speed"] = np.sqrt(np.maximum(self._speeds.Eval(context), 0.0))
        if "cable_direction" in self._channels:
            found = cable_directions(
                payload.tolist(), quadrotors.ravel().tolist(), self._p_LC.tolist()
            )
            cables = np.array(found).reshape(-1, 6)
            true["cable_direction"], true["cable_rate"] = (
                cables[:, 0:3].ravel(),
                cables[:, 3:6].ravel(),
            )
        return true

    def read(self, context: Context, name: str) -> Array:
        """Return the measurement of a quantity that is read now, flat, by its parameter's name."""
        channel = self._channels[name]
        steps = int(context.get_discrete_state(self._counter).value()[0])
        samples = context.get_discrete_state(self._samples[name]).value()
        age = channel.age(steps)
        return samples[age * channel.size : (age + 1) * channel.size]

    def _state(self, context: Context, body: str, count: int) -> Array:
        """Return the measured states (count, 13) of the payload or the quadrotors."""
        parts = [self.read(context, f"{body}_{part}").reshape(count, -1) for part in _STATE]
        if body == "quadrotor":
            parts[2] = np.matvec(matrix_from_quat(parts[0]), parts[2])
        return np.concatenate(parts, axis=1)

    def _calc_payload(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._state(context, "payload", 1).ravel())

    def _calc_quadrotors(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._state(context, "quadrotor", self.n).ravel())

    def _calc_cables(self, context: Context, output: BasicVector) -> None:
        if self.parameters.level == "payload":
            payload = self._state(context, "payload", 1).ravel().tolist()
            quadrotors = self._state(context, "quadrotor", self.n).ravel().tolist()
            output.SetFromVector(cable_directions(payload, quadrotors, self._p_LC.tolist()))
            return
        xi = self.read(context, "cable_direction").reshape(-1, 3)
        rate = self.read(context, "cable_rate").reshape(-1, 3)
        rate = rate - xi * np.vecdot(xi, rate)[:, None]
        output.SetFromVector(np.concatenate([xi, rate], axis=1).ravel())

    def _calc_imu(self, context: Context, output: BasicVector) -> None:
        force = self.read(context, "specific_force").reshape(-1, 3)
        rate = self.read(context, "quadrotor_rate").reshape(-1, 3)
        output.SetFromVector(np.concatenate([force, rate], axis=1).ravel())

    def _calc_speeds(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.read(context, "rotor_speed"))


def _parts(body: str, states: Array) -> dict[str, Array]:
    """Return the parts of states (k, 13), each flat."""
    return {
        f"{body}_attitude": states[:, 0:4].ravel(),
        f"{body}_position": states[:, 4:7].ravel(),
        f"{body}_rate": states[:, 7:10].ravel(),
        f"{body}_velocity": states[:, 10:13].ravel(),
    }


def _disturbed(name: str, true: Array, error: Array) -> Array:
    """Return a quantity with an error; attitudes and directions stay of unit length."""
    if "attitude" in name:
        q = quat_multiply(true.reshape(-1, 4), quat_exp(error.reshape(-1, 3)))
        return q.ravel()
    if name == "cable_direction":
        xi = true.reshape(-1, 3)
        turned = xi + cross(error.reshape(-1, 3), xi)
        return (turned / np.linalg.norm(turned, axis=1, keepdims=True)).ravel()
    return true + error
