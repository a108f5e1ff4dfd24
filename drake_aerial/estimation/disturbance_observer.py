"""What pushes that the model does not know of: constant forces on payload and quadrotors, and a moment, observed from motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.observation import Observation
from drake_aerial.geometry import Array, cross
from drake_aerial.io.typed_yaml.record_fields import Unbounded
from drake_aerial.statics.gravity import GRAVITY

_HEAD = 7  # seen before, velocity of the CoM (3), angular velocity (3)


class Disturbance(NamedTuple):
    """Forces and a moment that come on top of the model's.

    Attributes
    ----------
    force : (3,) array
        On the payload's CoM, in the world [N].
    moment : (3,) array
        On the payload, in the axes of L [N m].
    on_quadrotors : (n, 3) array
        At each quadrotor, in the world, perpendicular to its cable as observed [N].
    """

    force: Array
    moment: Array
    on_quadrotors: Array

    @property
    def wrench(self) -> Array:
        """Force and moment on the payload, (6,)."""
        return np.concatenate([self.force, self.moment])


class DisturbanceObserver(NamedTuple):
    """A first-order observer of a `Disturbance`, from changes of measured velocities.

    Between two ticks each quadrotor's change of momentum, less its weight and thrust, leaves the cable's pull and what pushes otherwise:
    its part along the cable is taken for the pull, the rest for the disturbance. The payload's changes of momentum and of angular
    momentum, less weight and the cables' pulls, leave the payload's. These values are averaged over `time` and held within limits. A
    push on a quadrotor along its cable thus counts as one on the payload, which moves everything in the same way; and so does a thrust
    or a mass that is not what the model says. Measured positions, which are noisy, do not enter.

    Attributes
    ----------
    time : float
        Time constant of the forces [s].
    moment_time : float
        Time constant of the moment [s]; infinite is none at all.
    share : float
        Largest size of each force, as a part of the weight of the payload or the quadrotor.
    lever : float
        Largest moment over the payload's weight [m]: how far its CoM may be from where it is believed.

    Examples
    --------
    >>> from drake_aerial import DisturbanceObserver, FlightOptions
    >>> options = FlightOptions(controller_options={"observer": DisturbanceObserver(time=0.3)})
    >>> options.controller_options["observer"].lever
    0.12
    """

    time: float = 0.5
    moment_time: Unbounded = 1.0
    share: float = 0.5
    lever: float = 0.12

    @staticmethod
    def size(n: int) -> int:
        """Return how many numbers the memory of an observer of n quadrotors holds; zeros mean that nothing was seen yet."""
        return _HEAD + 12 * n + 6 + 3 * n

    def step(
        self,
        model: PayloadModelParameters,
        memory: Array,
        seen: Observation,
        thrust: Array,
        dt: float,
    ) -> Disturbance:
        """Return the disturbance after an observation, and update `memory` in place.

        Parameters
        ----------
        model : PayloadModelParameters
        memory : (size(n),) array
        seen : Observation
        thrust : (n, 3) array
            What was commanded since the last observation, in the world [N].
        dt : float
            Time since then [s].
        """
        n, m = model.n, model.quadrotor_mass[:, None]
        v = seen.v + seen.R @ cross(seen.W, model.p_LLcm)
        moving = np.concatenate([seen.v_WQ, seen.xi, seen.xi @ seen.R, seen.z_WQ]).reshape(4, n, 3)
        before = memory[_HEAD : _HEAD + 12 * n].reshape(4, n, 3)
        estimate = memory[_HEAD + 12 * n :]
        if memory[0]:
            mean = 0.5 * (before + moving)
            _, xi, eta, z = mean
            xi = xi / np.sqrt((xi * xi).sum(-1, keepdims=True))
            push = m * (moving[0] - before[0]) / dt - (thrust * z).sum(-1, keepdims=True) * z
            push[:, 2] += GRAVITY * m[:, 0]
            tension = (push * xi).sum(-1, keepdims=True)
            W = 0.5 * (memory[4:7] + seen.W)
            force = model.mass * ((v - memory[1:4]) / dt + [0.0, 0.0, GRAVITY]) + (
                tension * xi
            ).sum(0)
            spin = model.inertia @ (seen.W - memory[4:7]) / dt + cross(W, model.inertia @ W)
            moment = spin + cross(model.arms, tension * eta).sum(0)
            found = np.concatenate([force, moment, (push - tension * xi).ravel()])
            gain = np.full(6 + 3 * n, -np.expm1(-dt / self.time))
            gain[3:6] = -np.expm1(-dt / self.moment_time)
            estimate += gain * (found - estimate)
            weight = GRAVITY * model.mass
            _hold(estimate[0:3], self.share * weight)
            _hold(estimate[3:6], self.lever * weight)
            for i in range(n):
                _hold(
                    estimate[6 + 3 * i : 9 + 3 * i], self.share * GRAVITY * model.quadrotor_mass[i]
                )
        memory[0], memory[1:4], memory[4:7] = 1.0, v, seen.W
        memory[_HEAD : _HEAD + 12 * n] = moving.ravel()
        return Disturbance(
            estimate[0:3].copy(), estimate[3:6].copy(), estimate[6:].reshape(n, 3).copy()
        )


def _hold(vector: Array, limit: float) -> None:
    """Shorten a vector (3,) to a length in place; what is not finite becomes zero."""
    size = float(np.sqrt(vector @ vector))
    if not np.isfinite(size):
        vector[:] = 0.0
    elif size > limit:
        vector *= limit / size
