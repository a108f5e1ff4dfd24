"""One condition of a study: demonstration, payload, scan and flight."""

import hashlib
import os
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import numpy as np
from annotated_types import Ge, Len
from pydantic import AfterValidator, BeforeValidator, SkipValidation, ValidationInfo

from drake_aerial.choices import CableKind, ControllerKind
from drake_aerial.errors import InputError
from drake_aerial.io import model_files
from drake_aerial.io.records import Name, NonNegative, Vector, Whole, record
from drake_aerial.plant.payload import TABLE_INERTIA, Payload
from drake_aerial.references.trajectory import Trajectory, TransportTrajectory
from drake_aerial.references.trajectory_files import (
    read_trajectory,
    trajectory_from_dict,
    trajectory_to_dict,
)

Inertia = Literal["table", "mesh", "file"]
INERTIAS = get_args(Inertia)
NOT_SHARED = ("name", "title", "payload", "contacts")
"""Keys that a plan cannot give once for all of its conditions."""


def _file(kind: str) -> AfterValidator:
    """Return a validator that makes a file of a document absolute and keeps a shipped name."""

    def absolute(name: str, info: ValidationInfo) -> str:
        if info.context is None:
            return name
        beside = (info.context["folder"] or Path()) / name
        if os.path.isfile(beside):
            return str(beside.resolve())
        found = model_files.find(kind, name)
        return str(found.resolve()) if os.path.isfile(name) else name

    return AfterValidator(absolute)


def _trajectory(given: Any, info: ValidationInfo) -> Trajectory:
    if isinstance(given, Mapping):
        return trajectory_from_dict(dict(given))
    if isinstance(given, Trajectory):
        return given
    beside = ((info.context or {}).get("folder") or Path()) / str(given)
    return read_trajectory(beside if os.path.isfile(beside) else str(given))


def _contacts(given: Any) -> Any:
    return tuple(given.items()) if isinstance(given, Mapping) else given or ()


@record(frozen=True)
class Condition:
    """One condition of a study.

    Examples
    --------
    >>> from drake_aerial import Condition
    >>> Condition("A", "box_68x61x28", demonstration="flat", view="top").controller
    'mpc'
    """

    name: Name
    """Short name of letters, digits and underscores, fit for a file name."""
    payload: Annotated[Name, _file("payloads")]
    """Name of a shipped payload, or a PAYLOAD.yaml."""
    title: Name = ""
    """Title in the report; the name by default in a file."""
    demonstration: Annotated[Name, _file("demonstrations")] | None = None
    """Name of a shipped demonstration, its YAML file, or a skill .npz; None if `contacts` are
    given."""
    view: Literal["full", "top", "partial"] = "full"
    """Visible part of the payload: full, top (its highest, level face) or partial (the view of a
    depth camera)."""
    viewpoint: Vector | None = None
    """Position of the camera in the scan's frame [m]; needed for the view partial."""
    scan_noise: NonNegative = 0.001
    """Standard deviation of the scan's noise [m]."""
    points: Annotated[Whole, Ge(100)] = 20000
    """Points sampled on the payload's whole surface; a partial view has one point per pixel
    instead."""
    trajectory: Annotated[Trajectory, SkipValidation, BeforeValidator(_trajectory)] = field(
        default_factory=TransportTrajectory
    )
    """Trajectory of the payload: a name, a file or a mapping with `kind`."""
    controller: ControllerKind = "mpc"
    """Kind of the controller."""
    cable: CableKind = "inextensible"
    """Kind of the cables."""
    flight_noise: NonNegative = 0.01
    """Standard deviation of the measured payload position [m]."""
    contacts: Annotated[
        tuple[tuple[Name, Annotated[tuple[Vector, ...], Len(1)]], ...], BeforeValidator(_contacts)
    ] = ()
    """Contacts that are given instead of transferred, in the payload's frame [m]: labels, which
    take the place of methods, with lists of positions."""

    def __post_init__(self) -> None:
        for name in (self.name, *self.labels):
            if not name.replace("_", "").isalnum():
                raise InputError(
                    f"`name` and labels must be letters, digits and underscores, got {name!r}"
                )
        if bool(self.contacts) == (self.demonstration is not None):
            given = "both" if self.contacts else "neither"
            raise InputError(
                f"exactly one of `demonstration` and `contacts` must be given, got {given}"
            )
        if self.view == "partial" and self.viewpoint is None:
            raise InputError(
                "`viewpoint` must be given for the view 'partial': [x, y, z] in metres"
            )

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the given contacts; empty where contacts are transferred."""
        return tuple(label for label, _ in self.contacts)

    def to_dict(self) -> dict[str, Any]:
        """Return the condition as the mapping that is written to study.yaml."""
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
        """Return a hash of the content of the condition's files."""
        digest = hashlib.sha256(model_files.find("payloads", self.payload).read_bytes())
        digest.update(
            np.ascontiguousarray(Payload.read(self.payload).vertices, dtype="<f8").tobytes()
        )
        if self.demonstration is not None:
            digest.update(model_files.find("demonstrations", self.demonstration).read_bytes())
        return digest.hexdigest()

    def payload_with(self, inertia: str) -> Payload:
        """Return the payload with another inertia; mass and centre of mass are those of its file.

        Parameters
        ----------
        inertia : str
            That of the paper's table ("table"), of the payload's shape with uniform density
            ("mesh"), or of the payload's file ("file").
        """
        if inertia not in INERTIAS:
            raise InputError(f"`inertia` must be one of {', '.join(INERTIAS)}, got {inertia!r}")
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
