"""The scan of a condition: all of the payload's surface, its top face, or a camera's view."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.cloud.mesh_sampling import sample_surface
from drake_aerial.cloud.partial_views import partial_view
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.io.archives import load_archive
from drake_aerial.io.files import replacing
from drake_aerial.plant.payload import Payload
from drake_aerial.study.conditions import Condition

_TOP_TOLERANCE = 1e-6
"""Points closer than this to the height of the highest one are on the top face [m]."""
_TOP_SENSOR_HEIGHT = 3.0
"""Height of the assumed sensor of a top view above the face [m]; it orients the normals."""


def scan(condition: Condition, seed: int) -> PointCloud:
    """Return the scan of a condition's payload, in S, rounded to single precision.

    Parameters
    ----------
    condition : Condition
    seed : int
        Of the samples and the noise.

    Raises
    ------
    InputError
        If the view is "top" and the payload has no level top face, or nothing is in view.
    """
    payload = Payload.read(condition.payload)
    mesh = payload.to_trimesh()
    rng = np.random.default_rng(seed)
    viewpoint = None
    if condition.view == "partial":
        assert condition.viewpoint is not None
        points = partial_view(mesh, condition.viewpoint, noise=condition.scan_noise, rng=rng).points
        viewpoint = np.asarray(condition.viewpoint)
    else:
        faces = payload.faces.astype(np.int64)
        points = sample_surface(np.asarray(mesh.vertices), faces, condition.points, seed=seed)
        if condition.view == "top":
            points = points[points[:, 2] > points[:, 2].max() - _TOP_TOLERANCE]
            if len(points) < 100:
                raise InputError(
                    f"condition {condition.name!r}: `view` top needs a level top face, which "
                    f"{payload.name!r} does not have; give full or partial"
                )
            viewpoint = points.mean(axis=0) + [0.0, 0.0, _TOP_SENSOR_HEIGHT]
        points = points + condition.scan_noise * rng.standard_normal(points.shape)
    cloud = PointCloud.read(points.astype(np.float32).astype(np.float64), viewpoint=viewpoint)
    return replace(cloud, path=f"../scans/{condition.name}.npz")


def write_scan(path: Path, cloud: PointCloud) -> None:
    """Write an .npz with `points` (N, 3) float32 [m] and, if known, `viewpoint` (3,) [m]."""
    arrays: dict[str, Any] = {"points": cloud.points.astype(np.float32)}
    if cloud.viewpoint is not None:
        arrays["viewpoint"] = cloud.viewpoint
    with replacing(path) as temporary:
        np.savez_compressed(temporary, **arrays)


def read_scan_file(path: Path) -> PointCloud:
    """Return the cloud of a file that `write_scan` wrote.

    Raises
    ------
    InputError
        If the file cannot be read, or is not a scan.
    """
    return PointCloud.read(path, viewpoint=load_archive(path, "a scan").get("viewpoint"))
