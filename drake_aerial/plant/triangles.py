"""Triangle meshes as arrays: reading, boxes, convex hulls and closest points."""

import os
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from drake_aerial.cloud.readers import read_geometry
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, cross


def read(mesh: Any) -> tuple[Array, Array, str]:
    """Return vertices (V, 3), faces (F, 3) and a name of a mesh.

    Parameters
    ----------
    mesh : path, trimesh.Trimesh, or pair of vertices (V, 3) and faces (F, 3)

    Raises
    ------
    InputError
        If the mesh is of another type, its file is missing or of an unknown format, or it has no
        triangles.
    """
    name = "payload"
    if isinstance(mesh, (str, Path)):
        mesh, name = _load(Path(mesh)), Path(mesh).stem
    if isinstance(mesh, tuple):
        vertices, faces = mesh
    elif hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        vertices, faces = mesh.vertices, mesh.faces
    else:
        raise InputError(
            "`mesh` must be a path, a trimesh.Trimesh or a pair (vertices, faces), "
            f"got a {type(mesh).__name__}"
        )
    vertices, faces = np.array(vertices, dtype=float), np.array(faces, dtype=np.int64)
    if (
        vertices.ndim != 2
        or vertices.shape[1] != 3
        or faces.ndim != 2
        or faces.shape[1] != 3
        or len(faces) == 0
    ):
        raise InputError(
            f"mesh {name!r} must have vertices (V, 3) and faces (F, 3), F > 0, "
            f"got {vertices.shape} and {faces.shape}"
        )
    if not np.isfinite(vertices).all() or faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError(
            f"mesh {name!r} must have finite vertices and faces that index its vertices"
        )
    return vertices, faces, name


def _load(path: Path) -> Any:
    import trimesh

    if not os.path.isfile(path):
        raise InputError(f"no such file: {path}")
    geometry = read_geometry(path)
    if geometry.faces is None:
        raise InputError(f"{path} holds no triangles; a payload needs a mesh")
    # trimesh merges equal vertices, of which STL files have several for each corner.
    return trimesh.Trimesh(geometry.points, geometry.faces)


def box(size: Array) -> tuple[Array, Array]:
    """Return the 8 vertices and 12 outward triangles of a box of edges `size` (3,) about 0."""
    vertices = (
        0.5
        * size
        * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    )
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return vertices, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def convex_hull(points: Array) -> tuple[Array, Array]:
    """Return the vertices and outward triangles of the convex hull of points (N, 3)."""
    hull = ConvexHull(points)
    index = np.full(len(points), -1)
    index[hull.vertices] = np.arange(len(hull.vertices))
    faces = index[hull.simplices]
    vertices = points[hull.vertices]
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    inward = np.einsum("ij,ij->i", cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return vertices, faces


def closed_hull(points: Array, depth: float, away: Array) -> tuple[Array, Array]:
    """Return the convex hull of points (N, 3), thickened to `depth` [m] if it is thinner.

    Parameters
    ----------
    points : (N, 3) array
    depth : float
    away : (3,) array
        The hull is thickened along its thinnest principal direction, on the side of this vector.

    Raises
    ------
    InputError
        If there are fewer than three points or all lie on a line.
    """
    if len(points) < 3:
        raise InputError(f"the hull of a scan needs 3 points or more, got {len(points)}")
    deviation = points - points.mean(axis=0)
    spread, axes = np.linalg.eigh(deviation.T @ deviation)
    if spread[1] <= 1e-12 * spread[2]:
        raise InputError(
            "the points of a scan must span a surface, but they lie on a line or are all equal"
        )
    thickness = float(np.ptp(deviation @ axes[:, 0]))
    if thickness < depth:
        direction = axes[:, 0] if axes[:, 0] @ away >= 0.0 else -axes[:, 0]
        points = np.concatenate([points, points + (depth - thickness) * direction])
    try:
        return convex_hull(points)
    except QhullError as error:
        raise InputError(
            "the convex hull of a scan must have a volume: check the scan's points"
        ) from error


def is_inside_hull(vertices: Array, faces: Array, points: Array) -> Array:
    """Return which points (N, 3) are inside a convex hull with outward triangles, (N,)."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    normal = cross(b - a, c - a)
    return (points @ normal.T <= np.einsum("ij,ij->i", a, normal)).all(axis=1)


def closest_points(vertices: Array, faces: Array, points: Array) -> tuple[Array, Array, Array]:
    """Return the points on triangles closest to `points` (..., 3), normals and distances.

    Normals (..., 3) are the unit normals of the triangles, distances (...) are unsigned.
    """
    flat = points.reshape(-1, 3)
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    normal = cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    usable = area > 0.0
    a, b, c, normal = a[usable], b[usable], c[usable], normal[usable] / area[usable, None]
    found = np.empty_like(flat)
    normals = np.empty_like(flat)
    for i, p in enumerate(flat):
        q = _closest_on_triangles(p, a, b, c, normal)
        best = int(np.argmin(np.einsum("ij,ij->i", q - p, q - p)))
        found[i], normals[i] = q[best], normal[best]
    distances = np.linalg.norm(found - flat, axis=1)
    return (
        found.reshape(points.shape),
        normals.reshape(points.shape),
        distances.reshape(points.shape[:-1]),
    )


def _closest_on_triangles(p: Array, a: Array, b: Array, c: Array, normal: Array) -> Array:
    """Return the points (F, 3) of all triangles that are closest to p."""
    inside = np.ones(len(a), dtype=bool)
    best, best_d2 = np.empty_like(a), np.full(len(a), np.inf)
    for u, v in ((a, b), (b, c), (c, a)):
        edge = v - u
        inside &= np.einsum("ij,ij->i", cross(edge, p - u), normal) >= 0.0
        t = np.clip(
            np.einsum("ij,ij->i", p - u, edge) / np.einsum("ij,ij->i", edge, edge), 0.0, 1.0
        )
        q = u + t[:, None] * edge
        d2 = np.einsum("ij,ij->i", q - p, q - p)
        nearer = d2 < best_d2
        best[nearer], best_d2[nearer] = q[nearer], d2[nearer]
    on_face = p - np.einsum("ij,ij->i", p - a, normal)[:, None] * normal
    best[inside] = on_face[inside]
    return best
