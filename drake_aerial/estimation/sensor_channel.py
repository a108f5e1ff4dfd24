"""One measured quantity: its samples, with noise and bias, and the delay with which they arrive."""

from __future__ import annotations

from typing import NamedTuple

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
    number : int
        Number of its random stream.
    size, noises : int
        Length of a sample, and of its noise.
    noise, bias : float
        Standard deviations.
    period, delay : int
        In steps.
    """

    number: int
    size: int
    noises: int
    noise: float
    bias: float
    period: int
    delay: int

    @classmethod
    def of(
        cls, name: str, given: Measurement, number: int, size: int, noises: int, step: float
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
        return cls(number, size, noises, given.noise, given.bias, period, delay)

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

    def error(self, seed: int, steps: int) -> Array:
        """Return noise and bias (noises,) of the sample that is taken after a number of steps.

        Each seed, quantity and sample has a block of a random stream of its own, so the order of
        calls does not matter.
        """
        error = np.zeros(self.noises)
        if self.noise > 0.0:
            error += self.noise * self._normal(seed, 1 + steps // self.period)
        if self.bias > 0.0:
            error += self.bias * self._normal(seed, 0)
        return error

    def _normal(self, seed: int, block: int) -> Array:
        key = np.array([seed, _STREAM], dtype=np.uint64)
        counter = np.array([0, 0, self.number, block], dtype=np.uint64)
        generator = np.random.Generator(np.random.Philox(key=key, counter=counter))
        return generator.standard_normal(self.noises)
