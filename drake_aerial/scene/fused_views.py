"""Several views of one scene as one cloud."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from drake_aerial.cloud.assumptions import Assumption, AssumptionKind
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, Pose, as_pose, identity, quat_from_matrix

# Registration: cube sides [m] from coarse to fine, and the least share of points with a partner.
_CUBES, _LEAST_FITNESS = (0.04, 0.02, 0.01), 0.5


def fuse_views(clouds: Sequence[PointCloud], poses: Sequence[Any] | None = None) -> PointCloud:
    """Return one cloud of several views, in the frame of the poses, or in that of the first view.

    The cloud has no viewpoint. Its `up` is that of the first view.

    Parameters
    ----------
    clouds : sequence of PointCloud
        The views, each in its own frame S.
    poses : sequence of Pose or pydrake RigidTransform, optional
        X_NS of each view. Without them, each view is registered to those before it with Open3D,
        from the identity on, which must be within some 10 deg and 5 cm of the truth.

    Raises
    ------
    InputError
        If there are fewer than two views, the numbers differ, or a view cannot be registered.

    Examples
    --------
    >>> import numpy as np
    >>> from drake_aerial import PointCloud, fuse_views
    >>> from drake_aerial.geometry import Pose
    >>> points = np.random.default_rng(0).uniform(-0.2, 0.2, (1000, 3))
    >>> left, right = (PointCloud.read(points, viewpoint=[x, 0.0, 1.0]) for x in (-1.0, 1.0))
    >>> identity = Pose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    >>> len(fuse_views([left, right], [identity, identity]))
    2000
    """
    if len(clouds) < 2:
        raise InputError(f"`clouds` must have at least two views, got {len(clouds)}")
    if poses is not None and len(poses) != len(clouds):
        raise InputError(
            f"`poses` must have one pose for each of the {len(clouds)} views, got {len(poses)}"
        )
    assumptions: tuple[Assumption, ...] = ()
    if poses is not None:
        placed = [as_pose(pose) for pose in poses]
    else:
        placed = [identity()]
        points = clouds[0].points
        for number, cloud in enumerate(clouds[1:], start=2):
            placed.append(_register(cloud.points, points, number))
            points = np.concatenate([points, cloud.transformed(placed[-1]).points])
        text = f"{len(clouds)} views were registered with each other, from their given frames on"
        assumptions = (Assumption(AssumptionKind.AXES, text),)
    moved = [cloud.transformed(pose) for cloud, pose in zip(clouds, placed, strict=True)]
    points = np.ascontiguousarray(np.concatenate([cloud.points for cloud in moved]))
    points.setflags(write=False)
    return replace(
        moved[0],
        points=points,
        viewpoint=None,
        path=None,
        sha256=hashlib.sha256(np.ascontiguousarray(points, dtype="<f8").tobytes()).hexdigest(),
        dropped_points=sum(cloud.dropped_points for cloud in clouds),
        assumptions=assumptions,
        camera=None,
        topic=None,
    )


def _register(points: Array, target: Array, number: int) -> Pose:
    """Return X_NS of points (N, 3) by point-to-plane ICP on a target (M, 3).

    Raises
    ------
    InputError
        If too few points find a partner.
    """
    import open3d

    registration = open3d.pipelines.registration
    source_cloud, target_cloud = (
        open3d.geometry.PointCloud(open3d.utility.Vector3dVector(values.copy()))
        for values in (points, target)
    )
    X = np.eye(4)
    for cube in _CUBES:
        source, goal = (cloud.voxel_down_sample(cube) for cloud in (source_cloud, target_cloud))
        goal.estimate_normals(open3d.geometry.KDTreeSearchParamHybrid(3.0 * cube, 30))
        result = registration.registration_icp(
            source,
            goal,
            2.0 * cube,
            X,
            registration.TransformationEstimationPointToPlane(),
            registration.ICPConvergenceCriteria(max_iteration=50),
        )
        X = np.asarray(result.transformation)
    if result.fitness < _LEAST_FITNESS:
        raise InputError(
            f"view {number} cannot be registered: {100.0 * result.fitness:.0f} % of its points "
            "meet the other views; give the views' poses"
        )
    return Pose(X[:3, 3].copy(), quat_from_matrix(X[:3, :3]))
