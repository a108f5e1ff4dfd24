"""The visible surface as something a gripper can be set down on."""

from __future__ import annotations

import numpy as np

from drake_aerial.density.kernels import turned_to_axis
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array, Pose, axis_of

# Neighbours that a local plane is fitted to: enough to average a scan's noise over a gripper's footprint.
_NEIGHBOURS = 12
# A circle that holds so many samples in the middling case is empty, by chance, once in 400.
_HOLE = 6
# Radius of a vertical column, as a part of the features' neighbourhood.
_COLUMN = 0.8


class LocalSurface:
    """Closest places on the surface that the features of a cloud sample.

    Parameters
    ----------
    features : SurfaceFeatures
        Features of the cloud, in a frame N.
    """

    def __init__(self, features: SurfaceFeatures):
        from scipy.spatial import cKDTree

        self._features = features
        self._tree = cKDTree(features.p)
        self.points, self.normals = features.p, features.normal
        # Half a voxel's diagonal and some: the centre of a triangle of samples is no hole.
        near = self._tree.query(features.p, k=min(_HOLE + 1, len(features.p)))[0]
        self.spacing = float(np.median(near[:, 1])) * 1.5
        # Samples fall where they fall: this far from the nearest one is still surface.
        self.hole = max(float(np.median(near[:, -1])), self.spacing)

    def set_down(self, X_NG: Pose) -> tuple[Pose, Array, Array]:
        """Move grippers (...) along the surface's normal onto it, and give the surface there.

        Only surface on the gripper's own side counts, so that a thin plate's other face does not.

        Returns
        -------
        X_NG : Pose
            The grippers on the local plane, turned the smallest way that puts their z axes along its normal.
        normal : (..., 3) array
            Outward unit normals of the surface there.
        distance : (...) array
            Distance of the resulting positions from the nearest point of the cloud [m].
        """
        shape = X_NG.p.shape[:-1]
        p, z = X_NG.p.reshape(-1, 3), axis_of(X_NG.q, 2).reshape(-1, 3)
        count = min(_NEIGHBOURS, len(self.points))
        _, index = self._tree.query(p, k=min(4 * count, len(self.points)))
        index = index.reshape(len(p), -1)
        normals, points = self.normals[index], self.points[index]
        faces = np.sum(normals * z[:, None], axis=-1) > 0.0
        # The nearest `count` on this side; where there are none, the nearest of all.
        rank = np.cumsum(faces, axis=1)
        use = faces & (rank <= count)
        use[~use.any(axis=1), :count] = True
        weight = use / use.sum(axis=1, keepdims=True)
        normal = np.sum(weight[..., None] * normals, axis=1)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        centre = np.sum(weight[..., None] * points, axis=1)
        p = p + np.sum((centre - p) * normal, axis=1, keepdims=True) * normal
        distance = self._tree.query(p)[0]
        q = turned_to_axis(X_NG.q.reshape(-1, 4), normal)
        return (
            Pose(p.reshape(*shape, 3), q.reshape(*shape, 4)),
            normal.reshape(*shape, 3),
            np.asarray(distance).reshape(shape),
        )

    def above(self, xy: Array) -> tuple[Pose, Array]:
        """Return grippers (...) on the topmost surface at horizontal positions xy (..., 2), and its normals.

        Beside the object, the surface point nearest in the horizontal is taken.
        """
        shape = np.shape(xy)[:-1]
        flat = np.reshape(xy, (-1, 2))
        positions = np.empty((len(flat), 3))
        for k, at in enumerate(flat):
            square = np.sum((self.points[:, :2] - at) ** 2, axis=1)
            # Wide enough that a sparse scan has points of the top in it, not of the bottom alone.
            column = square <= max(
                float(square.min()) * 1.0001, (_COLUMN * self._features.rho) ** 2
            )
            positions[k] = *at, self.points[column, 2].max()
        upright = np.zeros((len(flat), 4))
        upright[:, 0] = 1.0
        X, normal, _ = self.set_down(Pose(positions, upright))
        return Pose(X.p.reshape(*shape, 3), X.q.reshape(*shape, 4)), normal.reshape(*shape, 3)
