"""Lead compensation of slow motors: commands that make propeller speeds respond faster."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_aerial.control.allocation import Allocation
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

RESPONSE = 0.01
"""Time constant of the compensated speeds within their limits [s]."""


class MotorLead(LeafSystem):
    """Inverse of the motor lag tau omega' = command - omega, with a model of the speeds.

    The desired response to wanted speeds w is omega' = (w - omega) / T, with T = `response`. The
    command is omega + tau omega' = omega + tau / T (w - omega), within the propeller's limits. The
    model of omega uses the limited command, so it does not wind up. Motors faster than T are not
    compensated.

    | port | size | meaning | unit | frame |
    |---|---|---|---|---|
    | in `wanted` | 4 n | squared speeds, not negative | rpm^2 | - |
    | out `propeller_commands` | 4 n | squared speeds, within their limits | rpm^2 | - |

    The modelled speeds are discrete state in the Context (`set_speeds`).

    Parameters
    ----------
    propellers : sequence of n Allocation
        Their speed limits are used.
    time_constant : float
        Time constant tau of the motors [s].
    period : float
        Step of the model, equal to the plant's [s].
    response : float
        Time constant T of the response [s].
    initial : (4 n,) array, optional
        Modelled speeds in a new context [rpm]; by default the lowest.

    Raises
    ------
    InputError
        If a time is not positive.
    """

    def __init__(
        self,
        propellers: Sequence[Allocation],
        time_constant: float,
        period: float,
        response: float = RESPONSE,
        initial: ArrayLike | None = None,
    ):
        super().__init__()
        for name, value in (
            ("time_constant", time_constant),
            ("period", period),
            ("response", response),
        ):
            if not (np.isfinite(value) and value > 0.0):
                raise InputError(f"`{name}` must be in (0, inf) s, got {value!r}")
        self._low = np.repeat([p.min_rpm for p in propellers], 4)
        self._high = np.repeat([p.max_rpm for p in propellers], 4)
        # Exact for a command that is held over a step: exp(-period / T) of the difference remains.
        self._follow = -np.expm1(-period / time_constant)
        self._lead = max(-np.expm1(-period / response) / self._follow, 1.0)
        self._wanted = self.DeclareVectorInputPort("wanted", len(self._low))
        self.DeclareDiscreteState(self._low if initial is None else np.asarray(initial, float))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)
        self.DeclareVectorOutputPort("propeller_commands", len(self._low), self._calc)

    def set_speeds(self, context: Context, speeds: ArrayLike) -> None:
        """Set the modelled speeds (4 n) [rpm] in this system's context."""
        context.get_mutable_discrete_state_vector().SetFromVector(np.asarray(speeds, dtype=float))

    def _command(self, context: Context) -> tuple[Array, Array]:
        """Return the modelled speeds and the commanded ones, (4 n) each [rpm]."""
        speed = context.get_discrete_state_vector().value()
        wanted = np.sqrt(np.maximum(self._wanted.Eval(context), 0.0))
        return speed, np.clip(speed + self._lead * (wanted - speed), self._low, self._high)

    def _update(self, context: Context, discrete_state: DiscreteValues) -> None:
        speed, command = self._command(context)
        discrete_state.get_mutable_vector().SetFromVector(speed + self._follow * (command - speed))

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.square(self._command(context)[1]))
