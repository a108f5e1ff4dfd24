"""Read the geometry of a cloud or mesh: files, arrays, Open3D and trimesh objects, all as one raw value."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_aerial.errors import InputError
from drake_aerial.io.archives import load_arrays

FORMATS = (".ply", ".pcd", ".obj", ".stl", ".npz", ".npy")
SOURCES = f"a file ({' '.join(FORMATS)}), an (N, 3) array, an Open3D point cloud or triangle mesh, or a trimesh mesh"


@dataclass(frozen=True, eq=False)
class RawGeometry:
    """What a source holds, before it is validated as a cloud.

    Attributes
    ----------
    points : (N, 3) array
        Points, or a mesh's vertices [m]; rows may be non-finite.
    faces : (F, 3) int array or None
        Triangles of a mesh; None for a cloud.
    label : str
        How messages name the source.
    path : str or None
        The file, where there is one.
    """

    points: NDArray[np.float64]
    faces: NDArray[np.int64] | None
    label: str
    path: str | None = None


def read_geometry(source: Any) -> RawGeometry:
    """Return the points, and triangles if any, of a file or object.

    Parameters
    ----------
    source : path, array, Open3D or trimesh object
        See `SOURCES`.

    Raises
    ------
    InputError
        If the source is of another kind, or cannot be read.
    """
    if isinstance(source, str | Path):
        return _read_file(Path(source))
    # First, since libraries have arrays of their own: a trimesh's vertices are one.
    if isinstance(source, np.ndarray | list | tuple):
        return RawGeometry(as_points(source, "the array"), None, "the array")
    library = type(source).__module__.split(".")[0]
    if library == "open3d":
        return _from_open3d(source)
    if library == "trimesh":
        return _from_trimesh(source, f"the trimesh {type(source).__name__}", None)
    raise InputError(f"cannot read a point cloud from a {type(source).__name__}; give {SOURCES}")


def as_points(values: Any, label: str) -> NDArray[np.float64]:
    """Return `values` as an (N, 3) float64 array, or raise InputError naming its shape or type."""
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise InputError(
            f"{label} should be an (N, 3) array of numbers: its rows differ in length"
        ) from error
    if array.dtype.kind not in "fiu":
        raise InputError(f"{label} should hold real numbers, got dtype {array.dtype}")
    if array.size == 0:
        raise InputError(f"{label} holds no points")
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{label} should be of shape (N, 3) but is of shape {array.shape}")
    return np.ascontiguousarray(array, dtype=np.float64)


def _read_file(path: Path) -> RawGeometry:
    suffix = path.suffix.lower()
    if not os.path.exists(path):
        raise InputError(f"no such file: {path}")
    if not os.path.isfile(path):
        raise InputError(f"{path} is not a file; give {SOURCES}")
    if suffix not in FORMATS:
        given = f"format {suffix!r}" if suffix else "no file extension"
        raise InputError(f"cannot read {path}: {given}; accepted formats are {' '.join(FORMATS)}")
    try:
        if path.stat().st_size == 0:
            raise InputError(f"{path} is empty (0 bytes)")
        if suffix in (".npy", ".npz"):
            return _read_numpy(path)
        if suffix == ".pcd":
            return _read_pcd(path)
        return _read_with_trimesh(path)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error


def _damaged(path: Path, why: object = "") -> InputError:
    reason = " ".join(str(why).split())
    kind = path.suffix[1:].upper()
    return InputError(
        f"cannot read {path}: not a valid {kind} file, or cut short"
        + (f" ({reason})" if reason else "")
    )


def _read_numpy(path: Path) -> RawGeometry:
    values = load_arrays(path)
    if isinstance(values, dict):
        if "points" not in values:
            raise InputError(
                f"{path} has no array named 'points'; it holds: {', '.join(values) or 'nothing'}"
            )
        values = values["points"]
    return RawGeometry(as_points(values, str(path)), None, str(path), str(path))


def _read_pcd(path: Path) -> RawGeometry:
    import open3d as o3d

    with open(path, "rb") as file:
        header = file.read(4096)
    declared = re.search(rb"^POINTS\s+(\d+)", header, re.MULTILINE)
    if declared is None or b"DATA" not in header:
        raise _damaged(path)
    if int(declared[1]) == 0:
        raise InputError(f"{path} holds no points")
    # Open3D makes room for what is declared; the best compression of a point's bytes is some 1 to 100.
    if int(declared[1]) > 100 * path.stat().st_size:
        raise _damaged(path, f"{int(declared[1])} points declared in {path.stat().st_size} bytes")
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
        cloud = o3d.io.read_point_cloud(path)
    points = np.asarray(cloud.points).copy()
    # Open3D reports a missing or broken file by returning an empty cloud.
    if len(points) == 0:
        raise _damaged(path)
    if len(points) != int(declared[1]):
        raise _damaged(path, f"{int(declared[1])} points declared, {len(points)} read")
    return RawGeometry(points, None, str(path), str(path))


def _read_with_trimesh(path: Path) -> RawGeometry:
    import trimesh

    declared = _ply_counts(path) if path.suffix.lower() == ".ply" else {}
    if declared.get("vertex") == 0:
        raise InputError(f"{path} holds no points")
    try:
        # process=False keeps vertices as they are; merging or dropping them is not the reader's business.
        loaded = trimesh.load(str(path), process=False)
    except OSError:
        raise
    except Exception as error:  # trimesh lets the parser's own exception through, of any type
        raise _damaged(path, error) from error
    geometry = _from_trimesh(loaded, str(path), str(path), empty=_damaged(path))
    read = {
        "vertex": len(geometry.points),
        "face": 0 if geometry.faces is None else len(geometry.faces),
    }
    for element, count in declared.items():
        # An ASCII file that was cut short parses without complaint.
        if read[element] < count:
            raise _damaged(path, f"{element} count {count} declared, {read[element]} read")
    return geometry


def _ply_counts(path: Path) -> dict[str, int]:
    """Return the numbers of vertices and faces that a PLY file's header declares."""
    with open(path, "rb") as file:
        header = file.read(65536).partition(b"end_header")[0]
    declared = re.findall(rb"^element\s+(vertex|face)\s+(\d+)", header, re.MULTILINE)
    return {name.decode(): int(count) for name, count in declared}


def _from_trimesh(
    loaded: Any, label: str, path: str | None, empty: InputError | None = None
) -> RawGeometry:
    import trimesh

    none = empty or InputError(f"{label} holds no points")
    if isinstance(loaded, trimesh.Scene):
        meshes = [
            mesh for mesh in loaded.dump() if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces)
        ]
        if not meshes:
            raise none
        loaded = trimesh.util.concatenate(meshes)
    if not hasattr(loaded, "vertices"):
        raise InputError(f"cannot read a point cloud from {label}; give {SOURCES}")
    vertices = np.asarray(loaded.vertices, dtype=np.float64)
    if vertices.size == 0:
        raise none
    faces = getattr(loaded, "faces", None)
    triangles = None if faces is None or len(faces) == 0 else np.asarray(faces, dtype=np.int64)
    return RawGeometry(as_points(vertices, label), triangles, label, path)


def _from_open3d(source: Any) -> RawGeometry:
    label = f"the Open3D {type(source).__name__}"
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
        raise InputError(f"cannot read a point cloud from {label}; give {SOURCES}")
    triangles = None if faces is None or len(faces) == 0 else np.array(faces, dtype=np.int64)
    return RawGeometry(as_points(points, label).copy(), triangles, label)
