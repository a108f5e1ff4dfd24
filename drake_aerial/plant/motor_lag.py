"""Motor lag: propeller speeds follow their commands with a first-order lag."""

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_aerial.errors import InputError


class MotorLag(LeafSystem):
    """Speeds of N propellers, tau omega' = sqrt(command) - omega.

    The discretisation is exact for commands that are constant between steps.

    | port | size | meaning |
    |---|---|---|
    | in `command` | N | squared speeds [rpm^2], none negative |
    | out `squared_speed` | N | [rpm^2] |

    The speeds are discrete state in the Context; `set_speeds` sets them.

    Parameters
    ----------
    size : int
        N.
    time_constant : float
        tau [s].
    period : float
        Time step of the update, that of the plant [s].
    initial : (N,) array
        Speeds in a new context [rpm].

    Raises
    ------
    InputError
        If the time constant is not positive.
    """

    def __init__(self, size: int, time_constant: float, period: float, initial: ArrayLike = 0.0):
        super().__init__()
        if not (np.isfinite(time_constant) and time_constant > 0.0):
            raise InputError(
                f"the motors' time constant must be positive [s], got {time_constant!r}"
            )
        self._gain = 1.0 - np.exp(-period / time_constant)
        self._command = self.DeclareVectorInputPort("command", size)
        state = self.DeclareDiscreteState(
            np.broadcast_to(np.asarray(initial, dtype=float), (size,)).copy()
        )
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._follow)
        self.DeclareVectorOutputPort(
            "squared_speed", size, self._calc, {self.discrete_state_ticket(state)}
        )

    def set_speeds(self, context: Context, speeds: ArrayLike) -> None:
        """Set the speeds (N,) [rpm] in this system's context."""
        context.get_mutable_discrete_state_vector().SetFromVector(np.asarray(speeds, dtype=float))

    def _follow(self, context: Context, discrete_state: DiscreteValues) -> None:
        speed = context.get_discrete_state_vector().value()
        wanted = np.sqrt(np.maximum(self._command.Eval(context), 0.0))
        discrete_state.get_mutable_vector().SetFromVector(speed + self._gain * (wanted - speed))

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.square(context.get_discrete_state_vector().value()))
