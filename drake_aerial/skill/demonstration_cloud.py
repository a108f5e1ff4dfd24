"""The cloud of a demonstration file: a scan, or a view of a shipped mesh or of a box."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.cloud.readers import read_geometry
from drake_aerial.errors import InputError
from drake_aerial.io import model_files
from drake_aerial.io.strict_yaml import check_keys, number, numbers, shown
from drake_aerial.scene.depth_image import read_depth_image

_SOURCES = ("file", "mesh", "box")
_VIEWS = ("full", "top", "partial")
# A face lies within this distance of the box's top [m].
_TOP = 1e-6


def read_cloud(values: Any, path: Path) -> PointCloud:
    """Return the cloud that the `cloud` entry of a demonstration file describes.

    The entry has one source: `file` (a scan, relative to the demonstration file, or a depth image
    with its intrinsics in `camera`), `mesh` (a file, or the
    name of a shipped mesh; `scale` multiplies it) or `box` (its three sizes [m], centred on the origin). A
    mesh or box is seen in a `view`: `full`, `top` (the top face of a box alone) or `partial` (what a depth
    camera at `viewpoint` sees). `noise` [m] is added with the seed `seed`. `up` is against gravity, z by
    default; `viewpoint` orients normals.

    Raises
    ------
    InputError
        If a key is unknown or missing, a value is of the wrong kind, or the source cannot be read.
    """
    where = f"{path}: cloud"
    optional = (*_SOURCES, "camera", "view", "viewpoint", "up", "scale", "noise", "seed", "samples")
    check_keys(values, where, required=(), optional=optional)
    given = [source for source in _SOURCES if source in values]
    if len(given) != 1:
        raise InputError(
            f"{where}: give exactly one of {', '.join(_SOURCES)}, got {', '.join(given) or 'none'}"
        )
    viewpoint = (
        numbers(values["viewpoint"], (3,), f"{where}: viewpoint") if "viewpoint" in values else None
    )
    up = numbers(values["up"], (3,), f"{where}: up") if "up" in values else None
    samples = int(number(values.get("samples", 20000), f"{where}: samples"))
    noise = number(values.get("noise", 0.0), f"{where}: noise")
    rng = np.random.default_rng(int(number(values.get("seed", 0), f"{where}: seed")))
    view = values.get("view", "full")
    if view not in _VIEWS:
        raise InputError(f"{where}: view should be one of {', '.join(_VIEWS)}, got {shown(view)}")

    if given == ["file"]:
        if view != "full" or "scale" in values:
            raise InputError(
                f"{where}: view and scale belong to a mesh or box; a file is taken as it is"
            )
        file = path.parent / str(values["file"])
        if "camera" in values:
            camera = values["camera"]
            camera = path.parent / camera if isinstance(camera, str) else camera
            cloud = read_depth_image(file, camera, up=up)
        else:
            cloud = PointCloud.read(file, viewpoint=viewpoint, up=up, samples=samples)
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
                        f"{where}: the view 'top' is the top face of a box; a mesh has none"
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
                f"{where}: box should be three positive sizes in metres, got {size.tolist()}"
            )
        mesh = trimesh.creation.box(extents=size)
    else:
        file = _mesh_file(str(values["mesh"]), where, path)
        geometry = read_geometry(file)
        if geometry.faces is None:
            raise InputError(f"{where}: {file} holds no triangles; give it as file, not as mesh")
        mesh = trimesh.Trimesh(geometry.points, geometry.faces)
    scale = number(values.get("scale", 1.0), f"{where}: scale")
    if not scale > 0.0:
        raise InputError(f"{where}: scale should be positive, got {scale}")
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
        raise InputError(f"{where}: no mesh {name!r}; give a file or one of {', '.join(shipped)}")
    return shipped[name]


def _partial(
    mesh: Any,
    viewpoint: np.ndarray | None,
    up: np.ndarray | None,
    noise: float,
    rng: np.random.Generator,
    where: str,
) -> PointCloud:
    if viewpoint is None:
        raise InputError(f"{where}: the view 'partial' needs a viewpoint [x, y, z] in metres")
    from drake_aerial.cloud.partial_views import partial_view

    return partial_view(
        mesh, viewpoint, noise=noise, rng=rng, up=(0.0, 0.0, 1.0) if up is None else up
    )
