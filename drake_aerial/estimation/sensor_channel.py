"""One measured quantity: its samples, with noise and bias, and the delay with which they arrive."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.estimation.sensor_parameters import Measurement
from drake_aerial.geometry import Array

_STREAM = 2
"""Second word of the random key; 0 and 1 are those of `StateSensor` and `Wind`."""


def whole_steps(name: str, time: float, step: float) -> int:
    """Return a time as a number of steps.

    Raises
    ------
    InputError
        If it is not a multiple of the step.
    """
    count = round(time / step)
    if abs(count * step - time) > 1e-6 * step:
        raise InputError(f"`{name}` must be a multiple of the time step {step:g} s, got {time:g} s")
    return count


class Channel(NamedTuple):
    """A measured quantity in steps of the plant.

    Attributes
    ----------
    first : int
        Where its errors begin among those of all quantities.
    size, noises : int
        Length of a sample, and of its noise.
    noise, bias : float
        Standard deviations.
    period, delay : int
        In steps.
    """

    first: int
    size: int
    noises: int
    noise: float
    bias: float
    period: int
    delay: int

    @classmethod
    def of(
        cls, name: str, given: Measurement, first: int, size: int, noises: int, step: float
    ) -> Channel:
        """Return the channel of a measurement for a plant with a time step [s].

        Raises
        ------
        InputError
            If period or delay is not a multiple of the step, or the period is shorter.
        """
        period = whole_steps(f"{name}.period", given.period, step)
        if period < 1:
            raise InputError(f"`{name}.period` must be >= {step:g} s, got {given.period:g} s")
        delay = whole_steps(f"{name}.delay", given.delay, step)
        return cls(first, size, noises, given.noise, given.bias, period, delay)

    @property
    def depth(self) -> int:
        """Number of samples that are kept."""
        return -(-self.delay // self.period) + 1

    def is_due(self, steps: int) -> bool:
        """Return whether a sample is taken after a number of steps."""
        return steps % self.period == 0

    def age(self, steps: int) -> int:
        """Return how many samples before the newest one is read after a number of steps."""
        newest = steps // self.period
        return min(newest - max(steps - self.delay, 0) // self.period, self.depth - 1)

    def error(self, normal: Array, constant: Array) -> Array:
        """Return the error (noises,) of a sample.

        Parameters
        ----------
        normal : array
            Standard normal numbers of all quantities at the time of the sample.
        constant : array
            Standard normal numbers of all quantities that belong to the flight.
        """
        part = slice(self.first, self.first + self.noises)
        return self.noise * normal[part] + self.bias * constant[part]


class ErrorStream:
    """Standard normal numbers that depend on a seed and a count only, not on the order of calls.

    Parameters
    ----------
    size : int
        How many numbers there are for each count.
    """

    def __init__(self, size: int):
        self._size = size
        self._philox = np.random.Philox(key=0)
        self._position: Any = self._philox.state
        self._generator = np.random.Generator(self._philox)

    def numbers(self, seed: int, count: int) -> Array:
        """Return the numbers (size,) of a seed and a count >= 0."""
        # Setting the generator's position is faster than making a generator.
        position = self._position["state"]
        position["key"] = np.array([seed, _STREAM], dtype=np.uint64)
        position["counter"] = np.array([0, 0, 0, count], dtype=np.uint64)
        self._philox.state = self._position
        return self._generator.standard_normal(self._size)
