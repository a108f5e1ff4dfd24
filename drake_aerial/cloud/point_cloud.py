"""Point clouds: read from any source, validated once.

Longer than 300 lines, since `PointCloud` documents every kind of input that it takes.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.cloud.assumptions import Assumption, AssumptionKind
from drake_aerial.cloud.boundary import Boundary
from drake_aerial.cloud.mesh_sampling import sample_surface
from drake_aerial.cloud.raw_geometry import RawGeometry
from drake_aerial.cloud.readers import read_geometry
from drake_aerial.cloud.sensor_axes import SensorAxes, camera_axes
from drake_aerial.cloud.stray_points import stray_points
from drake_aerial.cloud.validation import check_points, size_assumption
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, Pose, as_pose, rotate, transform


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
        Hash of the finite points as read (float64, little-endian). Transformations keep it.
    dropped_points : int
        Number of points that were dropped: not finite, or stray.
    assumptions : tuple of Assumption
        Assumptions made while reading, other than the defaults; empty for a clean cloud in
        metres with z up.
    up_is_known : bool
        False for a camera's points in its own axes whose `up` was not given.
    camera : dict or None
        Intrinsics of the depth camera, if the cloud was read from a depth image.
    topic : str or None
        Topic of the points, if the cloud was read from a bag.
    boundary : Boundary or None
        Where the object ends and where it is hidden or cut, if it was found in a scene.
    scene_object : dict or None
        Which object of which scene it is, for result files; None for a whole scan.

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
    assumptions: tuple[Assumption, ...] = ()
    up_is_known: bool = True
    camera: dict[str, Any] | None = None
    topic: str | None = None
    boundary: Boundary | None = None
    scene_object: dict[str, Any] | None = None

    def to_record(self) -> dict[str, Any]:
        """Return the cloud's record for result files: its source and identity; lengths in m."""
        record = {
            "path": self.path,
            "sha256": self.sha256,
            "points": len(self),
            "dropped_points": self.dropped_points,
            "centroid": self.centroid.tolist(),
            "up": self.up.tolist(),
            "viewpoint": None if self.viewpoint is None else self.viewpoint.tolist(),
        }
        if self.camera is not None:
            record["camera"] = self.camera
        if self.topic is not None:
            record["topic"] = self.topic
        if self.scene_object is not None:
            record["object"] = self.scene_object
        if self.assumptions:
            record["assumptions"] = [assumption.to_dict() for assumption in self.assumptions]
        return record

    @classmethod
    def read(
        cls,
        source: Any,
        *,
        viewpoint: ArrayLike | None = None,
        up: ArrayLike | None = None,
        samples: int = 20000,
    ) -> PointCloud:
        """Read and validate a cloud.

        Parameters
        ----------
        source : path, array or object
            A file (.ply .pcd .obj .stl .npz with `points`, .npy .xyz .txt .csv .pts .asc; with
            optional libraries .las .laz .e57), an array (N, 3), (H, W, 3) or with fields x, y, z
            [m], a cloud or triangle mesh of Open3D, a trimesh mesh, or a
            `pydrake.perception.PointCloud`. Meshes are sampled uniformly over their surface.
        viewpoint : (3,) array or pose, optional
            The sensor's position in the cloud's frame [m]; that of the file by default.
        up : (3,) array, optional
            Direction against gravity in the cloud's frame, of any positive length; z by default.
        samples : int
            Number of points sampled from a mesh.

        Raises
        ------
        InputError
            If the source cannot be read, is empty, holds no finite point, is of the wrong shape,
            has all its points equal or on a line, is larger than 50 m or smaller than 1 mm, or has
            coordinates too large for 32-bit floats.
        """
        viewpoint_S = None if viewpoint is None else position(viewpoint)
        up_S = _vector((0.0, 0.0, 1.0) if up is None else up, "up")
        length = np.linalg.norm(up_S)
        if length < 1e-9:
            raise InputError(f"`up` must be a direction of positive length, got {up_S.tolist()}")

        raw = read_geometry(source)
        points, assumptions = _points(raw, samples)
        finite = np.isfinite(points).all(axis=1)
        invalid = int(len(points) - finite.sum())
        if invalid == len(points):
            raise InputError(f"{raw.label}: all {len(points)} points are NaN or infinite")
        if invalid:
            assumptions.append(_dropped(f"{invalid} of {len(points)} points are NaN or infinite"))
        points = np.ascontiguousarray(points[finite])
        digest = hashlib.sha256(np.ascontiguousarray(points, dtype="<f8").tobytes()).hexdigest()
        stray = stray_points(points)
        if stray.any():
            text = f"{stray.sum()} of {len(points)} points are far from the rest, or invalid pixels"
            assumptions.append(_dropped(text))
            points = points[~stray]
        check_points(points, raw.label)
        assumptions += size_assumption(points)
        if raw.in_camera_axes:
            viewpoint_S = raw.viewpoint
        elif viewpoint_S is None and raw.viewpoint is not None:
            viewpoint_S = raw.viewpoint
            text = f"the sensor is at {viewpoint_S.tolist()}, by the file's viewpoint"
            assumptions.append(Assumption(AssumptionKind.OUTSIDE, text))
        known = True
        axes = _sensor_axes(raw, points, viewpoint_S)
        if axes is not None:
            known = up is not None or not axes.certain
            assumptions += _axes_assumptions(axes, up_is_given=up is not None)
            if axes.certain and viewpoint_S is None:
                viewpoint_S = np.zeros(3)
        points.setflags(write=False)
        return cls(
            points,
            viewpoint_S,
            up_S / length,
            raw.path,
            digest,
            invalid + int(stray.sum()),
            tuple(assumptions),
            known,
        )

    def require_up(self) -> None:
        """Check that the direction of gravity is known.

        Raises
        ------
        InputError
            If the cloud is a camera's view in the camera's axes, read without `up`.
        """
        if not self.up_is_known:
            text = next(a.text for a in self.assumptions if a.kind is AssumptionKind.UP)
            raise InputError(f"the scan is one camera's view in camera axes; up is {text}")

    def assuming(self, *assumptions: Assumption) -> PointCloud:
        """Return the cloud with additional assumptions."""
        return replace(self, assumptions=self.assumptions + assumptions)

    def from_camera(self, camera: dict[str, Any]) -> PointCloud:
        """Return the cloud with the intrinsics of its depth camera."""
        return replace(self, camera=camera)

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

    def transformed(self, X_NS: Any) -> PointCloud:
        """Return the same cloud, its viewpoint and up expressed in another frame N.

        Parameters
        ----------
        X_NS : Pose or pydrake RigidTransform
            One pose: the cloud's present frame S in N.
        """
        X_NS = as_pose(X_NS)
        viewpoint = None if self.viewpoint is None else transform(X_NS, self.viewpoint)
        return replace(
            self,
            points=transform(X_NS, self.points),
            viewpoint=viewpoint,
            up=rotate(X_NS.q, self.up),
            boundary=self.boundary and self.boundary.transformed(X_NS),
        )

    def cropped(self, lower: ArrayLike, upper: ArrayLike) -> PointCloud:
        """Return the points inside the closed box from `lower` to `upper`, each (3,) [m].

        Bounds may be infinite.

        Raises
        ------
        InputError
            If no point is inside.
        """
        lower, upper = np.asarray(lower, float), np.asarray(upper, float)
        inside = ((self.points >= lower) & (self.points <= upper)).all(axis=1)
        if not inside.any():
            raise InputError(
                f"no point of the cloud is inside the box {lower.tolist()} to {upper.tolist()}; "
                f"its points are in {self.points.min(axis=0).round(3).tolist()} to "
                f"{self.points.max(axis=0).round(3).tolist()}"
            )
        return replace(self, points=self.points[inside])

    def downsampled(self, voxel: float) -> PointCloud:
        """Return the mean of the distinct points in each occupied cube of side `voxel` [m].

        The means are sorted by cube; they do not depend on the points' order and repetition.
        """
        if not voxel > 0.0:
            raise InputError(f"`voxel` must be positive, got {voxel}")
        # The grid has an irrational offset: planes at round coordinates, as on boxes, would
        # otherwise lie between two cubes.
        cube = np.floor(self.points / voxel + 0.3819660112501051).astype(np.int64)
        cube -= cube.min(axis=0)
        size = cube.max(axis=0) + 1
        if np.prod(size.astype(float)) > 2**62:
            raise InputError(
                f"`voxel` must be at least about 1e-6 of the cloud's size of "
                f"{self.extent.max():.3g} m, got {voxel}"
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
        """Return the cloud with Gaussian noise of standard deviation `sigma` [m] on coordinates."""
        return replace(self, points=self.points + sigma * rng.standard_normal(self.points.shape))


def _points(raw: RawGeometry, samples: int) -> tuple[Array, list[Assumption]]:
    """Return the points of a cloud, or samples of a mesh, and what was assumed."""
    assumptions = list(raw.assumptions)
    if raw.faces is None:
        return raw.points, assumptions
    used = len(np.unique(raw.faces))
    if used < 0.5 * len(raw.points):
        text = (
            f"only {used} of {len(raw.points)} vertices belong to faces; "
            "the vertices are taken as points, without the faces"
        )
        return raw.points, [*assumptions, Assumption(AssumptionKind.FACES, text)]
    return sample_surface(raw.points, raw.faces, samples), assumptions


def _dropped(text: str) -> Assumption:
    return Assumption(AssumptionKind.DROPPED, text)


def _sensor_axes(raw: RawGeometry, points: Array, viewpoint: Array | None) -> SensorAxes | None:
    """Return the sensor's axes of a cloud that is, or could be, in a camera's axes."""
    if raw.in_camera_axes:
        return SensorAxes("z forward", True, "they come from a depth image")
    if raw.faces is not None or (viewpoint is not None and viewpoint.any()):
        return None
    return camera_axes(points, seen_from_origin=viewpoint is not None)


def _axes_assumptions(axes: SensorAxes, *, up_is_given: bool) -> list[Assumption]:
    """Return the assumptions on a cloud that is, or could be, one view in a camera's axes."""
    level = "0 -1 0" if axes.axes == "z forward" else "0 1 0"
    found = []
    if axes.certain:
        text = (
            f"the points are one camera's view from the origin, {axes.axes}: {axes.reason}; "
            "normals face the origin"
        )
        found.append(Assumption(AssumptionKind.AXES, text))
        if not up_is_given:
            text = f"unknown in camera axes; give --up X Y Z ({level} for a level camera)"
            found.append(Assumption(AssumptionKind.UP, text))
    elif not up_is_given:
        text = (
            f"0 0 1; but the points could be one camera's view in camera axes, {axes.axes}, since "
            f"{axes.reason}; then give --up X Y Z ({level} for a level camera)"
        )
        found.append(Assumption(AssumptionKind.UP, text))
    return found


def position(viewpoint: Any) -> Array:
    """Return the position (3,) of a viewpoint that is given as a vector or as a pose."""
    if isinstance(viewpoint, Pose) or hasattr(viewpoint, "translation"):
        viewpoint = as_pose(viewpoint).p
    return _vector(viewpoint, "viewpoint")


def _vector(values: ArrayLike, name: str) -> Array:
    try:
        vector = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"`{name}` must be three numbers, got {values!r}") from error
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InputError(f"`{name}` must be three finite numbers, got {values!r}")
    return vector
