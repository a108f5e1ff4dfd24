"""One condition of a study: what was demonstrated, what is to be carried, what is seen of it, and how it is flown."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.choices import CABLES, CONTROLLERS
from drake_aerial.errors import InputError
from drake_aerial.io import model_files
from drake_aerial.io.strict_yaml import check_keys, nearest, number, numbers, shown
from drake_aerial.plant.payload import TABLE_INERTIA, Payload
from drake_aerial.references.trajectory import Trajectory, TransportTrajectory
from drake_aerial.references.trajectory_files import (
    read_trajectory,
    trajectory_from_dict,
    trajectory_to_dict,
)

VIEWS = ("full", "top", "partial")
INERTIAS = ("table", "mesh", "file")
_REQUIRED = ("name", "payload")
_OPTIONAL = (
    "title",
    "demonstration",
    "view",
    "viewpoint",
    "scan_noise",
    "points",
    "trajectory",
    "controller",
    "cable",
    "flight_noise",
    "contacts",
)
DEFAULTABLE = tuple(key for key in _OPTIONAL if key not in ("title", "contacts"))
"""Keys that a plan may give once for all of its conditions."""

Sites = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Condition:
    """One condition of a study.

    Attributes
    ----------
    name : str
        Short, fit for a file name: "A".
    payload : str
        A shipped payload's name or a PAYLOAD.yaml.
    title : str
        A short phrase.
    demonstration : str or None
        A shipped demonstration's name, its YAML file, or a skill .npz; None where `contacts` are given.
    view : str
        What is seen of the payload: "full", "top" (its highest, level face alone) or "partial" (by a depth camera).
    viewpoint : (float, float, float) or None
        The camera's position in the scan's frame [m]; needed for "partial".
    scan_noise : float
        Standard deviation of the scan's noise [m].
    points : int
        Samples of the payload's whole surface; a partial view has one point per pixel instead.
    trajectory : Trajectory
    controller, cable : str
        See `fly`.
    flight_noise : float
        Standard deviation of the measured payload position [m].
    contacts : tuple of (label, positions)
        Contacts that are given instead of transferred, in the payload's frame [m]; the labels stand for methods.

    Examples
    --------
    >>> from drake_aerial import Condition
    >>> Condition("A", "box_68x61x28", demonstration="flat", view="top").controller
    'mpc'
    """

    name: str
    payload: str
    title: str = ""
    demonstration: str | None = None
    view: str = "full"
    viewpoint: tuple[float, float, float] | None = None
    scan_noise: float = 0.001
    points: int = 20000
    trajectory: Trajectory = field(default_factory=TransportTrajectory)
    controller: str = "mpc"
    cable: str = "inextensible"
    flight_noise: float = 0.01
    contacts: tuple[tuple[str, Sites], ...] = ()

    def __post_init__(self) -> None:
        where = f"condition {self.name!r}"
        if not self.name or not self.name.replace("_", "").isalnum():
            raise InputError(f"{where}: a name of letters, digits and underscores is accepted")
        if bool(self.contacts) == (self.demonstration is not None):
            raise InputError(
                f"{where}: one of the keys 'demonstration' and 'contacts' must be given"
            )
        _one_of(self.view, VIEWS, f"{where}: view")
        _one_of(self.controller, CONTROLLERS, f"{where}: controller")
        _one_of(self.cable, CABLES, f"{where}: cable")
        if self.view == "partial" and self.viewpoint is None:
            raise InputError(f"{where}: the view 'partial' needs a viewpoint [x, y, z] in metres")
        for key in ("scan_noise", "flight_noise"):
            if getattr(self, key) < 0.0:
                raise InputError(
                    f"{where}: {key} is {getattr(self, key):g} m; zero or more accepted"
                )
        if self.points < 100:
            raise InputError(f"{where}: points is {self.points}; at least 100 accepted")

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the given contacts; empty where contacts are transferred."""
        return tuple(label for label, _ in self.contacts)

    @classmethod
    def from_dict(cls, values: Any, where: str, folder: Path | None = None) -> Condition:
        """Return the condition of a mapping, checked; files may be relative to `folder`.

        Raises
        ------
        InputError
            For an unknown key (the nearest known one is named), a missing one, a value of the wrong kind, or a file that is not there.
        """
        check_keys(values, where, required=_REQUIRED, optional=_OPTIONAL)
        where = f"{where} {values['name']!r}"
        given: dict[str, Any] = {
            "name": str(values["name"]),
            "title": str(values.get("title", values["name"])),
        }
        given["payload"] = _file(values["payload"], "payloads", folder)
        if values.get("demonstration") is not None:
            given["demonstration"] = _file(values["demonstration"], "demonstrations", folder)
        for key in ("view", "controller", "cable"):
            if key in values:
                given[key] = str(values[key])
        for key in ("scan_noise", "flight_noise"):
            if key in values:
                given[key] = number(values[key], f"{where}: {key}")
        if values.get("viewpoint") is not None:
            given["viewpoint"] = tuple(
                numbers(values["viewpoint"], (3,), f"{where}: viewpoint").tolist()
            )
        if "points" in values:
            given["points"] = int(number(values["points"], f"{where}: points"))
        if "trajectory" in values:
            given["trajectory"] = _trajectory(values["trajectory"], f"{where}: trajectory", folder)
        if values.get("contacts"):
            given["contacts"] = _contacts(values["contacts"], f"{where}: contacts")
        return cls(**given)

    def to_dict(self) -> dict[str, Any]:
        """Return the mapping from which `from_dict` makes an equal condition."""
        values: dict[str, Any] = {"name": self.name, "title": self.title, "payload": self.payload}
        if self.demonstration is not None:
            values["demonstration"] = self.demonstration
        values["view"] = self.view
        if self.viewpoint is not None:
            values["viewpoint"] = list(self.viewpoint)
        values |= {
            "scan_noise": self.scan_noise,
            "points": self.points,
            "trajectory": trajectory_to_dict(self.trajectory),
        }
        values |= {
            "controller": self.controller,
            "cable": self.cable,
            "flight_noise": self.flight_noise,
        }
        if self.contacts:
            values["contacts"] = {label: [list(p) for p in sites] for label, sites in self.contacts}
        return values

    def fingerprint(self) -> str:
        """Return a hash of what the condition's files hold, so that another payload of the same name is another study's."""
        digest = hashlib.sha256(model_files.find("payloads", self.payload).read_bytes())
        digest.update(
            np.ascontiguousarray(Payload.read(self.payload).vertices, dtype="<f8").tobytes()
        )
        if self.demonstration is not None:
            digest.update(model_files.find("demonstrations", self.demonstration).read_bytes())
        return digest.hexdigest()

    def carried(self, inertia: str) -> Payload:
        """Return the payload with the inertia of the paper's table ("table"), of its own uniform solid ("mesh"), or of its file ("file").

        Mass and centre of mass are the payload file's in all three.
        """
        _one_of(inertia, INERTIAS, "inertia")
        payload = Payload.read(self.payload)
        if inertia == "file":
            return payload
        shape = (payload.vertices, payload.faces)
        return Payload.from_mesh(
            shape,
            payload.mass,
            com=payload.com,
            inertia=TABLE_INERTIA if inertia == "table" else None,
            name=payload.name,
            X_SP=payload.X_SP,
        )


