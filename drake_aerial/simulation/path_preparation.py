"""Path of a flight: checked before take-off, and retimed if that was asked for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drake_aerial.choices import Retiming
from drake_aerial.dynamics.path_check import PathCheck, check_path
from drake_aerial.dynamics.path_limits import CarriedPayload, PathLimits
from drake_aerial.dynamics.retiming import retime, slowing_factor
from drake_aerial.errors import JobError
from drake_aerial.io.records import Vector
from drake_aerial.plant.team_lift import own_masses
from drake_aerial.plant.wind import WindParameters
from drake_aerial.references.retimed import Move, parts_of
from drake_aerial.references.trajectory import Trajectory
from drake_aerial.simulation.beliefs import believed_model
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.simulation.suspended_payload import SuspendedPayload

_GUARD = 1.2
"""Radius of a quadrotor's rotor guard over its arm, as in `plant.quadrotor`."""


@dataclass(frozen=True)
class PreparedPath:
    """The trajectory that is flown, its check and notes.

    Attributes
    ----------
    trajectory : Trajectory
    record : dict or None
        Entry `path_check` of a flight's configuration; None if the path was not checked.
    notes : tuple of str
        What was changed, what is flown although it is impossible, and warnings.
    """

    trajectory: Trajectory
    record: dict[str, Any] | None
    notes: tuple[str, ...] = ()


def carried_payload(
    suspended_payload: SuspendedPayload, parameters: StationParameters
) -> CarriedPayload:
    """Return a payload and its team as the plant has them, for `check_path` and `retime`.

    Parameters
    ----------
    suspended_payload : SuspendedPayload
    parameters : StationParameters

    Examples
    --------
    >>> from drake_aerial import Payload, StationParameters, SuspendedPayload, carried_payload
    >>> from drake_aerial import check_path
    >>> from drake_aerial.references.trajectory import TransportTrajectory
    >>> box = Payload.from_box([0.4, 0.4, 0.2], 0.25)
    >>> box = SuspendedPayload.from_contacts(box, [[0.0, 0.0, 0.1]], [[0.0, 0.0, 1.0]])
    >>> carried = carried_payload(box, StationParameters())
    >>> check_path(TransportTrajectory(circle_time=4.0), carried).feasible
    False
    """
    payload, p_LC = suspended_payload.payload, suspended_payload.p_LC
    n = len(p_LC)
    quadrotors, cables = parameters.quadrotors(n), parameters.cables(n)
    model = believed_model(
        "true",
        payload,
        p_LC,
        quadrotors=quadrotors,
        cable=cables,
        gripper=parameters.gripper,
        air=parameters.air,
    )
    # Flatness counts a cable's link as part of its quadrotor.
    model = replace(model, quadrotor_mass=own_masses(quadrotors, cables))
    # Contacts lie inside the hull of a scan, so its surface tells nothing about cables.
    known = not payload.is_hull
    return CarriedPayload(
        model,
        suspended_payload.normal_L,
        np.array([gripper.holding_force for gripper in parameters.grippers(n)]),
        np.array([_GUARD * quadrotor.arm for quadrotor in quadrotors]),
        payload.vertices if known else np.zeros((0, 3)),
        payload.faces if known else np.zeros((0, 3), dtype=int),
        winds_of(parameters.wind),
    )


def winds_of(wind: WindParameters | None) -> tuple[Vector, ...]:
    """Return the velocities of the air for which a path is checked [m/s].

    They are the mean wind and the peak of the gust, each with two standard deviations of the
    turbulence along the mean wind.
    """
    if wind is None:
        return ((0.0, 0.0, 0.0),)
    mean, gust = np.array(wind.mean), np.array(wind.gust)
    speed = float(np.linalg.norm(mean))
    along = mean / speed if speed > 0.0 else np.array([1.0, 0.0, 0.0])
    more = np.zeros(3) if wind.turbulence is None else 2.0 * wind.turbulence.intensity[0] * along
    found = dict.fromkeys(tuple((mean + part + more).tolist()) for part in (0.0 * gust, gust))
    return tuple((x, y, z) for x, y, z in found)


def prepare_path(
    trajectory: Trajectory,
    carried: CarriedPayload,
    limits: PathLimits | None,
    *,
    retiming: Retiming | None = None,
    force: bool = False,
) -> PreparedPath:
    """Return the path that is flown, checked and retimed.

    Parameters
    ----------
    trajectory : Trajectory
    carried : CarriedPayload
    limits : PathLimits or None
        None to check nothing.
    retiming : str, optional
        slower or fastest, as in `retime`.
    force : bool
        Whether to accept an impossible path.

    Raises
    ------
    JobError
        If the path is impossible, with the limit, what the path needs, and the factor by which it
        must be slowed.
    """
    if limits is None:
        return PreparedPath(trajectory, None)
    flown: Trajectory = trajectory
    retimed: dict[str, Any] | None = None
    if retiming is not None:
        flown = retime(trajectory, carried, limits, mode=retiming)
        retimed = {"mode": retiming, "moves": _durations(trajectory, flown)}
    check = check_path(flown, carried, limits)
    if not (check.feasible or force):
        raise JobError(_refusal(check, trajectory, carried, limits))
    notes = [f"flown by force, although {violation}" for violation in check.violations]
    notes += [f"{warning}; that contact is not simulated" for warning in check.warnings]
    if retimed is not None:
        notes += [
            f"retimed ({retiming}): {move['phase']} takes {move['flown_s']:.2f} s instead of "
            f"{move['asked_s']:.2f} s"
            for move in retimed["moves"]
            if move["flown_s"] != move["asked_s"]
        ]
    return PreparedPath(flown, {**check.to_dict(), "retimed": retimed}, tuple(notes))


def _durations(before: Trajectory, after: Trajectory) -> list[dict[str, Any]]:
    """Return phase and duration of every move before and after retiming [s]."""
    moves = ([p for p in parts_of(path) if isinstance(p, Move)] for path in (before, after))
    return [
        {"phase": a.name, "asked_s": round(a.duration, 3), "flown_s": round(b.duration, 3)}
        for a, b in zip(*moves)
    ]


def _refusal(
    check: PathCheck, trajectory: Trajectory, carried: CarriedPayload, limits: PathLimits
) -> str:
    """Return why a path is refused, and what to do."""
    first = check.violations[0]
    factor = slowing_factor(trajectory, carried, limits)
    steps = first.what in ("position step", "velocity step")
    if steps:
        todo = "choose the timing smooth or quintic"
    elif np.isfinite(factor) and factor > 1.0:
        slower = np.ceil(100.0 * factor) / 100.0
        todo = f"slow it by a factor of {slower:.2f} or use --retime (retime='slower')"
    else:
        todo = "it is impossible at any speed: choose other contacts, another team or less wind"
    return f"{first}; {todo}, or fly it anyway with --force (force=True)"
