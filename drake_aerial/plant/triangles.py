"""Triangle meshes as arrays: reading, boxes, closed hulls and closest points."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from drake_aerial.cloud.readers import read_geometry
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, cross


def read(mesh: Any) -> tuple[Array, Array, str]:
    """Return vertices (V, 3), faces (F, 3) and a name, from a path, a trimesh.Trimesh or a pair of arrays.

    Raises
    ------
    InputError
        If the file is missing, of an unknown format, or holds no triangles.
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
            f"a {type(mesh).__name__} is no mesh; a path, a trimesh.Trimesh or (vertices, faces) accepted"
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
            f"mesh {name!r} has vertices {vertices.shape} and faces {faces.shape}; (V, 3), (F, 3) accepted"
        )
    if not np.isfinite(vertices).all() or faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError(
            f"mesh {name!r} has vertices that are not finite, or faces that name vertices it does not have"
        )
    return vertices, faces, name


def _load(path: Path) -> Any:
    import trimesh

    if not os.path.isfile(path):
        raise InputError(f"no mesh file {path}")
    geometry = read_geometry(path)
    if geometry.faces is None:
        raise InputError(f"{path} holds no triangles; a payload needs a mesh")
    # trimesh merges equal vertices, of which STL files have several for each corner.
    return trimesh.Trimesh(geometry.points, geometry.faces)


def box(size: Array) -> tuple[Array, Array]:
    """Return the 8 vertices and 12 outward triangles of a box of full edges `size` (3,), centred on the origin."""
    vertices = (
        0.5
        * size
        * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    )
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return vertices, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def convex_hull(points: Array) -> tuple[Array, Array]:
    """Return the vertices and outward triangles of the convex hull of points (N, 3) that span a volume."""
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
    away : (3,) array
        The thickening goes along the thinnest principal direction, to the side of this vector.

    Raises
    ------
    InputError
        If the points are fewer than three or lie on a line.
    """
    if len(points) < 3:
        raise InputError(
            f"a payload's hull needs 3 points or more that are not on a line; {len(points)} given"
        )
    deviation = points - points.mean(axis=0)
    spread, axes = np.linalg.eigh(deviation.T @ deviation)
    if spread[1] <= 1e-12 * spread[2]:
        raise InputError(
            "the scan's points lie on a line, or are all equal; a payload's hull needs a surface"
        )
    thickness = float(np.ptp(deviation @ axes[:, 0]))
    if thickness < depth:
        direction = axes[:, 0] if axes[:, 0] @ away >= 0.0 else -axes[:, 0]
        points = np.concatenate([points, points + (depth - thickness) * direction])
    try:
        return convex_hull(points)
    except QhullError as error:
        raise InputError("the scan's convex hull has no volume") from error


def closest_points(vertices: Array, faces: Array, points: Array) -> tuple[Array, Array, Array]:
    """Return the closest points on triangles to `points` (..., 3), with unit normals (..., 3) and distances (...)."""
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
    """Return the closest point (F, 3) of every triangle to p: inside its face, or on the nearest of its edges."""
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