def _one_of(value: str, accepted: tuple[str, ...], what: str) -> None:
    if value not in accepted:
        raise InputError(
            f"{what} is {shown(value)}{nearest(value, accepted)}; accepted: {', '.join(accepted)}"
        )


def _file(value: Any, kind: str, folder: Path | None) -> str:
    """Return a shipped name as it is, and a file as an absolute path."""
    name = str(value)
    if folder is not None and os.path.isfile(folder / name):
        return str((folder / name).resolve())
    found = model_files.find(kind, name)
    return str(found.resolve()) if os.path.isfile(name) else name


def _trajectory(value: Any, where: str, folder: Path | None) -> Trajectory:
    try:
        if isinstance(value, Mapping):
            return trajectory_from_dict(dict(value))
        beside = (folder or Path()) / str(value)
        return read_trajectory(beside if os.path.isfile(beside) else str(value))
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def _contacts(values: Any, where: str) -> tuple[tuple[str, Sites], ...]:
    if not isinstance(values, dict) or not values:
        raise InputError(
            f"{where} should map labels to lists of positions [x, y, z], got {shown(values)}"
        )
    given = []
    for label, sites in values.items():
        if not str(label).replace("_", "").isalnum():
            raise InputError(f"{where}: label {label!r}; letters, digits and underscores accepted")
        if not isinstance(sites, list) or not sites:
            raise InputError(
                f"{where}: {label} should be a list of positions [x, y, z], got {shown(sites)}"
            )
        points = [numbers(site, (3,), f"{where}: {label}") for site in sites]
        given.append((str(label), tuple((float(x), float(y), float(z)) for x, y, z in points)))
    return tuple(given)
