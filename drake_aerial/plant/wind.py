"""Wind: the velocity of the air."""

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_aerial.errors import InputError
from drake_aerial.io.records import NonNegative, Positive, Vector, record
from drake_aerial.plant.dryden import Dryden

TURBULENCE_PERIOD = 0.002
"""Default time step of the turbulence, which is constant in between [s]."""


@record(frozen=True)
class WindParameters:
    """Mean wind plus a gust plus turbulence.

    Vectors are in the world frame. The wind is the same everywhere: its change with place and
    height is not modelled. `AirParameters` has what it does to payload and quadrotors.

    Examples
    --------
    >>> from drake_aerial import StationParameters, WindParameters
    >>> breeze = WindParameters(mean=(3.0, 0.0, 0.0), gust=(0.0, 2.0, 0.0), gust_start=8.0)
    >>> StationParameters(wind=breeze).wind.mean
    (3.0, 0.0, 0.0)
    """

    mean: Vector = (0.0, 0.0, 0.0)
    """Mean velocity of the air [m/s]."""
    gust: Vector = (0.0, 0.0, 0.0)
    """Peak velocity of a gust of the "1 - cosine" shape [m/s]."""
    gust_start: NonNegative = 5.0
    """Time at which the gust begins [s]."""
    gust_duration: Positive = 2.0
    """Duration of the gust [s]."""
    turbulence: Dryden | None = None
    """Dryden turbulence along the mean wind's horizontal heading (the world's x if it has none),
    across it and up; None for none."""


class Wind(LeafSystem):
    """Velocity of the air, the same everywhere.

    | port | size | meaning |
    |---|---|---|
    | out `velocity` | 3 | velocity of the air in the world [m/s] |

    Turbulence is noise filtered by Dryden's filters, discretised exactly and stationary from the
    first step on. The filters' state is in the Context. The noise is a function of time and of the
    seed, a parameter in the Context (`set_seed`).

    Parameters
    ----------
    parameters : WindParameters
    period : float
        Time step of the turbulence [s]: that of the plant.

    Raises
    ------
    InputError
        If the period is not positive.
    """

    def __init__(self, parameters: WindParameters, period: float = TURBULENCE_PERIOD):
        super().__init__()
        if not (np.isfinite(period) and period > 0.0):
            raise InputError(f"`period` of the turbulence must be positive [s], got {period!r}")
        self._parameters, self._period = parameters, period
        self._mean, self._gust = np.array(parameters.mean), np.array(parameters.gust)
        self._seed = self.DeclareNumericParameter(BasicVector([0.0]))
        self.DeclareDiscreteState(np.zeros(6))
        if parameters.turbulence is not None:
            self._Phi, self._N, C, self._N0 = parameters.turbulence.steps(period)
            heading = np.arctan2(self._mean[1], self._mean[0])
            along, across = (
                (np.cos(heading), np.sin(heading), 0.0),
                (-np.sin(heading), np.cos(heading), 0.0),
            )
            self._C_W = np.array([along, across, (0.0, 0.0, 1.0)]).T[:, :, None] * C
            self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._stir)
        self.DeclareVectorOutputPort("velocity", 3, self._calc)

    def set_seed(self, context: Context, seed: int) -> None:
        """Set the random seed of the turbulence in this system's context."""
        context.get_mutable_numeric_parameter(self._seed).SetFromVector([float(seed)])

    def _stir(self, context: Context, discrete_state: DiscreteValues) -> None:
        number = round(context.get_time() / self._period)
        seed = int(context.get_numeric_parameter(self._seed).GetAtIndex(0))
        # The second word of the key separates this stream from that of the sensor's noise.
        key, counter = np.array([seed, 1], dtype=np.uint64), [0, 0, 0, number]
        noise = np.random.Generator(np.random.Philox(key=key, counter=counter)).standard_normal(
            (3, 2, 1)
        )
        if number > 0:
            after = (
                self._Phi @ context.get_discrete_state_vector().value().reshape(3, 2, 1)
                + self._N @ noise
            )
        else:
            after = self._N0 @ noise
        discrete_state.get_mutable_vector().SetFromVector(after.ravel())

    def _calc(self, context: Context, output: BasicVector) -> None:
        p = self._parameters
        since = (context.get_time() - p.gust_start) / p.gust_duration
        strength = 0.5 * (1.0 - np.cos(2.0 * np.pi * since)) if 0.0 < since < 1.0 else 0.0
        velocity = self._mean + strength * self._gust
        if p.turbulence is not None:
            x = context.get_discrete_state_vector().value().reshape(3, 2)
            velocity = velocity + (self._C_W * x).sum((1, 2))
        output.SetFromVector(velocity)
