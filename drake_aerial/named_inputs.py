"""What a user may give by file or by the name of a shipped model: skills and scans."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drake_aerial.errors import InputError
from drake_aerial.io import model_files

if TYPE_CHECKING:
    from drake_aerial.cloud.point_cloud import PointCloud
    from drake_aerial.skill.contact_skill import ContactSkill


def read_skill(name_or_path: str | Path, *, seed: int = 0) -> ContactSkill:
    """Return a skill from its .npz, or learn it now from a demonstration's YAML file or shipped name.

    Raises
    ------
    InputError
        If there is no such file or demonstration, or the file is not a skill that this version reads.

    Examples
    --------
    >>> from drake_aerial import read_skill
    >>> skill = read_skill("formation")
    >>> skill.label, len(skill)
    ('formation', 3)
    """
    from drake_aerial.skill.contact_skill import ContactSkill
    from drake_aerial.skill.demonstration import Demonstration
    from drake_aerial.skill.learn import learn

    path = Path(name_or_path)
    if path.suffix in (".yaml", ".yml") or (not path.suffix and not os.path.exists(path)):
        return learn(Demonstration.read(name_or_path), seed=seed)
    if not os.path.isfile(path):
        shipped = ", ".join(model_files.names("demonstrations"))
        raise InputError(f"no skill {str(name_or_path)!r}: give a skill .npz, or one of {shipped}")
    return ContactSkill.load(path)


def read_scan(
    name_or_path: str | Path,
    *,
    viewpoint: Sequence[float] | None = None,
    up: Sequence[float] | None = None,
    camera: str | Path | None = None,
) -> PointCloud:
    """Return a cloud [m] from a file, or the whole surface of a shipped payload by its name.

    Parameters
    ----------
    name_or_path : str or Path
        A scan of any format that `PointCloud.read` takes, or a shipped payload's name.
    viewpoint : (3,), optional
        Where the sensor was, in the cloud's frame [m].
    up : (3,), optional
        The direction against gravity in the cloud's frame; z by default.
    camera : str or Path, optional
        Intrinsics (YAML) of a depth image, whose points are in the camera's frame.

    Raises
    ------
    InputError
        If it is neither, or the cloud is refused.

    Examples
    --------
    >>> from drake_aerial import read_scan
    >>> read_scan("box_68x61x28").extent.round(2).tolist()
    [0.68, 0.61, 0.28]
    """
    import trimesh

    from drake_aerial.cloud.point_cloud import PointCloud

    path = Path(name_or_path)
    if camera is not None:
        from drake_aerial.scene.depth_image import read_depth_image

        if viewpoint is not None:
            raise InputError("a depth image is seen from its camera; leave out the viewpoint")
        return read_depth_image(path, camera, up=up)
    names = model_files.names("payloads")
    if not os.path.exists(path) and not path.suffix and str(name_or_path) in names:
        from drake_aerial.geometry import transform
        from drake_aerial.plant.payload import Payload

        payload = Payload.read(name_or_path)
        mesh = trimesh.Trimesh(
            transform(payload.X_SP, payload.vertices), payload.faces, process=False
        )
        return PointCloud.read(mesh, viewpoint=viewpoint, up=up)
    if not os.path.exists(path) and not path.suffix:
        raise InputError(
            f"no scan {str(name_or_path)!r}: give a file, or one of the payloads {', '.join(names)}"
        )
    return PointCloud.read(path, viewpoint=viewpoint, up=up)
