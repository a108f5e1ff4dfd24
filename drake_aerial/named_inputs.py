"""Read skills and scans from a file or by the name of a shipped model."""

import os
from collections.abc import Sequence
from pathlib import Path

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.io import model_files
from drake_aerial.plant.payload import Payload
from drake_aerial.scene.bags import is_bag, read_bag
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn


def read_skill(name_or_path: str | Path, *, seed: int = 0) -> ContactSkill:
    """Return a skill from its .npz, or learn it from a demonstration.

    Parameters
    ----------
    name_or_path : str or Path
        A skill's .npz, a demonstration's YAML file, or the name of a shipped demonstration.
    seed : int
        Random seed of the learning.

    Raises
    ------
    InputError
        If there is no such file or demonstration, or this version cannot read the file.

    Examples
    --------
    >>> from drake_aerial import read_skill
    >>> skill = read_skill("formation")
    >>> skill.label, len(skill)
    ('formation', 3)
    """
    path = Path(name_or_path)
    if path.suffix in (".yaml", ".yml") or (not path.suffix and not os.path.exists(path)):
        return learn(Demonstration.read(name_or_path), seed=seed)
    if not os.path.isfile(path):
        shipped = ", ".join(model_files.names("demonstrations"))
        raise InputError(
            f"`skill` must be a .npz file, a demonstration's YAML file or one of {shipped}, "
            f"got {str(name_or_path)!r} (no such file)"
        )
    return ContactSkill.load(path)


def read_scan(
    name_or_path: str | Path,
    *,
    viewpoint: Sequence[float] | None = None,
    up: Sequence[float] | None = None,
    camera: str | Path | None = None,
    topic: str | None = None,
) -> PointCloud:
    """Return a cloud from a file, or the whole surface of a shipped payload.

    Parameters
    ----------
    name_or_path : str or Path
        A scan of any format that `PointCloud.read` takes, a depth image, a bag (a folder of
        rosbag2, .mcap, .db3 or .bag), or the name of a shipped payload.
    viewpoint : (3,), optional
        The sensor's position in the cloud's frame [m].
    up : (3,), optional
        Direction against gravity in the cloud's frame; z by default.
    camera : str or Path, optional
        Intrinsics (YAML) of a depth image, whose points are in the camera's frame.
    topic : str, optional
        Topic of a bag; by default the only one with points.

    Raises
    ------
    InputError
        If it is neither, or the cloud is not valid.

    Examples
    --------
    >>> from drake_aerial import read_scan
    >>> read_scan("box_68x61x28").extent.round(2).tolist()
    [0.68, 0.61, 0.28]
    """
    path = Path(name_or_path)
    if is_bag(path):
        return read_bag(path, topic, viewpoint=viewpoint, up=up, camera=camera)
    if topic is not None:
        raise InputError(f"`topic` may be given only for a bag, got {path}, which is not a bag")
    if camera is not None:
        from drake_aerial.scene.depth_image import read_depth_image

        if viewpoint is not None:
            raise InputError("`viewpoint` must not be given for a depth image: it is the origin")
        return read_depth_image(path, camera, up=up)
    if os.path.exists(path) or path.suffix:
        return PointCloud.read(path, viewpoint=viewpoint, up=up)
    names = model_files.names("payloads")
    if str(name_or_path) not in names:
        raise InputError(
            f"`scan` must be a file or one of the payloads {', '.join(names)}, "
            f"got {str(name_or_path)!r} (no such file)"
        )

    mesh = Payload.read(name_or_path).to_trimesh()
    return PointCloud.read(mesh, viewpoint=viewpoint, up=up)
