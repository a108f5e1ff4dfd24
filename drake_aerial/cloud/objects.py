"""Read the geometry of Python objects: arrays, and clouds and meshes of other libraries."""

from __future__ import annotations

from typing import Any

import numpy as np

from drake_aerial.cloud.assumptions import Assumption, AssumptionKind
from drake_aerial.cloud.coordinate_names import coordinate_names
from drake_aerial.cloud.raw_geometry import RawGeometry, as_points
from drake_aerial.errors import InputError

OBJECTS = (
    "an (N, 3), (H, W, 3) or structured array, an Open3D point cloud or triangle mesh, "
    "a trimesh mesh, or a pydrake.perception.PointCloud"
)
# Columns beyond x, y, z that are ignored: intensity, or colour, or normals.
_COLUMNS = (4, 5, 6)


def from_object(source: Any) -> RawGeometry | None:
    """Return the geometry of an object, or None if it is of no known kind."""
    if isinstance(source, RawGeometry):
        return source
    # Arrays first: libraries have subclasses of them, such as a trimesh's vertices.
    if isinstance(source, np.ndarray | list | tuple):
        try:
            return from_array(np.asanyarray(source), "the array")
        except ValueError as error:
            if isinstance(error, InputError):
                raise
            return RawGeometry(as_points(source, "the array"), None, "the array")
    label = type(source).__name__
    library = type(source).__module__.split(".")[0]
    if library == "open3d":
        return _from_open3d(source, f"the Open3D {label}")
    if library == "trimesh":
        return _from_trimesh(source, f"the trimesh {label}")
    if library == "pydrake" and hasattr(source, "has_xyzs"):
        if not source.has_xyzs():
            raise InputError("the pydrake PointCloud has no xyzs")
        return RawGeometry(as_points(source.xyzs().T, "the pydrake PointCloud"), None, label)
    if hasattr(source, "to_records"):
        return from_array(source.to_records(index=False), f"the {label}")
    if hasattr(source, "__array__") or hasattr(source, "__buffer__"):
        return from_array(np.asarray(source), f"the {label}")
    return None


def from_array(array: np.ndarray, label: str, path: str | None = None) -> RawGeometry:
    """Return the points of an array: plain, organised in rows of pixels, or structured.

    Raises
    ------
    InputError
        If no three columns or fields are x, y and z.
    """
    if isinstance(array, np.ma.MaskedArray) and array.dtype.kind in "fiu":
        array = np.ma.filled(array.astype(float), np.nan)
    if array.dtype.names:
        names = coordinate_names(array.dtype.names)
        if names is None:
            raise InputError(
                f"{label} must have fields x, y, z or f0, f1, f2, got "
                f"{', '.join(array.dtype.names)}"
            )
        array = np.stack([array[name].ravel() for name in names], axis=1)
    assumptions: tuple[Assumption, ...] = ()
    if array.ndim == 3 and array.shape[2] in (3, *_COLUMNS):
        array = array.reshape(-1, array.shape[2])
    if array.ndim == 2 and array.shape[1] in _COLUMNS and len(array):
        text = f"the first three of {array.shape[1]} columns of {label} are x, y, z; others ignored"
        assumptions = (Assumption(AssumptionKind.AXES, text),)
        array = array[:, :3]
    elif array.ndim == 2 and array.shape[1] != 3 and array.size:
        hint = "; take the columns of x, y, z, such as [:, :3]"
        if array.shape[0] == 3:
            hint = "; transpose it by .T"
        elif array.shape[1] > 30:
            hint = "; a depth image needs its camera: drake_aerial.read_depth_image"
        elif array.shape[1] < 3:
            hint = ""
        raise InputError(f"{label} must be of shape (N, 3), got {array.shape}{hint}")
    return RawGeometry(as_points(array, label), None, label, path, assumptions=assumptions)


def _from_trimesh(loaded: Any, label: str) -> RawGeometry:
    import trimesh

    empty = InputError(f"{label} holds no points")
    if isinstance(loaded, trimesh.Scene):
        meshes = [
            mesh for mesh in loaded.dump() if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces)
        ]
        if not meshes:
            raise empty
        loaded = trimesh.util.concatenate(meshes)
    if not hasattr(loaded, "vertices"):
        raise InputError(f"cannot read a point cloud from {label}; give {OBJECTS}")
    vertices = np.asarray(loaded.vertices, dtype=np.float64)
    if vertices.size == 0:
        raise empty
    faces = getattr(loaded, "faces", None)
    triangles = None if faces is None or len(faces) == 0 else np.asarray(faces, dtype=np.int64)
    return RawGeometry(as_points(vertices, label), triangles, label)


def _from_open3d(source: Any, label: str) -> RawGeometry:
    faces = None
    if hasattr(source, "point") or hasattr(source, "vertex"):  # tensor geometries
        attributes = source.vertex if hasattr(source, "vertex") else source.point
        if "positions" not in attributes:
            raise InputError(f"{label} holds no points")
        points = attributes.positions.cpu().numpy()
        if hasattr(source, "triangle") and "indices" in source.triangle:
            faces = source.triangle.indices.cpu().numpy()
    elif hasattr(source, "points") and not hasattr(source, "lines"):
        points = np.asarray(source.points)
    elif hasattr(source, "triangles"):
        points, faces = np.asarray(source.vertices), np.asarray(source.triangles)
    else:
        raise InputError(f"cannot read a point cloud from {label}; give {OBJECTS}")
    triangles = None if faces is None or len(faces) == 0 else np.array(faces, dtype=np.int64)
    return RawGeometry(as_points(points, label).copy(), triangles, label)
