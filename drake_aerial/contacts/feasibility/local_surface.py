"""The visible surface of a cloud, onto which grippers are projected."""

import numpy as np

from drake_aerial.density.kernels import turned_to_axis
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array, Pose, axis_of

# Number of neighbours of a local plane: they average a scan's noise over a gripper's footprint.
_NEIGHBOURS = 12
# A circle that contains 6 samples on average is empty with probability 1/400.
_HOLE = 6
# Radius of a vertical column, over the radius of the features' neighbourhood.
_COLUMN = 0.8


class LocalSurface:
    """Visible surface of a cloud, approximated by local planes through its features.

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
        # Larger than half a voxel's diagonal: the centre of a triangle of samples is no hole.
        near = self._tree.query(features.p, k=min(_HOLE + 1, len(features.p)))[0]
        self.spacing = float(np.median(near[:, 1])) * 1.5
        # Samples are irregular: the surface extends up to this distance from the nearest one.
        self.hole = max(float(np.median(near[:, -1])), self.spacing)

    def set_down(self, X_NG: Pose) -> tuple[Pose, Array, Array]:
        """Move grippers X_NG (...) along the surface's normal onto the surface.

        Only samples whose normals agree with the gripper's axis count, so that the other face of a
        thin plate does not.

        Returns
        -------
        X_NG : Pose
            Grippers on the local plane, turned by the smallest angle until their z axes are along
            its normal.
        normal : (..., 3) array
            Outward unit normals of the surface there.
        distance : (...) array
            Distances of the resulting positions from the nearest point of the cloud [m].
        """
        shape = X_NG.p.shape[:-1]
        p, z = X_NG.p.reshape(-1, 3), axis_of(X_NG.q, 2).reshape(-1, 3)
        count = min(_NEIGHBOURS, len(self.points))
        _, index = self._tree.query(p, k=min(4 * count, len(self.points)))
        index = index.reshape(len(p), min(4 * count, len(self.points)))
        normals, points = self.normals[index], self.points[index]
        faces = np.sum(normals * z[:, None], axis=-1) > 0.0
        # The nearest `count` samples on this side; if there are none, the nearest of all.
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

    def nearest(self, X_NG: Pose) -> Pose:
        """Move grippers X_NG (...) to the nearest surface that faces their way, and set them down.

        A surface that faces another way counts as further away: by up to two radii of the
        features' neighbourhood. On the rim of a thin wall, none may face their way.
        """
        shape = X_NG.p.shape[:-1]
        p, z = X_NG.p.reshape(-1, 3), axis_of(X_NG.q, 2).reshape(-1, 3)
        moved = np.empty_like(p)
        for k in range(len(p)):
            offset = p[k] - self.points
            turned = 2.0 * self._features.rho**2 * (1.0 - self.normals @ z[k])
            near = int(np.argmin(np.sum(offset**2, axis=1) + turned))
            normal, place = self.normals[near], self.points[near]
            # On the sample's plane, unless its surface ends before.
            along = offset[near] - (offset[near] @ normal) * normal
            moved[k] = place + along * min(
                1.0, self.hole / max(float(np.linalg.norm(along)), 1e-12)
            )
        X, _, _ = self.set_down(Pose(moved.reshape(*shape, 3), X_NG.q))
        return X

    def above(self, xy: Array) -> tuple[Pose, Array]:
        """Return grippers (...) on the topmost surface at positions xy (..., 2), and its normals.

        Beside the object, the horizontally nearest surface is used.
        """
        shape = np.shape(xy)[:-1]
        flat = np.reshape(xy, (-1, 2))
        positions = np.empty((len(flat), 3))
        for k, at in enumerate(flat):
            square = np.sum((self.points[:, :2] - at) ** 2, axis=1)
            # Wide enough to contain points of the top face in a sparse scan.
            column = square <= max(
                float(square.min()) * 1.0001, (_COLUMN * self._features.rho) ** 2
            )
            positions[k] = *at, self.points[column, 2].max()
        upright = np.zeros((len(flat), 4))
        upright[:, 0] = 1.0
        X, normal, _ = self.set_down(Pose(positions, upright))
        return Pose(X.p.reshape(*shape, 3), X.q.reshape(*shape, 4)), normal.reshape(*shape, 3)
