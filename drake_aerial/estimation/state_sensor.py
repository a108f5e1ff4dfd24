"""Sensor of the states that controllers read: fixed rate, noise on the payload's position."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, InputPort, LeafSystem

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.plant.cable_geometry import cable_directions
from drake_aerial.plant.world import TIME_STEP


class StateSensor(LeafSystem):
    """Sampler of the states of payload, quadrotors and cables at a fixed rate, with hold.

    The payload's measured position has independent Gaussian noise on every coordinate. The cables'
    directions are measured directly, or computed from the noisy position.

    | port | size | meaning | unit | frame |
    |---|---|---|---|---|
    | in `payload_state` | 13 | w x y z, p, angular, linear velocity of L | m, rad/s, m/s | world |
    | in `quadrotor_states` | 13 n | the same of each Q | m, rad/s, m/s | world |
    | in `attached` | n | 1: gripper attached, 0: released; optional (1) | - | - |
    | in `payload_acceleration` | 6 | angular, linear of L; optional | rad/s^2, m/s^2 | world |
    | in `quadrotor_accelerations` | 6 n | the same of each Q; optional | rad/s^2, m/s^2 | world |
    | out `payload_state` | 13 | sample, with noise on p | m, rad/s, m/s | world |
    | out `quadrotor_states` | 13 n | sample | m, rad/s, m/s | world |
    | out `cable_directions` | 6 n | unit vector quadrotor to contact, rate | -, 1/s | world |
    | out `attached` | n | sample | - | - |

    A discrete plant updates velocities first and moves positions by the new velocities, so its
    velocities are half a step older than its positions. If accelerations are connected, sampled
    velocities are extrapolated to the time of the sample.

    The noise of a sample depends on the seed and the number of the sample only. The seed is a
    parameter in the Context (`set_seed`), so one diagram serves many trials.

    Parameters
    ----------
    p_LC : (n, 3) array
        Contacts in L [m].
    period : float
        Sampling period [s]; the first sample is at time 0.
    noise : float
        Standard deviation of each measured coordinate of the payload's position [m].
    measured_directions : bool
        Whether cable directions are measured directly.
    time_step : float
        Time step of the plant whose accelerations are connected [s].

    Raises
    ------
    InputError
        If the noise is negative, the period is not positive, or one of them is not finite.

    Examples
    --------
    >>> from drake_aerial import StateSensor
    >>> sensor = StateSensor([[-0.2, 0.0, 0.1], [0.2, 0.0, 0.1]], noise=0.005)
    >>> sensor.GetOutputPort("cable_directions").size()
    12
    """

    def __init__(
        self,
        p_LC: ArrayLike,
        *,
        period: float = 0.02,
        noise: float = 0.01,
        measured_directions: bool = True,
        time_step: float = TIME_STEP,
    ):
        super().__init__()
        p_LC = np.asarray(p_LC, dtype=float).reshape(-1, 3)
        if not (np.isfinite(noise) and noise >= 0.0):
            raise InputError(f"`noise` must be in [0, inf) m, got {noise!r}")
        if not (np.isfinite(period) and period > 0.0):
            raise InputError(f"`period` must be in (0, inf) s, got {period!r}")
        n = len(p_LC)
        self._philox = np.random.Philox(key=0)
        self._position: Any = self._philox.state
        self._generator = np.random.Generator(self._philox)
        self._p_LC, self._period, self._noise, self._measured = (
            p_LC.tolist(),
            period,
            noise,
            measured_directions,
        )
        self._payload = self.DeclareVectorInputPort("payload_state", 13)
        self._quadrotors = self.DeclareVectorInputPort("quadrotor_states", 13 * n)
        self._attached = self.DeclareVectorInputPort("attached", n)
        self._accelerations = (
            self.DeclareVectorInputPort("payload_acceleration", 6),
            self.DeclareVectorInputPort("quadrotor_accelerations", 6 * n),
        )
        self._half_step = 0.5 * time_step
        self._seed = self.DeclareNumericParameter(BasicVector([0.0]))
        at_rest = np.tile(np.eye(1, 13)[0], 1 + n)
        down = np.tile([0.0, 0.0, -1.0, 0.0, 0.0, 0.0], n)
        self._samples = [
            self.DeclareDiscreteState(initial)
            for initial in (at_rest[:13], at_rest[13:], down, np.ones(n))
        ]
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._sample)
        names = ("payload_state", "quadrotor_states", "cable_directions", "attached")
        for name, index in zip(names, self._samples, strict=True):
            self.DeclareStateOutputPort(name, index)

    def set_seed(self, context: Context, seed: int) -> None:
        """Set the seed of the noise in this system's context."""
        context.get_mutable_numeric_parameter(self._seed).SetFromVector([float(seed)])

    def _sample(self, context: Context, discrete_state: DiscreteValues) -> None:
        payload = self._sampled(context, self._payload, self._accelerations[0])
        quadrotors = self._sampled(context, self._quadrotors, self._accelerations[1])
        measured = payload
        if self._noise > 0.0:
            seed = int(context.get_numeric_parameter(self._seed).GetAtIndex(0))
            dx, dy, dz = self._normal(seed, round(context.get_time() / self._period)).tolist()
            x, y, z = payload[4:7]
            measured = payload.copy()
            measured[4:7] = x + self._noise * dx, y + self._noise * dy, z + self._noise * dz
        directions = cable_directions(
            payload if self._measured else measured, quadrotors, self._p_LC
        )
        attached = (
            self._attached.Eval(context)
            if self._attached.HasValue(context)
            else np.ones(len(self._p_LC))
        )
        for index, value in zip(
            self._samples, (measured, quadrotors, directions, attached), strict=True
        ):
            discrete_state.set_value(index, value)

    def _sampled(
        self, context: Context, states: InputPort, accelerations: InputPort
    ) -> list[float]:
        """Return states (13 k) with velocities at the time of their positions."""
        # Plain floats: for few bodies they are faster than small arrays.
        sampled: list[float] = states.Eval(context).tolist()
        if accelerations.HasValue(context):
            rates, h = accelerations.Eval(context).tolist(), self._half_step
            for k in range(0, len(sampled), 13):
                a = 6 * k // 13
                sampled[k + 7 : k + 13] = [
                    v + h * r for v, r in zip(sampled[k + 7 : k + 13], rates[a : a + 6])
                ]
        return sampled

    def _normal(self, seed: int, number: int) -> Array:
        """Return the three standard normal numbers of a sample.

        Each seed has a stream and each sample a block of it, so the order of calls does not matter.
        Setting the generator's position is six times faster than making a generator.
        """
        position = self._position["state"]
        position["key"] = np.array([seed, 0], dtype=np.uint64)
        position["counter"] = np.array([0, 0, 0, number], dtype=np.uint64)
        self._philox.state = self._position
        return self._generator.standard_normal(3)
