"""Configuration files of components: reading, writing and default values."""

from __future__ import annotations

import os
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from drake_aerial.errors import InputError

if TYPE_CHECKING:
    from drake_aerial.choices import CableKind
    from drake_aerial.control.controller_parameters import ControllerParameters
    from drake_aerial.simulation.station_parameters import StationParameters

# Names only, so that the help of the command line loads no class.
NOUNS = {
    "quadrotor": "plant.quadrotor.QuadrotorParameters",
    "payload": "plant.payload.Payload",
    "cable": "plant.cable.CableParameters",
    "gripper": "plant.gripper.GripperParameters",
    "air": "plant.air.AirParameters",
    "wind": "plant.wind.WindParameters",
    "station": "simulation.station_parameters.StationParameters",
    "controller": "control.controller_parameters.ControllerParameters",
    "features": "features.surface_features.FeatureParameters",
    "bandwidths": "density.surface_density.Bandwidth",
    "learning": "skill.parameters.LearningParameters",
    "transfer": "contacts.parameters.TransferParameters",
}
"""Noun to the class of its parameters."""


def read_parameters(noun: str, path: str | Path) -> Any:
    """Return the parameters of a YAML file; a key that is left out has its default.

    Parameters
    ----------
    noun : str
        quadrotor, payload, cable, gripper, air, wind, station, controller, features, bandwidths,
        learning or transfer.
    path : str or Path
        A mapping with the names of the class's fields as keys. Where a field is a noun itself, as
        the station's quadrotor, its value is a mapping or the name of a file, relative to this one.

    Raises
    ------
    InputError
        In one line: for an unknown noun, an unreadable file, an unknown key (with the nearest known
        one), or a value of another type or outside its range.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from drake_aerial import read_parameters
    >>> path = Path(tempfile.mkdtemp()) / "cable.yaml"
    >>> _ = path.write_text("{kind: elastic, length: 0.8}")
    >>> read_parameters("cable", path).length
    0.8
    >>> _ = path.write_text("length: 0.0")
    >>> try:
    ...     read_parameters("cable", path)
    ... except ValueError as error:
    ...     print(str(error).split(": ", 1)[1])
    `length` must be >= 0.001 m, got 0.0
    """
    from drake_aerial.io.records import read_record

    kind = noun_class(noun)
    return kind.read(path) if noun == "payload" else read_record(kind, path)


def parameters_text(parameters: Any) -> str:
    """Return parameters as YAML with the meaning, unit and range of each as a comment.

    `read_parameters` reads it back to equal ones.

    Examples
    --------
    >>> from drake_aerial import parameters_text
    >>> from drake_aerial.plant.gripper import GripperParameters
    >>> print(parameters_text(GripperParameters(holding_force=15.0)).splitlines()[-1])
    mass: 0.002  # Mass, which is added to the payload [kg]. Must be > 0.
    """
    from drake_aerial.io.record_text import record_to_yaml

    return record_to_yaml(parameters)


def defaults_text(noun: str, kind: str | None = None) -> str:
    """Return the default parameters of a component as YAML with comments.

    Parameters
    ----------
    noun : str
        As in `read_parameters`. A payload has no defaults; that of the paper's first condition is
        returned.
    kind : str, optional
        Kind of a controller or cable.

    Raises
    ------
    InputError
        For an unknown noun or kind.

    Examples
    --------
    >>> from drake_aerial import defaults_text
    >>> print(defaults_text("cable", kind="elastic").splitlines()[-2])
    damping: 10.0  # Damping of an elastic cable while it is taut [N s/m]. Must be >= 0.
    """
    from drake_aerial.io import model_files

    cls = noun_class(noun)
    if noun == "payload":
        if kind is not None:
            raise InputError(
                "`kind` must not be given for a payload; a cable and a controller have kinds"
            )
        return (model_files.models_dir() / "payloads" / "box_68x61x28.yaml").read_text(
            encoding="utf-8"
        )
    if noun == "controller":
        return parameters_text(read_controller(kind or "mpc"))
    if kind is None:
        return parameters_text(cls())
    if noun != "cable":
        raise InputError(
            f"`kind` must not be given for {noun}; a cable and a controller have kinds"
        )
    return parameters_text(cls(kind=kind))


def read_controller(name_or_path: str | Path) -> ControllerParameters:
    """Return the parameters of a controller by its name, or those of a YAML file.

    Raises
    ------
    InputError
        If it is neither, or a value in the file is wrong.
    """
    from drake_aerial.control.controller_parameters import CONTROLLERS
    from drake_aerial.io.strict_yaml import nearest

    if str(name_or_path) in CONTROLLERS:
        return CONTROLLERS[str(name_or_path)]
    if not os.path.isfile(name_or_path):
        raise InputError(
            f"`controller` must be a YAML file or one of {', '.join(CONTROLLERS)}, "
            f"got {str(name_or_path)!r}{nearest(name_or_path, CONTROLLERS)}"
        )
    return read_parameters("controller", name_or_path)


def read_station(
    station: str | Path | None = None,
    *,
    quadrotor: str | Path | None = None,
    cable: str | Path | None = None,
    gripper: str | Path | None = None,
    wind: str | Path | None = None,
) -> StationParameters:
    """Return a station's parameters: the paper's or a YAML file's, with parts from other files.

    Parameters
    ----------
    station : str or Path, optional
        A YAML file; the paper's station by default.
    quadrotor, gripper, wind : str or Path, optional
        YAML files. Quadrotor and gripper are those of the whole team.
    cable : str or Path, optional
        A YAML file for all cables, or their kind: inextensible or elastic.

    Raises
    ------
    InputError
        If a file cannot be read, or a value in it is wrong.
    """
    from drake_aerial.choices import CABLES
    from drake_aerial.io.strict_yaml import nearest
    from drake_aerial.simulation.station_parameters import StationParameters

    parameters = StationParameters() if station is None else read_parameters("station", station)
    for noun, path in (("quadrotor", quadrotor), ("gripper", gripper), ("wind", wind)):
        if path is not None:
            parameters = replace(parameters, **{noun: read_parameters(noun, path)})
    if cable is None:
        return parameters
    if str(cable) in CABLES:
        return parameters.with_cable_kind(cast("CableKind", str(cable)))
    if not os.path.isfile(cable):
        raise InputError(
            f"`cable` must be a YAML file or one of {', '.join(CABLES)}, "
            f"got {str(cable)!r}{nearest(cable, CABLES)}"
        )
    return replace(parameters, cable=read_parameters("cable", cable))


def noun_class(noun: str) -> Any:
    """Return the class of a component's parameters; for a controller, the union of two classes.

    Raises
    ------
    InputError
        For an unknown noun.
    """
    from drake_aerial.io.strict_yaml import nearest

    if noun not in NOUNS:
        raise InputError(
            f"`noun` must be one of {', '.join(NOUNS)}, got {noun!r}{nearest(noun, NOUNS)}"
        )
    module, name = NOUNS[noun].rsplit(".", 1)
    return getattr(import_module(f"drake_aerial.{module}"), name)
