"""Allocation of thrust and moments to four propeller speeds within their limits."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.plant.quadrotor import QuadrotorParameters

Four = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class Allocation:
    """Four propellers with thrust along +z of the quadrotor's frame Q.

    Parameters
    ----------
    p_QR : (4, 3) array
        Propeller positions in Q [m]; Q's origin is the quadrotor's CoM.
    thrust_ratio : float
        Thrust per squared speed [N/rpm^2].
    moment_ratio : (4,) array
        Moment about z per squared speed [N m/rpm^2], signed by the sense of rotation.
    min_rpm, max_rpm : float
        Speed limits of every propeller [rpm].

    Raises
    ------
    InputError
        If a shape or a limit is wrong, or the propellers cannot apply all moments.
    """

    p_QR: Any
    thrust_ratio: float
    moment_ratio: Any
    min_rpm: float
    max_rpm: float

    def __post_init__(self) -> None:
        p, k = np.asarray(self.p_QR, float), np.asarray(self.moment_ratio, float)
        if p.shape != (4, 3) or k.shape != (4,):
            raise InputError(
                "`p_QR` and `moment_ratio` must be of shapes (4, 3) and (4,), got "
                f"{p.shape} and {k.shape}"
            )
        if not 0.0 <= self.min_rpm < self.max_rpm:
            raise InputError(
                f"`min_rpm` must be in [0, max_rpm) = [0, {self.max_rpm}) rpm, got {self.min_rpm}"
            )
        if not self.thrust_ratio > 0.0:
            raise InputError(f"`thrust_ratio` must be positive, got {self.thrust_ratio}")
        kf = self.thrust_ratio
        G = np.array([np.full(4, kf), kf * p[:, 1], -kf * p[:, 0], k])
        if abs(np.linalg.det(G / np.linalg.norm(G, axis=1, keepdims=True))) < 1e-6:
            raise InputError(
                "the propellers must apply thrust and three moments independently, got linearly "
                "dependent positions and moment ratios"
            )
        object.__setattr__(self, "p_QR", p)
        object.__setattr__(self, "moment_ratio", k)
        object.__setattr__(self, "matrix", G)
        columns = np.linalg.inv(G).T.tolist()
        object.__setattr__(self, "_columns", tuple(map(tuple, columns)))
        object.__setattr__(self, "_limits", (float(self.min_rpm) ** 2, float(self.max_rpm) ** 2))
        object.__setattr__(self, "_rows", tuple(np.transpose(columns).ravel().tolist()))

    @classmethod
    def of_quadrotor(cls, quadrotor: QuadrotorParameters) -> Self:
        """Return the allocation of a quadrotor's propellers."""
        return cls(
            quadrotor.propeller_positions,
            quadrotor.thrust_coefficient,
            quadrotor.thrust_coefficient * quadrotor.drag_ratio * quadrotor.propeller_spins,
            quadrotor.min_rpm,
            quadrotor.max_rpm,
        )

    matrix = np.zeros((4, 4))
    """Matrix G (4, 4) from squared speeds to thrust [N] and moments about Q's x, y, z [N m]."""
    _columns: tuple[Four, Four, Four, Four] = ((0.0,) * 4,) * 4
    _rows: tuple[float, ...] = (0.0,) * 16
    _limits: tuple[float, float] = (0.0, 0.0)

    @property
    def min_thrust(self) -> float:
        """Thrust with all propellers at minimum speed [N]."""
        return 4.0 * self.thrust_ratio * self.min_rpm**2

    @property
    def max_thrust(self) -> float:
        """Thrust with all propellers at maximum speed [N]."""
        return 4.0 * self.thrust_ratio * self.max_rpm**2

    def wrench(self, squared_rpm: ArrayLike) -> Array:
        """Return thrust [N] and moments [N m] (..., 4) of squared speeds (..., 4) [rpm^2]."""
        return np.asarray(squared_rpm, float) @ self.matrix.T


def allocate(
    propellers: Allocation, thrust: float, mx: float, my: float, mz: float
) -> tuple[list[float], bool]:
    """Return squared speeds [rpm^2] for a thrust [N] and moments [N m], and whether they saturate.

    Within the limits the wrench is exact. Otherwise yaw is reduced first, then thrust is shifted as
    far as roll and pitch need, and last roll and pitch are scaled down together, because they keep
    the vehicle upright. All returned squared speeds are within the limits.
    """
    low, high = propellers._limits
    # Written out, since it runs at every plant step and nearly always returns here.
    f1, x1, y1, z1, f2, x2, y2, z2, f3, x3, y3, z3, f4, x4, y4, z4 = propellers._rows
    a = thrust * f1 + mx * x1 + my * y1 + mz * z1
    b = thrust * f2 + mx * x2 + my * y2 + mz * z2
    c = thrust * f3 + mx * x3 + my * y3 + mz * z3
    d = thrust * f4 + mx * x4 + my * y4 + mz * z4
    if low <= a <= high and low <= b <= high and low <= c <= high and low <= d <= high:
        return [a, b, c, d], False
    cf, cx, cy, cz = propellers._columns
    tilt = [mx * cx[i] + my * cy[i] for i in range(4)]
    yaw = [mz * c for c in cz]
    plain = [thrust * cf[i] + tilt[i] for i in range(4)]
    if min(plain) >= low and max(plain) <= high:
        keep = 1.0
        for base, extra in zip(plain, yaw):
            if extra > 0.0:
                keep = min(keep, (high - base) / extra)
            elif extra < 0.0:
                keep = min(keep, (low - base) / extra)
        return [min(max(plain[i] + keep * yaw[i], low), high) for i in range(4)], True
    # The propeller with the smallest margin decides.
    spread = max(tilt) - min(tilt)
    scale = min(1.0, (high - low) / spread) if spread > 0.0 else 1.0
    tilt = [scale * x for x in tilt]
    least = max((low - x) / c for x, c in zip(tilt, cf))
    most = min((high - x) / c for x, c in zip(tilt, cf))
    thrust = min(max(thrust, least), most)
    return [min(max(thrust * cf[i] + tilt[i], low), high) for i in range(4)], True
