"""Timing law of least duration, by nonlinear programming on its control points."""

import numpy as np
from scipy.optimize import minimize

from drake_aerial.dynamics.path_check import BEFORE, table_of, winds_of
from drake_aerial.dynamics.path_demands import force_quantities
from drake_aerial.dynamics.path_limits import CarriedPayload, PathLimits
from drake_aerial.geometry import Array
from drake_aerial.references.retimed import Move, MoveTrajectory
from drake_aerial.references.spline_law import SplineLaw

_POINTS = 12
"""Control points of the law."""
_SAMPLES = 60
"""Times at which the limits are kept; between them they may be exceeded a little."""
_ITERATIONS = 40


def faster_law(
    law: SplineLaw, move: Move, carried: CarriedPayload, limits: PathLimits, yaw: float
) -> SplineLaw:
    """Return a law that is faster than a given one, or as fast.

    Sequential quadratic programming (SLSQP) on duration and increments of the control points. The
    limits of thrust, tilt, tension and gripper are constraints at 60 times; the caller scales the
    law so that they are kept in between.

    Parameters
    ----------
    law : SplineLaw
        Where the search begins.
    move : Move
    carried : CarriedPayload
    limits : PathLimits
    yaw : float
        Yaw of the payload [rad].
    """
    start = _with_points(law, _POINTS)
    span = move.range
    x0 = np.concatenate([[np.log(start.spacing)], np.diff(start.points) / span])

    def law_of(x: Array) -> SplineLaw:
        steps = np.maximum(x[1:], 0.0)
        total = max(float(steps.sum()), 1e-9)
        points = np.concatenate([[0.0], np.cumsum(steps) * (span / total)])
        points[-1] = span
        return SplineLaw(float(np.exp(x[0])), tuple(np.maximum.accumulate(points).tolist()))

    def margins(x: Array) -> Array:
        at = law_of(x)
        t = np.linspace(0.0, at.duration, _SAMPLES)
        path = MoveTrajectory.of(move, at, yaw)
        found = []
        for wind in winds_of(carried):
            table = table_of(carried, path, wind)
            quantities = force_quantities(carried, limits, table.at(t), table.at(BEFORE))
            found += [quantity.margins.ravel() for quantity in quantities]
        return np.concatenate(found)

    bounds = [(x0[0] - 1.5, x0[0] + 0.5)] + [(0.0, 1.0)] * (_POINTS - 1)
    result = minimize(
        lambda x: x[0],
        x0,
        method="SLSQP",
        bounds=bounds,
        constraints=[
            {"type": "ineq", "fun": margins},
            {"type": "eq", "fun": lambda x: x[1:].sum() - 1.0},
        ],
        options={"maxiter": _ITERATIONS, "ftol": 1e-4, "eps": 1e-4},
    )
    return law_of(result.x) if np.isfinite(result.x).all() else law


def _with_points(law: SplineLaw, count: int) -> SplineLaw:
    """Return a law with another number of control points that is close to a given one."""
    spacing = law.duration / (count + 3)
    # The control points of a smooth law lie near its values; the first one is 2 spacings in.
    t: Array = np.arange(2.0, count + 2.0) * spacing
    points = law.derivatives(t)[0]
    points[0], points[-1] = law.points[0], law.points[-1]
    return SplineLaw(spacing, tuple(np.maximum.accumulate(points).tolist()))
