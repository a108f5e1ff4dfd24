"""Partial views: the points of a mesh that a depth camera sees."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.cloud.readers import read_geometry
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, perpendicular

# Field of view of a camera that is fitted to the mesh, relative to the smallest one.
_MARGIN = 1.05


def partial_view(
    mesh: Any,
    viewpoint: ArrayLike,
    *,
    target: ArrayLike | None = None,
    resolution: tuple[int, int] = (320, 240),
    fov: float | None = None,
    noise: float = 0.0,
    rng: np.random.Generator | None = None,
    up: ArrayLike = (0.0, 0.0, 1.0),
) -> PointCloud:
    """Return the cloud that a depth camera sees: the first hit of each pixel's ray.

    Parameters
    ----------
    mesh : path, trimesh or Open3D mesh
        The object, in its frame S; a box is `trimesh.creation.box(size)`.
    viewpoint : (3,) array
        The camera's position p_SC in S [m]. It becomes the cloud's viewpoint.
    target : (3,) array, optional
        Where the camera looks [m]; the middle of the mesh's bounding box by default.
    resolution : (int, int)
        Pixels across and down.
    fov : float, optional
        Angle of view across [rad], below pi; by default the whole mesh just fits.
    noise : float
        Standard deviation of the range [m]; a point moves along its ray.
    rng : numpy.random.Generator, optional
        Draws the noise; needed if `noise` is positive.
    up : (3,) array
        Direction against gravity in S: upright in the picture, and the cloud's `up`.

    Returns
    -------
    PointCloud
        In S, in the order of the pixels, row by row.

    Raises
    ------
    InputError
        If the mesh has no triangles, nothing of it is in view, or a parameter is impossible.

    Examples
    --------
    >>> import trimesh
    >>> from drake_aerial import partial_view
    >>> box = trimesh.creation.box([0.6, 0.4, 0.2])
    >>> view = partial_view(box, [0.0, 0.0, 2.0])
    >>> bool(abs(view.points[:, 2] - 0.1).max() < 1e-5)  # only the top face
    True
    """
    geometry = read_geometry(mesh)
    if geometry.faces is None:
        raise InputError(f"{geometry.label} has points but no triangles; give a mesh")
    eye = _point(viewpoint, "viewpoint")
    lower, upper = geometry.points.min(axis=0), geometry.points.max(axis=0)
    middle = 0.5 * (lower + upper) if target is None else _point(target, "target")
    if np.linalg.norm(middle - eye) < 1e-9:
        raise InputError(f"`viewpoint` and `target` must differ, got {eye.tolist()} for both")
    if noise < 0.0 or not np.isfinite(noise):
        raise InputError(f"`noise` must be a standard deviation of 0 m or more, got {noise}")
    if noise > 0.0 and rng is None:
        raise InputError("`noise` needs `rng`, a numpy.random.Generator")

    directions = _ray_directions(eye, middle, _point(up, "up"), resolution, fov, geometry.points)
    ranges = _cast(geometry.points, geometry.faces, eye, directions)
    hit = np.isfinite(ranges)
    if not hit.any():
        raise InputError(
            f"nothing of {geometry.label} is in view from {eye.tolist()} towards {middle.tolist()}"
        )
    ranges, directions = ranges[hit], directions[hit]
    if noise > 0.0 and rng is not None:
        ranges = ranges + noise * rng.standard_normal(len(ranges))
    return PointCloud.read(eye + ranges[:, None] * directions, viewpoint=eye, up=up)


def _ray_directions(
    eye: Array,
    middle: Array,
    up: Array,
    resolution: tuple[int, int],
    fov: float | None,
    vertices: Array,
) -> Array:
    """Return the unit ray directions (width * height, 3) of a pinhole camera, row by row."""
    width, height = resolution
    if width < 1 or height < 1:
        raise InputError(f"`resolution` must be two positive numbers of pixels, got {resolution}")
    forward = (middle - eye) / np.linalg.norm(middle - eye)
    right = np.cross(forward, up)
    # A camera that looks straight up or down may have any roll.
    right = (
        right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-6 else perpendicular(forward)
    )
    down = np.cross(forward, right)
    half_width = _fitting_half_width(eye, forward, right, down, width / height, vertices)
    if fov is not None:
        if not 0.0 < fov < np.pi:
            raise InputError(f"`fov` must be in (0, pi) rad, got {fov}")
        half_width = np.tan(0.5 * fov)
    x = ((np.arange(width) + 0.5) / width * 2.0 - 1.0) * half_width
    y = ((np.arange(height) + 0.5) / height * 2.0 - 1.0) * half_width * height / width
    rays = forward + y[:, None, None] * down + x[None, :, None] * right
    return (rays / np.linalg.norm(rays, axis=-1, keepdims=True)).reshape(-1, 3)


def _fitting_half_width(
    eye: Array, forward: Array, right: Array, down: Array, aspect: float, vertices: Array
) -> float:
    """Return the half width of the picture plane, one metre ahead, that just holds all vertices."""
    offset = vertices - eye
    depth = offset @ forward
    ahead = depth > 1e-9
    if not ahead.all():
        return float(np.tan(0.5 * np.deg2rad(120.0)))  # inside or beside the mesh nothing fits
    across = np.abs(offset @ right) / depth
    along = np.abs(offset @ down) / depth * aspect
    return _MARGIN * float(max(across.max(), along.max(), 1e-6))


def _cast(vertices: Array, faces: NDArray[np.int64], eye: Array, directions: Array) -> Array:
    """Return the distance [m] from `eye` to the first hit along each direction, or infinity."""
    import open3d as o3d

    scene: Any = o3d.t.geometry.RaycastingScene()
    # The ray caster uses 32-bit floats: coordinates relative to the eye keep the digits.
    scene.add_triangles((vertices - eye).astype(np.float32), faces.astype(np.uint32))
    rays = np.concatenate([np.zeros_like(directions), directions], axis=1).astype(np.float32)
    return scene.cast_rays(rays)["t_hit"].numpy().astype(np.float64)


def _point(values: ArrayLike, name: str) -> Array:
    point = np.asarray(values, dtype=np.float64)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise InputError(f"`{name}` must be three finite numbers, got {values!r}")
    return point
