"""Reader of payload files (PAYLOAD.yaml)."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial import geometry
from drake_aerial.errors import InputError
from drake_aerial.io import model_files
from drake_aerial.io.records import Name, Number, Positive, Vector, read_record, record
from drake_aerial.plant.mass_properties import check_inertia


@record(frozen=True)
class PoseEntry:
    """Pose of the payload's frame P in the scan's frame S."""

    position: Vector = (0.0, 0.0, 0.0)
    """Position p_SP [m]."""
    quaternion_wxyz: tuple[Number, Number, Number, Number] = (1.0, 0.0, 0.0, 0.0)
    """Unit quaternion q_SP (dimensionless)."""

    def __post_init__(self) -> None:
        norm = np.linalg.norm(self.quaternion_wxyz)
        if abs(norm - 1.0) > 1e-3:
            raise InputError(f"`quaternion_wxyz` must have the norm 1, got {norm:.4g}")


@record(frozen=True)
class PayloadFile:
    """A PAYLOAD.yaml."""

    mass: Positive
    """Mass [kg]."""
    name: Name | None = None
    """Name of the payload; None for the file's name."""
    description: Name = ""
    """One sentence about the payload."""
    mesh: Name | None = None
    """A mesh file beside this one, or package://drake_aerial/...; None if `box` is given."""
    box: tuple[Positive, Positive, Positive] | None = None
    """Edges of a box [m]; None if `mesh` is given."""
    scale: Positive = 1.0
    """Factor on the shape (dimensionless)."""
    com: Vector | None = None
    """Centre of mass in P [m]; None for that of a uniform solid."""
    inertia: Vector | tuple[Vector, Vector, Vector] | None = None
    """Moments or matrix of inertia about the centre of mass [kg m^2]; None for a uniform
    solid's."""
    pose: PoseEntry | None = None
    """Pose in the scan's frame; None for the identity."""

    def __post_init__(self) -> None:
        if (self.mesh is None) == (self.box is None):
            given = "neither" if self.mesh is None else "both"
            raise InputError(f"exactly one of `mesh` and `box` must be given, got {given}")
        if self.inertia is not None:
            check_inertia(self.inertia, "`inertia`")


def read_payload_file(name_or_path: str | Path) -> dict[str, Any]:
    """Return the arguments of `Payload.from_box` or `Payload.from_mesh` that a file describes.

    Parameters
    ----------
    name_or_path : str or Path
        A file, or the name of a shipped payload.

    Returns
    -------
    dict
        With the key `size` for a box, and with `mesh` and `scale` for a mesh.

    Raises
    ------
    InputError
        As `Payload.read`.
    """
    path = model_files.find("payloads", name_or_path)
    content = read_record(PayloadFile, path)
    position, quaternion = (np.array(part) for part in vars(content.pose or PoseEntry()).values())
    arguments = {
        "mass": content.mass,
        "com": content.com,
        "inertia": content.inertia,
        "name": content.name or path.stem,
        "X_SP": geometry.Pose(position, geometry.quat_normalize(quaternion)),
    }
    if content.mesh is None:
        return {"size": content.scale * np.array(content.box), **arguments}
    return {"mesh": _mesh_path(content.mesh, path), "scale": content.scale, **arguments}


def _mesh_path(uri: str, beside: Path) -> Path:
    prefix = "package://drake_aerial/"
    if uri.startswith(prefix):
        models = model_files.models_dir().resolve()
        found = Path(os.path.normpath(models / uri.removeprefix(prefix)))
        if not found.is_relative_to(models):
            raise InputError(f"{beside}: `mesh` must be a file of the package's models, got {uri}")
        return found
    return beside.parent / uri
