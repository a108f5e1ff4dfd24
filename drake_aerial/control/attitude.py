"""Attitude loop of the quadrotors: from thrust vectors to propeller commands."""

from collections.abc import Sequence
from math import sqrt
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem, ValueProducer

from drake_aerial.control.allocation import Allocation, allocate
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.plant.quadrotor import QuadrotorParameters

ROTATION_GAIN = (0.25, 0.25, 0.08)
"""Moment per attitude error about x, y, z [N m]; row "rot" of the paper's table."""
RATE_GAIN = (0.025, 0.025, 0.005)
"""Moment per angular velocity about x, y, z [N m s]; row "ang" of the paper's table."""

_MIN_SLOPE = 0.2
"""Smallest ratio of vertical to horizontal thrust, so that no command turns a quadrotor over."""

Target = tuple[float, float, float, float, float, float, float]
"""Thrust vector in the world [N], and the attitude q_WQ (w, x, y, z) along it with yaw zero."""


def attitude_target(thrust_vector: Sequence[float]) -> Target:
    """Return the target of a commanded thrust vector (3,) in the world [N].

    The desired z is along the command, the desired y normal to it and to the world's x: a rotation
    about the world's x, then one about the new y.
    """
    ux, uy, uz = thrust_vector
    horizontal = sqrt(ux * ux + uy * uy)
    z = max(uz, _MIN_SLOPE * horizontal, 1e-6)
    size = sqrt(horizontal * horizontal + z * z)
    cx, cy, cz = ux / size, uy / size, z / size
    side = sqrt(cz * cz + cy * cy)
    # Half angles; both rotations are by less than 90 deg.
    c1 = sqrt(0.5 + 0.5 * cz / side)
    s1 = -0.5 * cy / (side * c1)
    c2 = sqrt(0.5 + 0.5 * side)
    s2 = 0.5 * cx / c2
    return ux, uy, uz, c1 * c2, s1 * c2, c1 * s2, s1 * s2


def attitude_law(
    state: Sequence[float], target: Target, inertia: Sequence[float], gains: Sequence[float]
) -> tuple[float, float, float, float]:
    """Return thrust [N] and moments about x, y, z of Q [N m] of one quadrotor.

    Parameters
    ----------
    state : 13 floats
        Quaternion w, x, y, z, position, angular velocity, linear velocity in the world.
    target : Target
    inertia : 9 floats
        In Q, row by row [kg m^2].
    gains : 6 floats
        Gains on attitude error and on angular velocity about x, y, z.
    """
    # Plain floats: for one to six quadrotors they are several times faster than small arrays.
    w, x, y, z, _, _, _, wx, wy, wz, _, _, _ = state
    ux, uy, uz, dw, dx, dy, dz = target
    x2, y2, z2 = x + x, y + y, z + z
    xx, yy, zz, xy, xz, yz = x * x2, y * y2, z * z2, x * y2, x * z2, y * z2
    ax, ay, az = w * x2, w * y2, w * z2
    # Angular velocity along the columns of R_WQ, thrust along the third.
    p = (1.0 - yy - zz) * wx + (xy + az) * wy + (xz - ay) * wz
    q = (xy - az) * wx + (1.0 - xx - zz) * wy + (yz + ax) * wz
    c1, c2, c3 = xz + ay, yz - ax, 1.0 - xx - yy
    r = c1 * wx + c2 * wy + c3 * wz
    # e_R = vee(R_d^T R - R^T R_d) / 2 is twice the product of the scalar and vector parts of the
    # quaternion between the two attitudes.
    e = 2.0 * (dw * w + dx * x + dy * y + dz * z)
    ex = e * (dw * x - dx * w - dy * z + dz * y)
    ey = e * (dw * y + dx * z - dy * w - dz * x)
    ez = e * (dw * z - dx * y + dy * x - dz * w)
    jxx, jxy, jxz, jyx, jyy, jyz, jzx, jzy, jzz = inertia
    hx, hy, hz = (
        jxx * p + jxy * q + jxz * r,
        jyx * p + jyy * q + jyz * r,
        jzx * p + jzy * q + jzz * r,
    )
    k1, k2, k3, k4, k5, k6 = gains
    return (
        ux * c1 + uy * c2 + uz * c3,
        q * hz - r * hy - k1 * ex - k4 * p,
        r * hx - p * hz - k2 * ey - k5 * q,
        p * hy - q * hx - k3 * ez - k6 * r,
    )


