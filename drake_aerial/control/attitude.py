"""The quadrotors' attitude loop: from thrust vectors to propeller commands, for all quadrotors at once."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_aerial.control.allocation import Allocation, allocate
from drake_aerial.errors import InputError

Array = NDArray[np.float64]

ROTATION_GAIN = (0.25, 0.25, 0.08)
"""Moment per attitude error about x, y, z [N m]; the paper's table, row "rot" of the controller."""
RATE_GAIN = (0.025, 0.025, 0.005)
"""Moment per angular velocity about x, y, z [N m s]; the paper's table, row "ang" of the controller."""

_MIN_SLOPE = 0.2
"""The least vertical share of a thrust vector, per horizontal newton: no command turns a quadrotor over."""


class AttitudeCommand(NamedTuple):
    """What one quadrotor does for one thrust vector."""

    squared_rpm: list[float]
    saturated: bool
    thrust: float
    moment: tuple[float, float, float]


def attitude_command(
    state: list[float],
    thrust_vector: list[float],
    inertia: list[list[float]],
    gains: tuple[float, ...],
    propellers: Allocation,
) -> AttitudeCommand:
    """Return the command of one quadrotor.

    Parameters
    ----------
    state : 13 floats
        Quaternion w, x, y, z, position, angular velocity, linear velocity in the world.
    thrust_vector : 3 floats
        Commanded thrust in the world [N].
    inertia : 3 rows of 3 floats
        In Q [kg m^2].
    gains : 6 floats
        Gains on attitude error and on angular velocity about x, y, z.
    propellers : Allocation
        Limits and geometry.
    """
    qw, qx, qy, qz = state[0:4]
    wx, wy, wz = state[7:10]
    ux, uy, uz = thrust_vector
    # R_WQ, column by column.
    xx, xy, xz = 1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy + qw * qz), 2 * (qx * qz - qw * qy)
    yx, yy, yz = 2 * (qx * qy - qw * qz), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz + qw * qx)
    zx, zy, zz = 2 * (qx * qz + qw * qy), 2 * (qy * qz - qw * qx), 1 - 2 * (qx * qx + qy * qy)
    thrust = ux * zx + uy * zy + uz * zz
    # Desired frame: z along the command, y normal to the plane of z and the world's x.
    horizontal = sqrt(ux * ux + uy * uy)
    uz = max(uz, _MIN_SLOPE * horizontal, 1e-6)
    size = sqrt(horizontal * horizontal + uz * uz)
    cx, cy, cz = ux / size, uy / size, uz / size
    side = sqrt(cz * cz + cy * cy)
    by, bz = cz / side, -cy / side
    ax, ay, az = by * cz - bz * cy, bz * cx, -by * cx
    # e_R = vee(R_d^T R - R^T R_d) / 2, entry by entry.
    ex = 0.5 * ((cx * yx + cy * yy + cz * yz) - (by * zy + bz * zz))
    ey = 0.5 * ((ax * zx + ay * zy + az * zz) - (cx * xx + cy * xy + cz * xz))
    ez = 0.5 * ((by * xy + bz * xz) - (ax * yx + ay * yy + az * yz))
    p = xx * wx + xy * wy + xz * wz
    q = yx * wx + yy * wy + yz * wz
    r = zx * wx + zy * wy + zz * wz
    (jxx, jxy, jxz), (jyx, jyy, jyz), (jzx, jzy, jzz) = inertia
    hx, hy, hz = jxx * p + jxy * q + jxz * r, jyx * p + jyy * q + jyz * r, jzx * p + jzy * q + jzz * r
    mx = -gains[0] * ex - gains[3] * p + q * hz - r * hy
    my = -gains[1] * ey - gains[4] * q + r * hx - p * hz
    mz = -gains[2] * ez - gains[5] * r + p * hy - q * hx
    squared, saturated = allocate(propellers, thrust, mx, my, mz)
    return AttitudeCommand(squared, saturated, thrust, (mx, my, mz))


class AttitudeController(LeafSystem):
    """Turns each quadrotor so that it pushes along its commanded thrust vector, yaw zero.

    The law is M = -K_rot e_R - K_ang W + W x J W with e_R = vee(R_d^T R - R^T R_d) / 2; the thrust is the command's
    component along the quadrotor's own z. No rate is fed forward. Stateless: its rate is that of whoever reads it.

    | port | size | meaning |
    |---|---|---|
    | in `quadrotor_states` | 13 n | quaternion, position, angular and linear velocity of each Q in the world |
    | in `thrust_vectors` | 3 n | commanded thrust of each quadrotor in the world [N] |
    | out `propeller_commands` | 4 n | squared speeds, each within its limits [rpm^2] |
    | out `saturated` | n | 1 where a propeller's limit changed the wrench, else 0 |
    | out `thrusts` | n | thrust that the propellers are commanded to make [N] |
    | out `moments` | 3 n | moments that they are commanded to make, in Q [N m] |

    Parameters
    ----------
    propellers : sequence of n Allocation
        The propellers of each quadrotor.
    inertia : (3, 3) or (n, 3, 3) array
        Inertia about each quadrotor's CoM in Q [kg m^2].
    rotation_gain, rate_gain : (3,) arrays
        Gains on attitude error [N m] and angular velocity [N m s].
    """

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
            raise InputError(f"inertia must be (3, 3) or ({n}, 3, 3) for n >= 1 quadrotors but got {J.shape}")
        self._propellers = tuple(propellers)
        self._inertia = np.broadcast_to(J, (n, 3, 3)).tolist()
        self._gains = (*np.asarray(rotation_gain, float).tolist(), *np.asarray(rate_gain, float).tolist())
        self._states = self.DeclareVectorInputPort("quadrotor_states", 13 * n)
        self._thrusts = self.DeclareVectorInputPort("thrust_vectors", 3 * n)
        self.DeclareVectorOutputPort("propeller_commands", 4 * n, self._calc_commands)
        self.DeclareVectorOutputPort("saturated", n, self._calc_saturated)
        self.DeclareVectorOutputPort("thrusts", n, self._calc_thrusts)
        self.DeclareVectorOutputPort("moments", 3 * n, self._calc_moments)

    def _commands(self, context: Context) -> list[AttitudeCommand]:
        # Plain floats: for one to six quadrotors they are several times faster than arrays of three.
        x = self._states.Eval(context).tolist()
        u = self._thrusts.Eval(context).tolist()
        return [
            attitude_command(x[13 * i : 13 * i + 13], u[3 * i : 3 * i + 3], self._inertia[i], self._gains, propellers)
            for i, propellers in enumerate(self._propellers)
        ]

    def _calc_commands(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([s for command in self._commands(context) for s in command.squared_rpm])

    def _calc_saturated(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([float(command.saturated) for command in self._commands(context)])

    def _calc_thrusts(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._wrenches(context)[:, 0])

    def _calc_moments(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._wrenches(context)[:, 1:].ravel())

    def _wrenches(self, context: Context) -> Array:
        commands = self._commands(context)
        return np.array([p.wrench(c.squared_rpm) for p, c in zip(self._propellers, commands)])
