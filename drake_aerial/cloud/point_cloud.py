"""Point clouds: read anything a user has, validate once at the boundary, trust inside."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.cloud.mesh_sampling import sample_surface
from drake_aerial.cloud.readers import as_points, read_geometry
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, Pose, rotate, transform

MAX_EXTENT = 50.0
MIN_EXTENT = 1e-3
# A cloud whose second principal spread is below this part of its first is a line: it has no surface.
LINE_RATIO = 1e-3


@dataclass(frozen=True, eq=False)
class PointCloud:
    """A validated point cloud in its own frame S.

    Attributes
    ----------
    points : (N, 3) array
        Finite points p_SP [m].
    viewpoint : (3,) array or None
        The sensor's position in S [m], where known; it orients normals.
    up : (3,) array
        Unit vector against gravity, in S.
    path : str or None
        The file the cloud was read from.
    sha256 : str
        Hash of the points as read (finite rows, float64 little-endian bytes); later transformations keep it.
    dropped_points : int
        Number of non-finite rows that were dropped, as depth cameras give them.

    Examples
    --------
    >>> import numpy as np
    >>> from drake_aerial import PointCloud
    >>> points = np.random.default_rng(0).uniform(-0.2, 0.2, (5000, 3)) * [1.0, 1.0, 0.0]
    >>> cloud = PointCloud.read(points, viewpoint=[0.0, 0.0, 1.0])
    >>> len(cloud), cloud.up.tolist()
    (5000, [0.0, 0.0, 1.0])
    """

    points: Array
    viewpoint: Array | None
    up: Array
    path: str | None
    sha256: str
    dropped_points: int

    def to_record(self) -> dict[str, Any]:
        """Return what files of results keep of the cloud: where it is from and how to know it again; lengths in metres."""
        return {
            "path": self.path,
            "sha256": self.sha256,
            "points": len(self),
            "dropped_points": self.dropped_points,
            "centroid": self.centroid.tolist(),
            "up": self.up.tolist(),
            "viewpoint": None if self.viewpoint is None else self.viewpoint.tolist(),
        }

    @classmethod
    def read(
        cls,
        source: Any,
        *,
        viewpoint: ArrayLike | None = None,
        up: ArrayLike = (0.0, 0.0, 1.0),
        samples: int = 20000,
    ) -> PointCloud:
        """Read and validate a cloud.

        Parameters
        ----------
        source : path, (N, 3) array, Open3D or trimesh object
            A file (.ply .pcd .obj .stl .npz with `points`, .npy), an array [m], an Open3D point cloud or triangle
            mesh (legacy or tensor), or a trimesh mesh. Meshes are sampled uniformly over their surface.
        viewpoint : (3,) array, optional
            The sensor's position in the cloud's frame [m].
        up : (3,) array
            Direction against gravity in the cloud's frame, of any positive length.
        samples : int
            Number of points sampled from a mesh.

        Raises
        ------
        InputError
            If the source cannot be read, is empty, holds no finite point, is of the wrong shape, has all its points
            equal or on a line, or is larger than 50 m or smaller than 1 mm.
        """
        viewpoint_S = None if viewpoint is None else _vector(viewpoint, "viewpoint")
        up_S = _vector(up, "up")
        length = np.linalg.norm(up_S)
        if length < 1e-9:
            raise InputError(f"up should be a direction of positive length, got {up_S.tolist()}")

        raw = read_geometry(source)
        points = raw.points if raw.faces is None else sample_surface(raw.points, raw.faces, samples)
        finite = np.isfinite(points).all(axis=1)
        dropped = int(len(points) - finite.sum())
        if dropped == len(points):
            raise InputError(f"{raw.label}: all {len(points)} points are NaN or infinite")
        points = np.ascontiguousarray(points[finite])
        _check_extent(points, raw.label)
        points.setflags(write=False)
        digest = hashlib.sha256(np.ascontiguousarray(points, dtype="<f8").tobytes()).hexdigest()
        return cls(points, viewpoint_S, up_S / length, raw.path, digest, dropped)

    def __len__(self) -> int:
        return len(self.points)

    @property
    def centroid(self) -> Array:
        """Mean of the points, (3,) [m]."""
        return self.points.mean(axis=0)

    @property
    def extent(self) -> Array:
        """Size of the axis-aligned bounding box, (3,) [m]."""
        return np.ptp(self.points, axis=0)

    def transformed(self, X_NS: Pose) -> PointCloud:
        """Return the same cloud, its viewpoint and up expressed in another frame N.

        Parameters
        ----------
        X_NS : Pose
            One pose: the cloud's present frame S in N.
        """
        viewpoint = None if self.viewpoint is None else transform(X_NS, self.viewpoint)
        return replace(
            self,
            points=transform(X_NS, self.points),
            viewpoint=viewpoint,
            up=rotate(X_NS.q, self.up),
        )

    def cropped(self, lower: ArrayLike, upper: ArrayLike) -> PointCloud:
        """Return the points inside the closed box `lower` to `upper`, each (3,) [m]; infinite bounds are allowed.

        Raises
        ------
        InputError
            If no point is inside.
        """
        lower, upper = np.asarray(lower, float), np.asarray(upper, float)
        inside = ((self.points >= lower) & (self.points <= upper)).all(axis=1)
        if not inside.any():
            raise InputError(
                f"no point of the cloud is inside the box {lower.tolist()} to {upper.tolist()}; its points span "
                f"{self.points.min(axis=0).round(3).tolist()} to {self.points.max(axis=0).round(3).tolist()}"
            )
        return replace(self, points=self.points[inside])

    def downsampled(self, voxel: float) -> PointCloud:
        """Return one point per occupied cube of side `voxel` [m]: the mean of its distinct points, sorted by cube.

        The result does not depend on the order of the points nor on repeated ones.
        """
        if not voxel > 0.0:
            raise InputError(f"the voxel size must be positive, got {voxel}")
        # The grid is shifted by the golden ratio's fraction: planes at round coordinates, as on boxes, would otherwise
        # lie on a boundary between cubes, where rounding decides.
        cube = np.floor(self.points / voxel + 0.3819660112501051).astype(np.int64)
        cube -= cube.min(axis=0)
        size = cube.max(axis=0) + 1
        if np.prod(size.astype(float)) > 2**62:
            raise InputError(
                f"a voxel of {voxel} m is too small for a cloud of {self.extent.max():.3g} m"
            )
        key = (cube[:, 0] * size[1] + cube[:, 1]) * size[2] + cube[:, 2]
        x, y, z = self.points.T
        order = np.lexsort((z, y, x, key))
        key, points = key[order], self.points[order]
        distinct = np.append(True, (np.diff(points, axis=0) != 0.0).any(axis=1))
        key, points = key[distinct], points[distinct]
        starts = np.flatnonzero(np.append(True, np.diff(key) != 0))
        counts = np.diff(np.append(starts, len(key)))
        return replace(self, points=np.add.reduceat(points, starts, axis=0) / counts[:, None])

    def with_noise(self, sigma: float, rng: np.random.Generator) -> PointCloud:
        """Return the cloud with Gaussian noise of standard deviation `sigma` [m] on every coordinate."""
        return replace(self, points=self.points + sigma * rng.standard_normal(self.points.shape))


def _vector(values: ArrayLike, name: str) -> Array:
    try:
        vector = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} should be three numbers, got {values!r}") from error
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InputError(f"{name} should be three finite numbers, got {values!r}")
    return vector


def _check_extent(points: Array, label: str) -> None:
    points = as_points(points, label)
    largest = float(np.ptp(points, axis=0).max())
    if largest == 0.0:
        raise InputError(f"{label}: all {len(points)} points are equal; a surface is needed")
    if largest > MAX_EXTENT:
        raise InputError(
            f"{label}: the cloud is {largest:.4g} m large, more than {MAX_EXTENT:g} m; "
            "are these millimetres given as metres? Metres are expected"
        )
    if largest < MIN_EXTENT:
        raise InputError(
            f"{label}: the cloud is {largest:.3g} m large, less than 1 mm; are the units right? Metres are expected"
        )
    spread = np.linalg.eigvalsh(np.cov((points - points.mean(axis=0)).T))
    if spread[1] <= LINE_RATIO**2 * spread[2]:
        raise InputError(f"{label}: all {len(points)} points lie on a line; a surface is needed")
