"""Trajectories by name or from a YAML file."""

import os
from dataclasses import fields
from pathlib import Path
from typing import Any

from drake_aerial.errors import InputError
from drake_aerial.io.strict_yaml import check_keys, nearest, read_mapping
from drake_aerial.references.retimed import RetimedTrajectory
from drake_aerial.references.spline_law import SplineLaw
from drake_aerial.references.trajectory import (
    HoverTrajectory,
    LineTrajectory,
    Trajectory,
    TransportTrajectory,
    WaypointTrajectory,
)

TRAJECTORIES: dict[str, type[Trajectory]] = {
    kind.name: kind
    for kind in (TransportTrajectory, HoverTrajectory, LineTrajectory, WaypointTrajectory)
}
OLD_NAMES = {"circle": "transport"}
"""Names of earlier versions, still accepted from the command line, in Python and in study plans."""


def read_trajectory(name_or_file: str | Path | Trajectory) -> Trajectory:
    """Return the trajectory of a NAME or a YAML FILE.

    A file is a mapping with the key `kind` (transport, hover, line, waypoints) and any parameters
    of that kind, in metres, seconds and radians, for instance `{kind: transport, radius: 0.5}`.

    Raises
    ------
    InputError
        If the name is unknown, or the file cannot be read, has an unknown key (the message suggests
        the nearest one) or a bad value.
    """
    if isinstance(name_or_file, Trajectory):
        return name_or_file
    name = OLD_NAMES.get(str(name_or_file), str(name_or_file))
    if name in TRAJECTORIES:
        return TRAJECTORIES[name]()
    path = Path(name_or_file)
    if not os.path.isfile(path):
        raise InputError(
            f"`trajectory` must be a YAML file or one of {', '.join(TRAJECTORIES)}, got "
            f"{str(name_or_file)!r}"
        )
    content = read_mapping(path)
    try:
        return trajectory_from_dict(content)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def trajectory_from_dict(content: Any) -> Trajectory:
    """Return the trajectory of a mapping with a `kind` and parameters of that kind.

    Raises
    ------
    InputError
        If the kind or a parameter is unknown, or a value is bad.
    """
    if not isinstance(content, dict):
        raise InputError(
            f"a trajectory must be a mapping with the key `kind`, got {type(content).__name__}"
        )
    parameters = dict(content)
    kind = parameters.pop("kind", None)
    if kind == RetimedTrajectory.name:
        check_keys(parameters, required=["base", "laws"], optional=["start", "yaw"])
        parameters["base"] = trajectory_from_dict(parameters["base"])
        return RetimedTrajectory(**parameters)
    if not isinstance(kind, str) or kind not in TRAJECTORIES:
        given = "no kind" if kind is None else f"{kind!r}{nearest(kind, TRAJECTORIES)}"
        raise InputError(f"`kind` must be one of {', '.join(TRAJECTORIES)}, got {given}")
    # No records: trajectories check their own values, and users derive classes from them.
    check_keys(parameters, optional=[f.name for f in fields(TRAJECTORIES[kind])])
    return TRAJECTORIES[kind](**parameters)


def trajectory_to_dict(trajectory: Trajectory) -> dict[str, Any]:
    """Return a trajectory as a mapping for `trajectory_from_dict`, with tuples as lists."""

    def plain(value: Any) -> Any:
        if isinstance(value, Trajectory):
            return trajectory_to_dict(value)
        if isinstance(value, SplineLaw):
            return {"spacing": value.spacing, "points": list(value.points)}
        return [plain(v) for v in value] if isinstance(value, tuple) else value

    return {
        "kind": trajectory.name,
        **{f.name: plain(getattr(trajectory, f.name)) for f in fields(trajectory)},
    }
