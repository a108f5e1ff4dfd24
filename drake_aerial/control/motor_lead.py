"""Lead for slow motors: commands under which propeller speeds follow what is wanted faster than by themselves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_aerial.control.allocation import Allocation
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

RESPONSE = 0.01
"""Time constant with which the speeds follow what is wanted, as far as their limits let them [s]."""


class MotorLead(LeafSystem):
    """Inverts the lag of the motors, tau omega' = command - omega, by a model of the speeds that it carries along.

    What is wanted is that the speeds approach the wanted ones w within `response` T, omega' = (w - omega) / T; the command for it is
    omega + tau omega' = omega + tau / T (w - omega), held within the propeller's limits. The model of omega sees the limited command, so
    that nothing winds up where a limit is met. Motors faster than T are left alone.

    | port | size | meaning |
    |---|---|---|
    | in `wanted` | 4 n | squared speeds [rpm^2], none negative |
    | out `propeller_commands` | 4 n | squared speeds, each within its limits [rpm^2] |

    The modelled speeds are discrete state in the Context; `set_speeds` sets them.

    Parameters
    ----------
    propellers : sequence of n Allocation
        Of which the limits are used.
    time_constant : float
        tau, of the motors [s].
    period : float
        Of the steps of the model, the plant's own [s].
    response : float
        T [s].

    Raises
    ------
    InputError
        For a time that is not positive.
    """

    def __init__(
        self,
        propellers: Sequence[Allocation],
        time_constant: float,
        period: float,
        response: float = RESPONSE,
    ):
        super().__init__()
        for name, value in (
            ("time constant", time_constant),
            ("period", period),
            ("response", response),
        ):
            if not (np.isfinite(value) and value > 0.0):
                raise InputError(
                    f"the motor lead's {name} is {value!r} s; a positive number accepted"
                )
        self._low = np.repeat([p.min_rpm for p in propellers], 4)
        self._high = np.repeat([p.max_rpm for p in propellers], 4)
        # Exact for a command that is held over a step, as it is: after it, exp(-period / T) of the difference is left.
        self._follow = -np.expm1(-period / time_constant)
        self._lead = max(-np.expm1(-period / response) / self._follow, 1.0)
        self._wanted = self.DeclareVectorInputPort("wanted", len(self._low))
        self.DeclareDiscreteState(self._low)
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
