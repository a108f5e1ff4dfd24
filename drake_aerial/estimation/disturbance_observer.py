"""Disturbance observer: unmodelled constant forces on payload and quadrotors, and a moment."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from drake_aerial.dynamics.air_forces import payload_wrench
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.observation import Observation
from drake_aerial.geometry import Array, cross
from drake_aerial.io.records import NonNegative, Positive, PositiveOrInfinite, record
from drake_aerial.plant.air import rotor_drag
from drake_aerial.statics.gravity import GRAVITY


class Disturbance(NamedTuple):
    """Forces and a moment that the model does not predict.

    Attributes
    ----------
    force : (3,) array
        On the payload's CoM, in the world [N].
    moment : (3,) array
        On the payload, in the axes of L [N m].
    on_quadrotors : (n, 3) array
        On each quadrotor, in the world, perpendicular to its cable [N].
    limited : bool
        True if one of them is held at the observer's limit, so that the estimate is too small.
    wind : (3,) array or None
        Velocity of the air in the world [m/s]; None if it is not observed.
    """

    force: Array
    moment: Array
    on_quadrotors: Array
    limited: bool
    wind: Array | None = None

    @property
    def wrench(self) -> Array:
        """Force and moment on the payload, (6,)."""
        return np.concatenate([self.force, self.moment])


class ObserverMemory(NamedTuple):
    """State of a `DisturbanceObserver`: the last observation and the estimate.

    Attributes
    ----------
    begun : float
        0 before the first observation, then 1.
    v, W : (3,) arrays
        Velocity of the CoM in the world [m/s], angular velocity of the payload in L [rad/s].
    quadrotors : (4, n, 3) array
        Velocities of the quadrotors, cable directions in the world and in L, thrust axes.
    estimate : (6 + 3 n,) array
        Force, moment and forces on the quadrotors, as in `Disturbance`.
    """

    begun: float
    v: Array
    W: Array
    quadrotors: Array
    estimate: Array

    @staticmethod
    def size(n: int) -> int:
        """Return the length of the vector for n quadrotors; zeros are the initial state."""
        return 13 + 15 * n

    @classmethod
    def unpack(cls, values: Array) -> ObserverMemory:
        """Return the memory in a vector; its arrays are views."""
        n = (len(values) - 13) // 15
        quadrotors, estimate = values[7 : 7 + 12 * n], values[7 + 12 * n :]
        return cls(values[0], values[1:4], values[4:7], quadrotors.reshape(4, n, 3), estimate)

    def pack(self) -> Array:
        """Return the memory as a vector."""
        return np.concatenate(
            [[self.begun], self.v, self.W, self.quadrotors.ravel(), self.estimate]
        )


@record(frozen=True)
class DisturbanceObserver:
    """First-order observer of a `Disturbance`, from changes of measured velocities.

    Between two control steps, the change of a quadrotor's momentum less its weight and thrust is
    the sum of the cable's pull and the disturbance. The part along the cable counts as pull, the
    rest as disturbance. The changes of the payload's momentum and angular momentum, less its
    weight and the pulls, are the disturbance on the payload. These values are averaged over
    `time` and held within limits.

    A force on a quadrotor along its cable therefore counts as a force on the payload, which moves
    the system in the same way; so does an error of the modelled thrust or mass. Measured
    positions, which are noisy, are not used.

    An estimate that exceeds a limit is held at the limit. `PayloadMpc` warns once per flight and
    counts the control steps in its output port `diagnostics`.

    Examples
    --------
    >>> from drake_aerial import DisturbanceObserver, FlightOptions, MpcParameters
    >>> options = FlightOptions(controller=MpcParameters(observer=DisturbanceObserver(time=0.3)))
    >>> options.controller_parameters.observer.lever
    0.12
    """

    kind: Literal["force"] = "force"
    """force; wind is the other observer, `WindObserver`."""
    time: Positive = 0.5
    """Time constant of the forces [s]."""
    moment_time: PositiveOrInfinite = 1.0
    """Time constant of the moment [s]; infinite (.inf) for no moment."""
    share: NonNegative = 0.5
    """Largest force, as a fraction of the weight of the payload or the quadrotor
    (dimensionless)."""
    lever: NonNegative = 0.12
    """Largest moment over the payload's weight [m]: the largest error of its centre of mass."""

    @staticmethod
    def size(n: int) -> int:
        """Return the length of the memory for n quadrotors; zeros are the initial state."""
        return ObserverMemory.size(n)

    def step(
        self,
        model: PayloadModelParameters,
        memory: ObserverMemory,
        observation: Observation,
        thrust: Array,
        dt: float,
    ) -> tuple[Disturbance, ObserverMemory]:
        """Return the disturbance and the memory after an observation.

        Parameters
        ----------
        model : PayloadModelParameters
        memory : ObserverMemory
        observation : Observation
        thrust : (n, 3) array
            Thrusts commanded since the last observation, in the world [N].
        dt : float
            Time since the last observation [s].
        """
        n, o = model.n, observation
        v = o.v + o.R @ cross(o.W, model.p_LLcm)
        quadrotors = np.concatenate([o.v_WQ, o.xi, o.xi @ o.R, o.z_WQ]).reshape(4, n, 3)
        estimate, limited = memory.estimate, [False]
        if memory.begun:
            found = residual(model, memory, v, o.W, quadrotors, thrust, dt)
            if model.air is not None:
                mean = 0.5 * (memory.v + v)
                found = found - _in_still_air(model, o, mean)
            gain = np.full(6 + 3 * n, -np.expm1(-dt / self.time))
            gain[3:6] = -np.expm1(-dt / self.moment_time)
            estimate = estimate + gain * (found - estimate)
            weight = GRAVITY * model.hanging_mass
            limits = [self.share * weight, self.lever * weight]
            limits += (self.share * GRAVITY * model.quadrotor_mass).tolist()
            limited = [_limit(part, bound) for part, bound in zip(estimate.reshape(-1, 3), limits)]
        force, moment, on_quadrotors = estimate[0:3], estimate[3:6], estimate[6:].reshape(n, 3)
        disturbance = Disturbance(
            force.copy(), moment.copy(), on_quadrotors.copy(), limited=any(limited)
        )
        return disturbance, ObserverMemory(1.0, v, o.W, quadrotors, estimate)

    def advance(
        self,
        model: PayloadModelParameters,
        memory: Array,
        observation: Observation,
        thrust: Array,
        dt: float,
    ) -> tuple[Disturbance, Array]:
        """Return the disturbance and the memory as a vector; see `step`."""
        before = ObserverMemory.unpack(memory)
        disturbance, after = self.step(model, before, observation, thrust, dt)
        return disturbance, after.pack()


