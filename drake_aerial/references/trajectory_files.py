"""Trajectories by name or from a YAML file."""

from __future__ import annotations

import os
from dataclasses import fields
from pathlib import Path
from typing import Any

from drake_aerial.errors import InputError
from drake_aerial.io.strict_yaml import nearest, read_mapping
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
    """Return the trajectory that a NAME or a YAML FILE stands for.

    A file is a mapping with the key `kind` (transport, hover, line, waypoints) and any of that kind's own
    parameters, in metres, seconds and radians, for instance `{kind: transport, radius: 0.5}`.

    Raises
    ------
    InputError
        For an unknown name, an unreadable file, an unknown key (the nearest one is suggested), a bad value.
    """
    if isinstance(name_or_file, Trajectory):
        return name_or_file
    name = OLD_NAMES.get(str(name_or_file), str(name_or_file))
    if name in TRAJECTORIES:
        return TRAJECTORIES[name]()
    path = Path(name_or_file)
    if not os.path.isfile(path):
        raise InputError(
            f"no trajectory {str(name_or_file)!r}: give a YAML file or one of {', '.join(TRAJECTORIES)}"
        )
    content = read_mapping(path)
    try:
        return trajectory_from_dict(content)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def trajectory_from_dict(content: Any) -> Trajectory:
    """Return the trajectory of a mapping with a `kind` and that kind's parameters; raises InputError."""
    if not isinstance(content, dict):
        raise InputError(
            f"a trajectory is a mapping with the key 'kind' but got {type(content).__name__}"
        )
    parameters = dict(content)
    kind = parameters.pop("kind", None)
    if not isinstance(kind, str) or kind not in TRAJECTORIES:
        given = "no kind" if kind is None else f"kind {kind!r}"
        raise InputError(
            f"{given}{nearest(kind, TRAJECTORIES)}: give one of {', '.join(TRAJECTORIES)}"
        )
    known = [f.name for f in fields(TRAJECTORIES[kind])]
    for key in parameters:
        if key not in known:
            raise InputError(
                f"unknown key {key!r}{nearest(key, known)}: a {kind} trajectory has {', '.join(known)}"
            )
    return TRAJECTORIES[kind](**parameters)


def trajectory_to_dict(trajectory: Trajectory) -> dict[str, Any]:
    """Return the mapping from which `trajectory_from_dict` makes an equal trajectory (tuples as lists)."""

    def plain(value: Any) -> Any:
        return [plain(v) for v in value] if isinstance(value, tuple) else value

    return {
        "kind": trajectory.name,
        **{f.name: plain(getattr(trajectory, f.name)) for f in fields(trajectory)},
    }
