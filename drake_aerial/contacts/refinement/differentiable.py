"""Functions with analytic Jacobians as callables for Drake's optimisation programs."""

from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, ExtractValue, InitializeAutoDiff

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array

ValueAndJacobian = Callable[[Array], tuple[Array, Array]]


class Differentiable:
    """Function of a vector of doubles or AutoDiffXd, with derivatives by the chain rule.

    Drake's `AddCost` and `AddConstraint` take it as it is.

    Parameters
    ----------
    value_and_jacobian : callable
        Function from a vector (D,) to the value (m,) and its Jacobian (m, D).
    scalar : bool
        True for a function whose value is one number, as of a cost, instead of an array.

    Raises
    ------
    InputError
        If called with anything but doubles or AutoDiffXd, for instance symbolic expressions.
    """

    def __init__(self, value_and_jacobian: ValueAndJacobian, *, scalar: bool = False):
        self.value_and_jacobian, self._scalar = value_and_jacobian, scalar

    def __call__(self, x: Any) -> Any:
        """Return the value at x (D,), or a column (D, 1), in x's own scalar type."""
        x = np.asarray(x).ravel()
        if x.dtype != object:
            value = self.value_and_jacobian(np.asarray(x, float))[0]
            return float(value[0]) if self._scalar else value

        if not all(isinstance(entry, AutoDiffXd) for entry in x):
            raise InputError(
                "a contact program's cost or constraint must be evaluated with float or "
                f"AutoDiffXd, got {type(x[0]).__name__}"
            )
        value, jacobian = self.value_and_jacobian(ExtractValue(x)[:, 0])
        out = InitializeAutoDiff(value, jacobian @ ExtractGradient(x))[:, 0]
        return out[0] if self._scalar else out