def residual(
    model: PayloadModelParameters,
    memory: ObserverMemory,
    v: Array,
    W: Array,
    quadrotors: Array,
    thrust: Array,
    dt: float,
) -> Array:
    """Return the forces and the moment (6 + 3 n,) behind the last change of velocities.

    Parameters
    ----------
    model : PayloadModelParameters
    memory : ObserverMemory
        Velocities at the last observation.
    v, W, quadrotors :
        The same at this one, as in `ObserverMemory`.
    thrust : (n, 3) array
        Thrusts commanded in between, in the world [N].
    dt : float
        Time in between [s].

    Returns
    -------
    Force on the payload in the world [N], moment about its CoM in L [N m], and the forces on the
    quadrotors perpendicular to their cables. Gravity, thrusts and the cables' pulls are taken out.
    """
    m = model.quadrotor_mass[:, None]
    before, mean = memory.quadrotors, 0.5 * (memory.quadrotors + quadrotors)
    _, xi, eta, z = mean
    xi = xi / np.sqrt((xi * xi).sum(-1, keepdims=True))
    rest = m * (quadrotors[0] - before[0]) / dt - (thrust * z).sum(-1, keepdims=True) * z
    rest[:, 2] += GRAVITY * m[:, 0]
    tension = (rest * xi).sum(-1, keepdims=True)
    mean_W = 0.5 * (memory.W + W)
    pull = (tension * xi).sum(0)
    force = model.mass * ((v - memory.v) / dt + [0.0, 0.0, GRAVITY]) + pull
    spin = model.inertia @ (W - memory.W) / dt + cross(mean_W, model.inertia @ mean_W)
    moment = spin + cross(model.arms, tension * eta).sum(0)
    return np.concatenate([force, moment, (rest - tension * xi).ravel()])


def _in_still_air(model: PayloadModelParameters, o: Observation, v: Array) -> Array:
    """Return what the forces of still air add to a `residual` (6 + 3 n,)."""
    assert model.air is not None
    wrench = payload_wrench(model, o.R[None], o.W[None], v[None]).wrench[0]
    drag = rotor_drag(model.air.rotor_drag, o.z_WQ, -o.v_WQ)
    along = (drag * o.xi).sum(-1, keepdims=True)
    wrench[0:3] += (along * o.xi).sum(0)
    wrench[3:6] += cross(model.arms, along * (o.xi @ o.R)).sum(0)
    return np.concatenate([wrench, (drag - along * o.xi).ravel()])


def _limit(vector: Array, bound: float) -> bool:
    """Shorten a vector (3,) to a length in place, and return whether it was longer.

    A vector that is not finite becomes zero.
    """
    size = float(np.sqrt(vector @ vector))
    if not np.isfinite(size):
        vector[:] = 0.0
    elif size > bound:
        vector *= bound / size
        return True
    return False
