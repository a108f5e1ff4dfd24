"""The cloud of a demonstration file: a scan, or a view of a shipped mesh or of a box."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.io import model_files
from drake_aerial.io.strict_yaml import check_keys, number, numbers, shown

_SOURCES = ("file", "mesh", "box")
_VIEWS = ("full", "top", "partial")
# Distance from the highest point within which a point belongs to a box's top face [m].
_TOP = 1e-6


def read_cloud(values: Any, path: Path) -> PointCloud:
    """Return the cloud that the `cloud` entry of a demonstration file describes.

    The entry has one source:

    - `file`: a scan, relative to the demonstration file;
    - `mesh`: a mesh file, or the name of a shipped mesh; `scale` multiplies it;
    - `box`: three sizes [m] of a box centred on the origin.

    The `view` of a mesh or box is `full`, `top` (the top face of a box alone) or `partial` (the
    view of a depth camera at `viewpoint`). Noise of standard deviation `noise` [m] is drawn with
    the random seed `seed`. `up` points against gravity (default: z); `viewpoint` orients normals.

    Raises
    ------
    InputError
        If a key is unknown or missing, a value is of the wrong kind, or the source cannot be read.
    """
    where = f"{path}: cloud"
    optional = (*_SOURCES, "view", "viewpoint", "up", "scale", "noise", "seed", "samples")
    check_keys(values, where, required=(), optional=optional)
    given = [source for source in _SOURCES if source in values]
    if len(given) != 1:
        raise InputError(
            f"{where}: exactly one of {', '.join(_SOURCES)} must be given, "
            f"got {', '.join(given) or 'none'}"
        )
    viewpoint = (
        numbers(values["viewpoint"], (3,), f"{where}: viewpoint") if "viewpoint" in values else None
    )
    up = numbers(values.get("up", [0.0, 0.0, 1.0]), (3,), f"{where}: up")
    samples = int(number(values.get("samples", 20000), f"{where}: samples"))
    noise = number(values.get("noise", 0.0), f"{where}: noise")
    rng = np.random.default_rng(int(number(values.get("seed", 0), f"{where}: seed")))
    view = values.get("view", "full")
    if view not in _VIEWS:
        raise InputError(f"{where}: `view` must be one of {', '.join(_VIEWS)}, got {shown(view)}")

    if given == ["file"]:
        if view != "full" or "scale" in values:
            raise InputError(
                f"{where}: `view` and `scale` must be left out with `file`; they need a mesh or box"
            )
        cloud = PointCloud.read(
            path.parent / str(values["file"]), viewpoint=viewpoint, up=up, samples=samples
        )
    else:
        mesh = _mesh(values, given[0], where, path)
        if view == "partial":
            cloud = _partial(mesh, viewpoint, up, noise, rng, where)
            noise = 0.0
        else:
            cloud = PointCloud.read(mesh, viewpoint=viewpoint, up=up, samples=samples)
            if view == "top":
                if given != ["box"]:
                    raise InputError(
                        f"{where}: `view` must be full or partial for a mesh, got top; "
                        "only a box has a top face"
                    )
                top = cloud.points[:, 2].max() - _TOP
                cloud = cloud.cropped([-np.inf, -np.inf, top], [np.inf] * 3)
    return cloud.with_noise(noise, rng) if noise > 0.0 else cloud


def _mesh(values: dict[str, Any], source: str, where: str, path: Path) -> Any:
    import trimesh

    if source == "box":
        size = numbers(values["box"], (3,), f"{where}: box")
        if not np.all(size > 0.0):
            raise InputError(
                f"{where}: `box` must be three positive sizes in metres, got {size.tolist()}"
            )
        mesh = trimesh.creation.box(extents=size)
    else:
        file = _mesh_file(str(values["mesh"]), where, path)
        mesh = trimesh.load(file, force="mesh")
    scale = number(values.get("scale", 1.0), f"{where}: scale")
    if not scale > 0.0:
        raise InputError(f"{where}: `scale` must be positive, got {scale}")
    mesh.apply_scale(scale)
    return mesh


def _mesh_file(name: str, where: str, path: Path) -> Path:
    beside = path.parent / name
    if os.path.isfile(beside):
        return beside
    folder = model_files.models_dir() / "meshes"
    shipped = {
        file.stem: file
        for file in sorted(folder.glob("*"))
        if file.suffix in (".obj", ".ply", ".stl")
    }
    if name not in shipped:
        raise InputError(
            f"{where}: `mesh` must be a file or one of {', '.join(shipped)}, got {name!r}"
        )
    return shipped[name]


def _partial(
    mesh: Any,
    viewpoint: np.ndarray | None,
    up: np.ndarray,
    noise: float,
    rng: np.random.Generator,
    where: str,
) -> PointCloud:
    if viewpoint is None:
        raise InputError(
            f"{where}: `viewpoint` must be [x, y, z] in metres for the partial view, got none"
        )
    from drake_aerial.cloud.partial_views import partial_view

    return partial_view(mesh, viewpoint, noise=noise, rng=rng, up=up)
