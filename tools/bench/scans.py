"""Scans for the benches: boxes, and shipped and made meshes, at a random yaw and place."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from drake_aerial.cloud.partial_views import partial_view
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.geometry import Pose, quat_about_axis, transform
from drake_aerial.io.model_files import models_dir

POINTS = 20_000
Z = np.array([0.0, 0.0, 1.0])


def box_scan(
    size: tuple[float, float, float],
    rng: np.random.Generator,
    view: str = "full",
    cut: str = "none",
) -> np.ndarray:
    """Return points (N, 3) drawn uniformly from a box's faces, centred on the origin [m].

    `view` is `full` or `top`; `cut` takes away a 15 cm `strip` at one end or a 20 cm `corner`.
    """
    s = np.asarray(size)
    faces = (
        [(2, 1.0)] if view == "top" else [(axis, sign) for axis in range(3) for sign in (-1.0, 1.0)]
    )
    areas = np.array([np.prod(np.delete(s, axis)) for axis, _ in faces])
    # As dense as a full view of 20,000 points.
    full = 2.0 * (s[0] * s[1] + s[1] * s[2] + s[0] * s[2])
    points = rng.uniform(-0.5, 0.5, (int(POINTS * areas.sum() / full), 3))
    face = rng.choice(len(faces), len(points), p=areas / areas.sum())
    for k, (axis, sign) in enumerate(faces):
        points[face == k, axis] = 0.5 * sign
    points *= s
    if cut == "strip":
        points = points[points[:, 0] < 0.5 * s[0] - 0.15]
    elif cut == "corner":
        points = points[~np.all(points[:, :2] > 0.5 * s[:2] - 0.2, axis=1)]
    return points


def placed(
    points: np.ndarray, rng: np.random.Generator, viewpoint: np.ndarray | None
) -> tuple[PointCloud, Pose]:
    """Return the cloud at a random yaw and place, and X_SB, the object's frame in the cloud's."""
    yaw = rng.uniform(-np.pi, np.pi)
    X_SB = Pose(rng.uniform(-1.0, 1.0, 3), quat_about_axis(Z, np.asarray(yaw)))
    seen_from = None if viewpoint is None else transform(X_SB, viewpoint)
    return PointCloud.read(transform(X_SB, points), viewpoint=seen_from), X_SB


def box_query(
    size: tuple[float, float, float], view: str = "full", noise: float = 0.0, cut: str = "none"
):
    """Return a function of a generator that scans a box."""

    def scan(rng: np.random.Generator) -> tuple[PointCloud, Pose]:
        points = box_scan(size, rng, view, cut)
        points = points + noise * rng.standard_normal(points.shape)
        viewpoint = np.array([0.0, 0.0, 3.0]) if view == "top" else None
        return placed(points, rng, viewpoint)

    return scan


def camera_query(mesh_of: Callable):
    """Return a function of a generator: scan from one side by a depth camera, 2 mm of noise."""

    def scan(rng: np.random.Generator) -> tuple[PointCloud, Pose]:
        bearing = rng.uniform(-np.pi, np.pi)
        viewpoint = np.array([1.1 * np.cos(bearing), 1.1 * np.sin(bearing), 1.0])
        cloud = partial_view(mesh_of(), viewpoint, noise=0.002, rng=rng)
        return placed(cloud.points, rng, viewpoint)

    return scan


def box_mesh(size: tuple[float, float, float]):
    import trimesh

    return trimesh.creation.box(extents=size)


def terrace_mesh(x: tuple[float, ...], y: tuple[float, ...], height: np.ndarray):
    """Return an object of several levels, standing on z = 0 [m].

    A column of `height` (X, Y) stands on each cell between the grid lines x (X + 1) and y (Y + 1).
    The centre of mass of the homogeneous object is over the origin.
    """
    import trimesh

    h = np.asarray(height, float)
    x_, y_ = np.asarray(x, float), np.asarray(y, float)
    weight = h * np.diff(x_)[:, None] * np.diff(y_)
    x_ = x_ - np.sum(weight * (0.5 * (x_[1:] + x_[:-1]))[:, None]) / weight.sum()
    y_ = y_ - np.sum(weight * 0.5 * (y_[1:] + y_[:-1])) / weight.sum()
    quads = []
    padded = np.pad(h, 1)
    for i, j in np.argwhere(h > 0.0):
        a, b, c, d, top = x_[i], x_[i + 1], y_[j], y_[j + 1], h[i, j]
        quads += [
            [(a, c, top), (b, c, top), (b, d, top), (a, d, top)],
            [(a, c, 0), (a, d, 0), (b, d, 0), (b, c, 0)],
        ]
        # Walls down to each neighbour's level, outward on the side of this column.
        for (k, m), (p, q) in zip(
            ((i, j + 1), (i + 2, j + 1), (i + 1, j), (i + 1, j + 2)),
            (((a, d), (a, c)), ((b, c), (b, d)), ((a, c), (b, c)), ((b, d), (a, d))),
            strict=True,
        ):
            low = padded[k, m]
            if low < top:
                quads.append([(*p, low), (*q, low), (*q, top), (*p, top)])
    vertices = np.array(quads).reshape(-1, 3)
    first = 4 * np.arange(len(quads))[:, None]
    faces = np.vstack([first + [0, 1, 2], first + [0, 2, 3]])
    return trimesh.Trimesh(vertices, faces, process=True)


def mesh_query(mesh_of: Callable, noise: float = 0.001, cut: str = "none"):
    """Return a function of a generator that scans a mesh in full; `cut` as for `box_scan`."""

    def scan(rng: np.random.Generator) -> tuple[PointCloud, Pose]:
        points = mesh_points(mesh_of(), rng)
        size = np.ptp(points, axis=0)
        limit = points.max(axis=0)
        if cut == "strip":
            points = points[points[:, 0] < limit[0] - min(0.15, 0.25 * size[0])]
        elif cut == "corner":
            points = points[~np.all(points[:, :2] > limit[:2] - 0.2, axis=1)]
        return placed(points + noise * rng.standard_normal(points.shape), rng, None)

    return scan


def ellipsoid():
    """Return an ellipsoid of half axes 22, 16 and 12 cm, standing on z = 0."""
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions=4)
    mesh.apply_scale([0.22, 0.16, 0.12])
    mesh.apply_translation([0.0, 0.0, 0.12])
    return mesh


@cache
def curved_mesh(name: str):
    """Return a shipped mesh, or the ellipsoid, as a trimesh object [m]."""
    import trimesh

    return (
        ellipsoid()
        if name == "ellipsoid"
        else trimesh.load(models_dir() / "meshes" / f"{name}.obj", force="mesh")
    )


def above_centroid(mesh) -> np.ndarray:
    """Return the topmost point (3,) of a mesh over its volume centroid [m]."""
    a, b, c = (mesh.triangles[:, k] for k in range(3))
    at = mesh.center_mass[:2]
    # Barycentric coordinates, seen from above, of the vertical through the centroid.
    T = np.stack([a[:, :2] - c[:, :2], b[:, :2] - c[:, :2]], axis=-1)
    T = T + 1e-12 * np.eye(2)
    uv = np.linalg.solve(T, (at - c[:, :2])[..., None])[..., 0]
    w = np.column_stack([uv, 1.0 - uv.sum(axis=1)])
    hit = np.all(w >= -1e-9, axis=1)
    z = np.sum(w[hit] * mesh.triangles[hit][:, :, 2], axis=1)
    return np.array([*at, z.max()])


def mesh_points(mesh, rng: np.random.Generator) -> np.ndarray:
    """Return points (N, 3) drawn uniformly from a mesh [m]."""
    import trimesh

    return np.asarray(trimesh.sample.sample_surface(mesh, POINTS, seed=rng)[0])


def curved_query(name: str):
    """Return a function of a generator that scans a curved object in full, with 1 mm noise."""

    def scan(rng: np.random.Generator) -> tuple[PointCloud, Pose]:
        points = mesh_points(curved_mesh(name), rng)
        return placed(points + 0.001 * rng.standard_normal(points.shape), rng, None)

    return scan
