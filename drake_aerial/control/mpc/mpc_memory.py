"""State of the MPC between control steps, as a discrete state vector of the Context."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drake_aerial.geometry import Array

_SCALARS = 7


class MpcMemory(NamedTuple):
    """State of the MPC between control steps; all zeros at the start of the flight.

    Thrusts and inputs of the plan include the observed forces on the quadrotors.

    Attributes
    ----------
    begun : float
        1 once a plan exists.
    iterations, active_bounds : float
        QP iterations of the last plan, and how many of its bounds are active.
    prediction_error : float
        Difference of the CoM's measured position from that of the last plan [m].
    correction : float
        Size of the last change of the plan's first input [N].
    limited_steps : float
        Number of control steps in which the observed disturbance was at a limit.
    age : float
        Control steps since the plan was made.
    shift : (3,) array
        Shift of the reference by integral action, in the world [m].
    inputs : (N, 3 n) array
        Inputs of the plan, in the world [N].
    states : (N + 1, 18 + 9 n) array
        States of the plan, as rows (`horizon.pack`).
    observer : array
        Memory of the disturbance observer; empty without one.
    """

    begun: float
    iterations: float
    active_bounds: float
    prediction_error: float
    correction: float
    limited_steps: float
    age: float
    shift: Array
    inputs: Array
    states: Array
    observer: Array

    @staticmethod
    def size(N: int, n: int, observer: int) -> int:
        """Return the length of the vector for N steps, n quadrotors and the observer's memory."""
        return _SCALARS + 3 + N * 3 * n + (N + 1) * (18 + 9 * n) + observer

    @classmethod
    def unpack(cls, values: Array, N: int, n: int) -> MpcMemory:
        """Return the memory in a vector; its arrays are views."""
        inputs = _SCALARS + 3
        states = inputs + N * 3 * n
        observer = states + (N + 1) * (18 + 9 * n)
        arrays = (
            values[_SCALARS:inputs],
            values[inputs:states].reshape(N, -1),
            values[states:observer].reshape(N + 1, -1),
            values[observer:],
        )
        return cls._make([*values[:_SCALARS].tolist(), *arrays])

    @classmethod
    def count_step(cls, values: Array) -> tuple[float, float]:
        """Add a control step to the age in a vector, in place, and return `begun` and `age`."""
        begun, age = cls._fields.index("begun"), cls._fields.index("age")
        values[age] += 1.0
        return float(values[begun]), float(values[age])

    def pack(self) -> Array:
        """Return the memory as a vector."""
        arrays = (self.shift, self.inputs.ravel(), self.states.ravel(), self.observer)
        return np.concatenate([self[:_SCALARS], *arrays])
