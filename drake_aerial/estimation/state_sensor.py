"""What the controllers get to see: a sensor of fixed rate, with noise on the payload's position."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, InputPort, LeafSystem

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.plant.cable_geometry import cable_directions
from drake_aerial.plant.world import TIME_STEP


class PayloadPerception(LeafSystem):
    """Samples payload, quadrotors and cables at a fixed rate, whatever the controller's, and holds the samples.

    The payload's measured position has independent Gaussian noise on every coordinate; the cables' directions are measured on their
    own, or inferred from the noisy payload position.

    | port | size | meaning |
    |---|---|---|
    | in `payload_state` | 13 | true w x y z, position, angular and linear velocity of L in the world |
    | in `quadrotor_states` | 13 n | the same of each Q |
    | in `attached` | n | 1 where a gripper holds, 0 where it let go; may be left unconnected: all hold |
    | in `payload_acceleration` | 6 | angular and linear of L in the world; may be left unconnected |
    | in `quadrotor_accelerations` | 6 n | the same of each Q; may be left unconnected |
    | out `payload_state` | 13 | sampled, the position noisy |
    | out `quadrotor_states` | 13 n | sampled |
    | out `cable_directions` | 6 n | per cable: unit vector from quadrotor to contact, and its rate [1/s], in the world |
    | out `attached` | n | sampled: a gripper's contact switch |

    A discrete plant adds a step's impulse to velocities first and moves positions by the new ones, so its velocities are those of half a
    step before its positions. Where accelerations are given, sampled velocities are those of the sample's own moment.

    The noise of a sample is a function of the seed and of the sample's number alone; the seed is a parameter in the Context
    (`set_seed`), so that one diagram serves many trials.

    Parameters
    ----------
    p_LC : (n, 3) array
        Contacts in L [m].
    period : float
        Of the samples, the first at 0 [s].
    noise : float
        Standard deviation of each coordinate of the payload's position [m].
    measured_directions : bool
        Whether cable directions are measured on their own.
    time_step : float
        Of the plant whose accelerations are connected [s].
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
            raise InputError(f"the position noise is {noise!r} m; 0 or more accepted")
        if not (np.isfinite(period) and period > 0.0):
            raise InputError(f"the perception's period is {period!r} s; a positive number accepted")
        n = len(p_LC)
        self._philox = np.random.Philox(key=0)
        self._place: Any = self._philox.state
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
        """Set the noise's seed in this system's context."""
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
        """Return states (13 k) whose velocities are those of their own moment."""
        # Plain floats, as in the attitude law: for few bodies they are faster than small arrays.
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
        """Return three standard normal numbers that belong to a seed and a sample.

        One stream per seed, one block of it per sample: the same noise for whoever asks, in whatever order. The generator is set to its
        place before it is asked, since making one takes six times as long.
        """
        place = self._place["state"]
        place["key"] = np.array([seed, 0], dtype=np.uint64)
        place["counter"] = np.array([0, 0, 0, number], dtype=np.uint64)
        self._philox.state = self._place
        return self._generator.standard_normal(3)
