"""Several views of one scene as one cloud."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from drake_aerial.cloud.point_cloud import PointCloud


def fuse_views(clouds: Sequence[PointCloud], poses: Sequence[Any] | None = None) -> PointCloud:
    """Return one cloud of several views, in the frame of the poses, or in that of the first view.

    Parameters
    ----------
    clouds : sequence of PointCloud
        The views, each in its own frame S.
    poses : sequence of Pose or pydrake RigidTransform, optional
        X_NS of each view. Without them, the views are registered with Open3D, each to those before
        it, from the identity on; that must be within some 20 deg and 20 cm of the truth.

    Raises
    ------
    InputError
        If there are fewer than two views, the numbers differ, or a view cannot be registered.
    """
    raise NotImplementedError
