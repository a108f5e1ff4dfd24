"""Entries of a demonstration file, and the cloud that it names."""

import os
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from annotated_types import Ge, Len

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.cloud.readers import read_geometry
from drake_aerial.errors import InputError
from drake_aerial.io import model_files
from drake_aerial.io.records import (
    Count,
    Flag,
    Name,
    NonNegative,
    Number,
    Positive,
    Vector,
    Whole,
    record,
)
from drake_aerial.scene.bags import is_bag, read_bag
from drake_aerial.scene.depth_image import read_depth_image
from drake_aerial.scene.object_choice import ObjectChoice, chosen_object

# A face lies within this distance of the box's top [m].
_TOP = 1e-6


@record(frozen=True)
class CloudEntry:
    """The `cloud` of a demonstration file, with one source: file, mesh or box."""

    file: Name | None = None
    """A scan, relative to the demonstration file."""
    camera: Name | dict[str, Any] | None = None
    """Intrinsics, or their YAML file, if `file` is a depth image."""
    topic: Name | None = None
    """Topic of the points, if `file` is a bag."""
    object: Annotated[Whole, Ge(2)] | None = None
    """Number of the payload, if `file` is a scene; None for the only one, or no scene."""
    whole: Flag = False
    """Whether all points of `file` are the payload, whatever is seen in them."""
    mesh: Name | None = None
    """A mesh file, relative to the demonstration file, or the name of a shipped mesh."""
    box: tuple[Positive, Positive, Positive] | None = None
    """Edges of a box centred on the origin [m]."""
    scale: Positive | None = None
    """Factor on the mesh or box (dimensionless); None for 1."""
    view: Literal["full", "top", "partial"] = "full"
    """Visible part of the mesh or box: full, top (the top face of a box), or partial (the view of a
    depth camera at `viewpoint`)."""
    viewpoint: Vector | None = None
    """Position of the sensor, which orients normals [m]."""
    up: Vector | None = None
    """Direction against gravity (dimensionless); None for z."""
    noise: NonNegative = 0.0
    """Standard deviation of the noise that is added to the points [m]."""
    seed: Annotated[Whole, Ge(0)] = 0
    """Random seed of the noise."""
    samples: Count = 20000
    """Number of points sampled from a mesh or box."""

    def __post_init__(self) -> None:
        given = [name for name in ("file", "mesh", "box") if getattr(self, name) is not None]
        if len(given) != 1:
            raise InputError(
                f"exactly one of file, mesh, box must be given, got {', '.join(given) or 'none'}"
            )
        if self.file is not None and (self.view != "full" or self.scale is not None):
            raise InputError(
                "`view` and `scale` must not be given for a file, only for a mesh or box"
            )
        if self.topic is not None and self.file is None:
            raise InputError("`topic` may be given only for a `file` that is a bag, got no `file`")
        if self.object is not None and (self.file is None or self.whole):
            raise InputError(
                "`object` may be given only for a `file` that is a scene, and not with `whole`"
            )
        if self.view == "top" and self.box is None:
            raise InputError(
                "`view` must be full or partial for a mesh, got 'top' (for a box only)"
            )
        if self.view == "partial" and self.viewpoint is None:
            raise InputError(
                "`viewpoint` must be [x, y, z] in metres for the partial view, got none"
            )


def read_cloud(entry: CloudEntry, folder: Path) -> PointCloud:
    """Return the cloud of a demonstration file.

    Parameters
    ----------
    entry : CloudEntry
    folder : Path
        Folder of the demonstration file.

    Raises
    ------
    InputError
        If the file or mesh cannot be read.
    """
    rng = np.random.default_rng(entry.seed)
    placed: dict[str, Any] = {"viewpoint": entry.viewpoint, "up": entry.up}
    camera = folder / entry.camera if isinstance(entry.camera, str) else entry.camera
    if entry.file is not None and is_bag(folder / entry.file):
        cloud = read_bag(folder / entry.file, entry.topic, camera=camera, **placed)
    elif entry.file is not None and camera is not None:
        cloud = read_depth_image(folder / entry.file, camera, up=entry.up)
    elif entry.file is not None:
        cloud = PointCloud.read(folder / entry.file, samples=entry.samples, **placed)
    elif entry.view == "partial":
        from drake_aerial.cloud.partial_views import partial_view

        assert entry.viewpoint is not None
        placed["up"] = entry.up or (0.0, 0.0, 1.0)
        return partial_view(_mesh(entry, folder), **placed, noise=entry.noise, rng=rng)
    else:
        cloud = PointCloud.read(_mesh(entry, folder), samples=entry.samples, **placed)
        if entry.view == "top":
            top = cloud.points[:, 2].max() - _TOP
            cloud = cloud.cropped([-np.inf, -np.inf, top], [np.inf] * 3)
    if entry.file is not None and not entry.whole:
        cloud = chosen_object(cloud, ObjectChoice(entry.object))
    return cloud.with_noise(entry.noise, rng) if entry.noise > 0.0 else cloud


def _mesh(entry: CloudEntry, folder: Path) -> Any:
    import trimesh

    if entry.box is not None:
        mesh = trimesh.creation.box(extents=entry.box)
    else:
        file = _mesh_file(str(entry.mesh), folder)
        geometry = read_geometry(file)
        if geometry.faces is None:
            raise InputError(
                f"`mesh` must have triangles, got the points {file}; give it as `file`"
            )
        mesh = trimesh.Trimesh(geometry.points, geometry.faces)
    mesh.apply_scale(entry.scale or 1.0)
    return mesh


def _mesh_file(name: str, folder: Path) -> Path:
    if os.path.isfile(folder / name):
        return folder / name
    files = sorted((model_files.models_dir() / "meshes").glob("*"))
    shipped = {file.stem: file for file in files if file.suffix in (".obj", ".ply", ".stl")}
    if name not in shipped:
        raise InputError(f"`mesh` must be a file or one of {', '.join(shipped)}, got {name!r}")
    return shipped[name]


@record(frozen=True)
class GripperEntry:
    """A gripper of a demonstration file, in the cloud's frame S."""

    position: Vector
    """Position on the surface [m]."""
    axis: Vector | None = None
    """Outward surface normal of any length (dimensionless); None for up, or if `quaternion_wxyz` is
    given."""
    quaternion_wxyz: tuple[Number, Number, Number, Number] | None = None
    """Orientation q_SG, z along the outward normal (dimensionless)."""
    cable_length: Positive | None = None
    """Length of the cable [m]; None for the distance to `quadrotor`, or 0.5 without one."""
    cable_direction: Vector | None = None
    """Direction from gripper to quadrotor, of any length (dimensionless); None for up."""
    quadrotor: Vector | None = None
    """Position of the quadrotor [m]."""

    def __post_init__(self) -> None:
        for one, other in (("axis", "quaternion_wxyz"), ("cable_direction", "quadrotor")):
            if getattr(self, one) is not None and getattr(self, other) is not None:
                raise InputError(f"only one of `{one}` and `{other}` may be given, got both")
        if self.quaternion_wxyz is not None and np.linalg.norm(self.quaternion_wxyz) < 1e-6:
            raise InputError("`quaternion_wxyz` must not be zero")


@record(frozen=True)
class DemonstrationFile:
    """A DEMONSTRATION.yaml."""

    cloud: CloudEntry
    """The visible surface."""
    grippers: Annotated[tuple[GripperEntry, ...], Len(1)]
    """One entry per gripper."""
    name: Name | None = None
    """Name of the demonstration; None for the file's name."""
    label: Name | None = None
    """Label of the learnt skill; None for the name."""
    description: Name = ""
    """One sentence about the demonstration."""
