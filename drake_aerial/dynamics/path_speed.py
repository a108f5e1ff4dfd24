"""Fastest motion along a path by the limits of acceleration that the thrusts give."""

import logging

import numpy as np

from drake_aerial.dynamics.path_limits import CarriedPayload, PathLimits
from drake_aerial.geometry import Array
from drake_aerial.references.retimed import Move
from drake_aerial.statics.gravity import GRAVITY

_SAMPLES = 400
"""Points of a path at which its arc length is computed."""
_DIRECTIONS = 80
"""Tangent planes of the ball of thrusts."""
_AZIMUTHS = 16
"""Tangent planes of the cone of tilts."""


def fastest_progress(
    move: Move, carried: CarriedPayload, limits: PathLimits, yaw: float, share: float = 1.0
) -> tuple[Array, Array]:
    """Return times (K,) [s] and progress (K,) of the fastest motion along a move.

    The acceleration of the payload may jump, and the inertia of its swing and of the cables is left
    out: the quadrotors bear the force M (a + g) by the shares that they have of a level payload.
    TOPP-RA (Pham and Pham, 2018) finds the motion, with balls and cones of thrusts as polytopes.

    Parameters
    ----------
    move : Move
    carried : CarriedPayload
    limits : PathLimits
    yaw : float
        Yaw of the payload [rad].
    share : float
        Part of the free thrust beyond hover that may be used, in (0, 1].

    Raises
    ------
    RuntimeError
        If there is none, for instance because the team cannot hold the payload.
    """
    import toppra
    import toppra.algorithm as algorithm
    import toppra.constraint as constraint

    logging.getLogger("toppra").setLevel(logging.ERROR)
    # Dense where a path starts slowly in its own time.
    progress = move.range * 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, _SAMPLES)))
    points = move.along(progress)[0]
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    moved = np.concatenate([[True], np.diff(arc) > 1e-9 * arc[-1]])
    arc, points, progress = arc[moved], points[moved], progress[moved]
    length = float(arc[-1])
    grid = np.linspace(0.0, length, min(_SAMPLES, max(60, int(40 * length))))
    curve = toppra.SplineInterpolator(arc, points)
    C, d = _half_spaces(carried, limits, yaw, share)
    gravity = np.array([0.0, 0.0, GRAVITY])
    allowed = constraint.SecondOrderConstraint(
        lambda q, qd, qdd: qdd + gravity, lambda q: C, lambda q: d, dof=3
    )
    solver = algorithm.TOPPRA([allowed], curve, gridpoints=grid, solver_wrapper="seidel")
    _, speed, _ = solver.compute_parameterization(0.0, 0.0)
    if speed is None or not np.isfinite(speed).all():
        raise RuntimeError("no motion along the path keeps the limits")
    # Between grid points the acceleration is constant.
    steps = 2.0 * np.diff(grid) / np.maximum(speed[1:] + speed[:-1], 1e-9)
    times = np.concatenate([[0.0], np.cumsum(steps)])
    return times, np.interp(grid, arc, progress)


def _half_spaces(
    carried: CarriedPayload, limits: PathLimits, yaw: float, share: float
) -> tuple[Array, Array]:
    """Return C (k, 3) and d (k,) of C (a + g) <= d."""
    model, n = carried.model, carried.model.n
    c, s = np.cos(yaw), np.sin(yaw)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    G = model.grasp_inverse[:, 0:3].reshape(n, 3, 3)
    pull = model.mass * (R @ G @ R.T)
    thrust = pull + model.quadrotor_mass[:, None, None] * np.eye(3)
    ball, rows, bounds = _sphere(_DIRECTIONS), [], []
    azimuth = np.linspace(0.0, 2.0 * np.pi, _AZIMUTHS, endpoint=False)
    cone = np.stack(
        [np.cos(azimuth), np.sin(azimuth), np.full(_AZIMUTHS, -np.tan(limits.tilt))], axis=1
    )
    up = np.array([0.0, 0.0, 1.0])
    for i in range(n):
        hover = float(np.linalg.norm(thrust[i] @ up) * GRAVITY)
        used = share * (1.0 - limits.thrust_margin)
        most = hover + used * (model.max_thrust[i] - hover)
        least = hover - used * (hover - model.min_thrust[i])
        rest = pull[i] @ up
        load = float(rest[2] * GRAVITY)
        rows += [ball @ thrust[i], cone @ thrust[i], -(up @ thrust[i])[None], -(up @ pull[i])[None]]
        bounds += [np.full(len(ball), most), np.zeros(_AZIMUTHS)]
        bounds += [np.array([-least]), np.array([-limits.tension * load])]
        cosine = float(carried.normal_L[i] @ R.T @ rest / np.linalg.norm(rest))
        held = carried.holding_force[i] / max(cosine, 0.1)
        if np.isfinite(held):
            # The normal leans to the load as that of a payload at rest.
            rows.append(ball @ pull[i])
            bounds.append(np.full(len(ball), held - limits.gripper_margin * (held - load)))
    return np.concatenate(rows), np.concatenate(bounds)


def _sphere(count: int) -> Array:
    """Return unit vectors (count, 3) spread evenly over the sphere by the golden angle."""
    k = np.arange(count) + 0.5
    z, azimuth = 1.0 - 2.0 * k / count, np.pi * (1.0 + np.sqrt(5.0)) * k
    r = np.sqrt(1.0 - z**2)
    return np.stack([r * np.cos(azimuth), r * np.sin(azimuth), z], axis=1)