class AttitudeController(LeafSystem):
    """Attitude controller: thrust axes follow the commanded thrust vectors, with yaw zero.

    The law is M = -K_rot e_R - K_ang W + W x J W with e_R = vee(R_d^T R - R^T R_d) / 2. The thrust
    is the component of the command along the quadrotor's z. No rate is fed forward. The system has
    no state.

    | port | size | meaning | unit | frame |
    |---|---|---|---|---|
    | in `quadrotor_states` | 13 n | w x y z, p, angular, linear velocity | m, rad/s, m/s | world |
    | in `thrust_vectors` | 3 n | commanded thrusts | N | world |
    | out `propeller_commands` | 4 n | squared speeds, within their limits | rpm^2 | - |
    | out `saturated` | n | 1: a propeller's limit changed the wrench, else 0 | - | - |
    | out `thrusts` | n | thrusts of the commanded speeds | N | z of Q |
    | out `moments` | 3 n | moments of the commanded speeds | N m | Q |

    Parameters
    ----------
    propellers : sequence of n Allocation
        Propellers of each quadrotor.
    inertia : (3, 3) or (n, 3, 3) array
        Inertia about each quadrotor's CoM in Q [kg m^2].
    rotation_gain, rate_gain : (3,) arrays
        Gains on attitude error [N m] and angular velocity [N m s].

    Raises
    ------
    InputError
        If there are no propellers, or the inertia has another shape.

    Examples
    --------
    >>> from drake_aerial import AttitudeController, QuadrotorParameters
    >>> attitude = AttitudeController.of_quadrotors([QuadrotorParameters()] * 2)
    >>> attitude.GetInputPort("thrust_vectors").size()
    6
    """

    @classmethod
    def of_quadrotors(cls, quadrotors: Sequence[QuadrotorParameters]) -> Self:
        """Return the controller of n quadrotors, with the default gains."""
        propellers = [Allocation.of_quadrotor(quadrotor) for quadrotor in quadrotors]
        return cls(propellers, np.array([np.diag(quadrotor.inertia) for quadrotor in quadrotors]))

    def __init__(
        self,
        propellers: Sequence[Allocation],
        inertia: ArrayLike,
        rotation_gain: ArrayLike = ROTATION_GAIN,
        rate_gain: ArrayLike = RATE_GAIN,
    ):
        super().__init__()
        n = len(propellers)
        J = np.asarray(inertia, float)
        if n == 0 or J.shape not in ((3, 3), (n, 3, 3)):
            raise InputError(
                f"`inertia` must be (3, 3) or (n, 3, 3) for n >= 1 quadrotors, got {J.shape} "
                f"for {n}"
            )
        self._propellers = tuple(propellers)
        self._inertia = np.broadcast_to(J, (n, 3, 3)).reshape(n, 9).tolist()
        self._gains = (
            *np.asarray(rotation_gain, float).tolist(),
            *np.asarray(rate_gain, float).tolist(),
        )
        self._states = self.DeclareVectorInputPort("quadrotor_states", 13 * n)
        self._thrusts = self.DeclareVectorInputPort("thrust_vectors", 3 * n)
        # Commands are held for several plant steps; their attitudes are computed once.
        producer = ValueProducer(allocate=lambda: Value[object](), calc=self._calc_targets)
        self._targets = self.DeclareCacheEntry("targets", producer, {self._thrusts.ticket()})
        sources = {self._states.ticket(), self._thrusts.ticket()}
        self.DeclareVectorOutputPort("propeller_commands", 4 * n, self._calc_commands, sources)
        self.DeclareVectorOutputPort("saturated", n, self._calc_saturated, sources)
        self.DeclareVectorOutputPort("thrusts", n, self._calc_thrusts, sources)
        self.DeclareVectorOutputPort("moments", 3 * n, self._calc_moments, sources)

    def _calc_targets(self, context: Context, value: AbstractValue) -> None:
        u = self._thrusts.Eval(context).tolist()
        value.set_value([attitude_target(u[k : k + 3]) for k in range(0, len(u), 3)])

    def _commands(self, context: Context) -> list[tuple[list[float], bool]]:
        """Return squared speeds (4) [rpm^2] of each quadrotor, and whether they saturate."""
        targets, states, gains = (
            self._targets.Eval(context),
            self._states.Eval(context).tolist(),
            self._gains,
        )
        commands = []
        k = 0
        for target, inertia, propellers in zip(targets, self._inertia, self._propellers):
            thrust, mx, my, mz = attitude_law(states[k : k + 13], target, inertia, gains)
            commands.append(allocate(propellers, thrust, mx, my, mz))
            k += 13
        return commands

    def _calc_commands(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.array([squared for squared, _ in self._commands(context)]).ravel())

    def _calc_saturated(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([float(saturated) for _, saturated in self._commands(context)])

    def _calc_thrusts(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._wrenches(context)[:, 0])

    def _calc_moments(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._wrenches(context)[:, 1:].ravel())

    def _wrenches(self, context: Context) -> Array:
        return np.array(
            [
                p.wrench(squared)
                for p, (squared, _) in zip(self._propellers, self._commands(context))
            ]
        )
