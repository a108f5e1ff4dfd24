"""The scan that a condition's methods are shown: all of the payload's surface, its top face, or a camera's view."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.cloud.mesh_sampling import sample_surface
from drake_aerial.cloud.partial_views import partial_view
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.geometry import transform
from drake_aerial.io.files import replacing
from drake_aerial.plant.payload import Payload
from drake_aerial.study.conditions import Condition

# A face is level with the highest point within this distance [m].
_TOP = 1e-6
# How far above the payload the sensor of a full or top view is taken to be [m]; it turns normals outwards.
_ABOVE = 3.0


def scan(condition: Condition, seed: int) -> PointCloud:
    """Return the scan of a condition's payload, in the frame S, of single precision as cameras give it.

    Parameters
    ----------
    condition : Condition
        Its payload, view, noise and number of points.
    seed : int
        Of the samples and the noise.

    Raises
    ------
    InputError
        If the view is "top" and the payload has no level top face, or nothing is in view.
    """
    payload = Payload.read(condition.payload)
    vertices = transform(payload.X_SP, payload.vertices)
    rng = np.random.default_rng(seed)
    if condition.view == "partial":
        import trimesh

        assert condition.viewpoint is not None
        mesh = trimesh.Trimesh(vertices, payload.faces, process=False)
        points = partial_view(mesh, condition.viewpoint, noise=condition.scan_noise, rng=rng).points
        viewpoint = np.asarray(condition.viewpoint)
    else:
        points = sample_surface(
            vertices, payload.faces.astype(np.int64), condition.points, seed=seed
        )
        viewpoint = None
        if condition.view == "top":
            points = points[points[:, 2] > points[:, 2].max() - _TOP]
            if len(points) < 100:
                raise InputError(
                    f"condition {condition.name!r}: the view 'top' needs a level top face, which {payload.name!r} has not; "
                    "full and partial accepted"
                )
            viewpoint = points.mean(axis=0) + [0.0, 0.0, _ABOVE]
        points = points + condition.scan_noise * rng.standard_normal(points.shape)
    cloud = PointCloud.read(points.astype(np.float32).astype(np.float64), viewpoint=viewpoint)
    return replace(cloud, path=f"../scans/{condition.name}.npz")


def write_scan(path: Path, cloud: PointCloud) -> None:
    """Write a scan as an .npz with `points` (N, 3) float32 [m] and, where known, `viewpoint` (3,) [m]."""
    arrays: dict[str, Any] = {"points": cloud.points.astype(np.float32)}
    if cloud.viewpoint is not None:
        arrays["viewpoint"] = cloud.viewpoint
    with replacing(path) as temporary:
        np.savez_compressed(temporary, **arrays)
