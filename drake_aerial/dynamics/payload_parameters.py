"""Parameters of the payload model, as a controller believes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, skew
from drake_aerial.plant.air import PayloadAir
from drake_aerial.statics.gravity import GRAVITY

LEAST_SHARE = 0.05
"""Least share of the weight by which a cable's share of other forces is weighed, times n."""


@dataclass(frozen=True, eq=False)
class ModelAir:
    """Parameters of the air in the payload model.

    Attributes
    ----------
    drag : (3, 3) array
        Matrix K of the payload's drag |v| K v, in the axes of L [kg/m].
    p_LD : (3,) array
        Point in L at which drag and buoyancy act [m].
    rotor_drag : (n,) array
        Rotor drag of each quadrotor across its thrust [kg/s].
    mass : float
        Mass of the air that is accelerated with the payload. It is part of the model's mass, and
        its weight is balanced [kg].
    """

    drag: Array
    p_LD: Array
    rotor_drag: Array
    mass: float = 0.0


@dataclass(frozen=True, eq=False)
class PayloadModelParameters:
    """Parameters of one rigid payload and n quadrotors, point masses on taut cables.

    A scalar means n equal values of a quantity per quadrotor. Gripper and cable masses belong
    to the payload.

    Parameters
    ----------
    mass : float
        Payload mass M [kg].
    inertia : (3, 3) array
        Payload inertia about its CoM, in the axes of L [kg m^2].
    p_LC : (n, 3) array
        Contacts in the tracked frame L [m].
    p_LLcm : (3,) array
        CoM in L [m].
    quadrotor_mass, cable_length : (n,) arrays
        m_i [kg] and l_i [m].
    thrust_lag : (n, 3) array
        First-order lag of the thrust vector along the world's x, y, z [s]. It may be shorter than
        the MPC's step.
    min_thrust, max_thrust : (n,) arrays
        Limits of the total thrust of each quadrotor [N].
    air : ModelAir, optional
        None for no air. Mass, inertia and CoM are then those of everything that is accelerated;
        `in_air` adds the air to the properties of a payload that is known without it.

    Raises
    ------
    InputError
        If a value has the wrong shape, is not finite, or is physically impossible.
    """

    mass: float
    inertia: Any
    p_LC: Any
    p_LLcm: Any = (0.0, 0.0, 0.0)
    quadrotor_mass: Any = 0.25
    cable_length: Any = 0.5
    thrust_lag: Any = (0.1, 0.1, 0.03)
    min_thrust: Any = 0.8
    max_thrust: Any = 7.07
    air: ModelAir | None = None

    def __post_init__(self) -> None:
        p_LC = np.atleast_2d(np.asarray(self.p_LC, float))
        if p_LC.ndim != 2 or p_LC.shape[1] != 3 or not len(p_LC) or not np.isfinite(p_LC).all():
            raise InputError(
                f"`p_LC` must be n >= 1 finite contacts (n, 3) [m], got shape {p_LC.shape}"
            )
        n = len(p_LC)
        inertia = _array("inertia", self.inertia, (3, 3))
        _check_inertia(inertia)
        if not self.mass > 0.0 or not np.isfinite(self.mass):
            raise InputError(f"`mass` must be in (0, inf) kg, got {self.mass}")
        values = {
            "p_LC": p_LC,
            "inertia": inertia,
            "p_LLcm": _array("p_LLcm", self.p_LLcm, (3,)),
            "quadrotor_mass": _array("quadrotor_mass", self.quadrotor_mass, (n,)),
            "cable_length": _array("cable_length", self.cable_length, (n,)),
            "thrust_lag": _array("thrust_lag", self.thrust_lag, (n, 3)),
            "min_thrust": _array("min_thrust", self.min_thrust, (n,)),
            "max_thrust": _array("max_thrust", self.max_thrust, (n,)),
        }
        for name in ("quadrotor_mass", "cable_length", "thrust_lag"):
            if not (values[name] > 0.0).all():
                raise InputError(f"`{name}` must be positive, got {values[name].tolist()}")
        if (
            not (values["max_thrust"] > values["min_thrust"]).all()
            or (values["min_thrust"] < 0.0).any()
        ):
            raise InputError(
                "`min_thrust` must be in [0, max_thrust) N for every quadrotor, got "
                f"{values['min_thrust'].tolist()} and max_thrust {values['max_thrust'].tolist()}"
            )
        for name, value in values.items():
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @property
    def n(self) -> int:
        """Number of quadrotors."""
        return len(self.p_LC)

    @cached_property
    def arms(self) -> Array:
        """Contacts relative to the payload's CoM, a_i = p_LC - p_LLcm (n, 3), in L [m]."""
        return self.p_LC - self.p_LLcm

    @cached_property
    def arm_matrices(self) -> Array:
        """[a_i]x of the arms, (n, 3, 3) [m]."""
        return skew(self.arms)

    @cached_property
    def inverse_masses(self) -> Array:
        """diag(1 / m_i), (n, n) [1/kg]."""
        return np.diag(1.0 / self.quadrotor_mass)

    @cached_property
    def inertia_inverse(self) -> Array:
        """Inverse of the payload's inertia (3, 3) [1/(kg m^2)]."""
        return np.linalg.inv(self.inertia)

    @cached_property
    def grasp_matrix(self) -> Array:
        """Grasp matrix P (6, 3 n).

        It maps the stacked cable forces on the payload (axes of L) to force and moment about the
        CoM.
        """
        return np.concatenate(
            [np.tile(np.eye(3), self.n), np.concatenate(list(skew(self.arms)), axis=1)]
        )

    @cached_property
    def grasp_inverse(self) -> Array:
        """Inverse (3 n, 6) of P: the cable forces for a force and a moment.

        Without air they have the least sum of squares, as in the paper. A cable that bears little
        weight then takes as much of a sideways force as the others and tilts more, and quadrotors
        may meet. With air the squares are divided by the cables' shares of the weight, so that
        cables stay nearly parallel when the payload accelerates. With one cable, the moment is
        ignored.
        """
        if self.n > 1 and self.air is not None:
            root = np.sqrt(np.repeat(self.weight_shares, 3))
            return root[:, None] * np.asarray(np.linalg.pinv(self.grasp_matrix * root), float)
        return np.asarray(np.linalg.pinv(self.grasp_matrix) if self.n > 1 else np.eye(3, 6), float)

    @cached_property
    def weight_shares(self) -> Array:
        """Shares (n,) of the cables of a level payload's weight, at least `LEAST_SHARE` / n."""
        up = np.array([0.0, 0.0, 1.0])
        wrench = np.concatenate([up, np.cross(self.p_LLhang - self.p_LLcm, up)])
        share = (np.linalg.pinv(self.grasp_matrix) @ wrench)[2::3]
        return np.asarray(np.maximum(share, LEAST_SHARE / self.n), float)

    @cached_property
    def hinged(self) -> bool:
        """True if all contacts lie on a line or in one point; cables apply no moment about it."""
        singular = np.linalg.svd(self.p_LC - self.p_LC.mean(0), compute_uv=False)
        return len(singular) < 2 or bool(singular[1] < 1e-6)

    @cached_property
    def constant_jacobians(self) -> tuple[Array, Array]:
        """Constant parts of the linearised model, with respect to the core y of the error state.

        Of y' (6 + 7 n, 6 + 7 n), in the rows of angular velocity, cable rates and thrust lags; and
        of q, due to the thrusts, (n, 3, 6 + 7 n).
        """
        n = self.n
        A, q = np.zeros((6 + 7 * n, 6 + 7 * n)), np.zeros((n, 3, 6 + 7 * n))
        A[0:3, 3:6] = np.eye(3)
        A[6 : 6 + 2 * n, 6 + 2 * n : 6 + 4 * n] = np.eye(2 * n)
        A[6 + 4 * n :, 6 + 4 * n :] = -np.diag(1.0 / self.thrust_lag.ravel())
        for i in range(n):
            column = 6 + 4 * n + 3 * i
            q[i, :, column : column + 3] = -np.eye(3) / (
                self.quadrotor_mass[i] * self.cable_length[i]
            )
        return A, q

    def carried_by(self, quadrotors: Sequence[int]) -> PayloadModelParameters:
        """Return the model with some of the cables only; the mass of the others' grippers stays."""
        index = list(quadrotors)
        names = ("p_LC", "quadrotor_mass", "cable_length", "thrust_lag", "min_thrust", "max_thrust")
        air = self.air and replace(self.air, rotor_drag=self.air.rotor_drag[index])
        return replace(self, **{name: getattr(self, name)[index] for name in names}, air=air)

    def in_air(self, payload: PayloadAir, rotor_drag: ArrayLike) -> PayloadModelParameters:
        """Return the model with air: drag, and the added mass of the payload.

        Parameters
        ----------
        payload : PayloadAir
            In the axes of L.
        rotor_drag : float or (n,) array
            Rotor drag of each quadrotor across its thrust [kg/s].
        """
        mass = self.mass + payload.mass
        com = (self.mass * self.p_LLcm + payload.mass * payload.centre) / mass
        inertia = self.inertia + payload.inertia
        for part, at in ((self.mass, self.p_LLcm), (payload.mass, payload.centre)):
            inertia = inertia + part * (
                (at - com) @ (at - com) * np.eye(3) - np.outer(at - com, at - com)
            )
        each = _array("rotor_drag", rotor_drag, (self.n,))
        air = ModelAir(payload.drag, payload.centre, each, payload.mass)
        return replace(self, mass=mass, p_LLcm=com, inertia=inertia, air=air)

    @cached_property
    def drag_lever(self) -> Array:
        """[b]x of the lever b of drag and buoyancy about the CoM, (3, 3) [m]."""
        assert self.air is not None
        return skew(self.air.p_LD - self.p_LLcm)

    @cached_property
    def mobility(self) -> Array:
        """Matrix (6, 6) from force and moment about the CoM to angular and linear acceleration."""
        matrix = np.zeros((6, 6))
        matrix[0:3, 3:6], matrix[3:6, 0:3] = self.inertia_inverse, np.eye(3) / self.mass
        return matrix

    @property
    def hanging_mass(self) -> float:
        """Mass that a scale shows: all that hangs on the cables, without the air [kg]."""
        return self.mass if self.air is None else self.mass - self.air.mass

    @cached_property
    def p_LLhang(self) -> Array:
        """CoM of all that hangs on the cables, without the air, in L [m]."""
        if self.air is None:
            return self.p_LLcm
        moment = self.mass * self.p_LLcm - self.air.mass * self.air.p_LD
        return np.asarray(moment / self.hanging_mass, float)

    @property
    def weight(self) -> float:
        """Weight of payload and quadrotors together [N]."""
        return GRAVITY * (self.hanging_mass + float(self.quadrotor_mass.sum()))


def _array(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Array:
    try:
        given = np.asarray(value, float)
        array = np.array(np.broadcast_to(given, shape))
    except (TypeError, ValueError):
        raise InputError(f"`{name}` must be of shape {shape}, got {np.shape(value)}") from None
    if not np.isfinite(array).all():
        raise InputError(f"`{name}` must be finite, got {np.asarray(value).tolist()}")
    return array


def _check_inertia(inertia: Array) -> None:
    scale = np.abs(inertia).max()
    if not np.allclose(inertia, inertia.T, atol=1e-9 * scale):
        raise InputError(f"`inertia` must be symmetric, got {inertia.tolist()}")
    a, b, c = np.linalg.eigvalsh(inertia)
    if a <= 0.0 or a + b < c * (1.0 - 1e-9):
        raise InputError(
            "`inertia` must have positive principal moments, each at most the sum of the others, "
            f"got {a:.4g}, {b:.4g}, {c:.4g} kg m^2"
        )
