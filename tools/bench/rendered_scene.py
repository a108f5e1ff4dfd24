"""Random scenes for `rendered_scenes.py`: things on a table or floor, and a depth camera.

World W: z up, the support's surface at z = 0, the target around the origin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scans import above_centroid, curved_mesh

from drake_aerial.geometry import Pose, quat_from_matrix, rotate
from drake_aerial.scene.depth_camera import DepthCamera

CAMERA = DepthCamera(640, 480, fx=525.0, fy=525.0, cx=319.5, cy=239.5)
KINDS = ("box", "cylinder", "tray", "bunny", "teapot", "ellipsoid")
OCCLUDERS = ("none", "corner", "notch", "strip")
Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class RenderedScene:
    """One depth image and what is true about it.

    Attributes
    ----------
    depth : (480, 640) array
        True depths [m]; infinite where there is nothing.
    labels : (480, 640) int array
        0 nothing, 1 the floor or table, 2 the target, 3 and up the other things.
    X_WC : Pose
        The camera in the world.
    kind : str
        Kind of the target, one of `KINDS`.
    site : (3,) array
        The true place of the contact in the world [m].
    size : float
        Largest horizontal extent of the target [m].
    seen : float
        Fraction of the target's pixels that nothing hides and the image holds.
    support : str
        `floor` or `table`.
    occluder : str
        What hides a part of the target on purpose, one of `OCCLUDERS`.
    elevation : float
        Angle by which the camera looks down [deg].
    """

    depth: np.ndarray
    labels: np.ndarray
    X_WC: Pose
    kind: str
    site: np.ndarray
    size: float
    seen: float
    support: str
    occluder: str
    elevation: float

    @property
    def up_C(self) -> np.ndarray:
        """Direction against gravity in the camera's axes, (3,)."""
        return rotate(self.X_WC.q * [1.0, -1.0, -1.0, -1.0], Z)

    @property
    def site_C(self) -> np.ndarray:
        """The true place of the contact in the camera's axes, (3,) [m]."""
        return rotate(self.X_WC.q * [1.0, -1.0, -1.0, -1.0], self.site - self.X_WC.p)


def random_scene(seed: int, occluder: str = "none") -> RenderedScene:
    """Return the scene of a seed.

    The camera is 0.6 to 2.5 m from the target and looks 20 to 90 deg down. `occluder` hides a part
    of the target: a `corner` of its outline, a `notch` in the middle of one side, or a `strip` that
    holds one whole side. The camera then looks at least 50 deg down.
    """
    rng = np.random.default_rng(seed)
    kind = str(rng.choice({"none": KINDS, "corner": KINDS[:1]}.get(occluder, KINDS[:2])))
    target, site = _target(kind, rng)
    size = float(np.ptp(target.vertices[:, :2], axis=0).max())
    yaw = rng.uniform(-np.pi, np.pi)
    turn = _turned(yaw)
    target.apply_transform(turn)
    site = turn[:3, :3] @ site
    support = str(rng.choice(["floor", "table"]))
    elevation = float(rng.uniform(20.0 if occluder == "none" else 50.0, 90.0))
    # The camera is far enough for the target to fill at most two thirds of the image's height.
    nearest = max(0.6, 1.6 * size + 0.2)
    distance = float(rng.uniform(nearest, max(2.5, nearest)))
    X_WC = _camera(rng, elevation, distance, 0.25 * size)
    meshes = [_support(support, rng), target]
    if occluder == "none":
        meshes += _clutter(rng, target, int(rng.integers(0, 6)))
    else:
        meshes.append(_occluder(occluder, rng, target, turn, X_WC))
    depth, labels = _render(meshes, X_WC)
    alone = _pixels_alone(target, X_WC)
    seen = float((labels == 2).sum() / max(alone, 1))
    return RenderedScene(depth, labels, X_WC, kind, site, size, seen, support, occluder, elevation)


def tray_mesh(length: float, width: float, height: float, wall: float = 0.015):
    """Return an open tray that stands on z = 0, centred on the z axis [m]."""
    import trimesh

    parts = [trimesh.creation.box((length, width, wall))]
    for x, y, a, b in (
        (0.5 * (length - wall), 0.0, wall, width),
        (-0.5 * (length - wall), 0.0, wall, width),
        (0.0, 0.5 * (width - wall), length, wall),
        (0.0, -0.5 * (width - wall), length, wall),
    ):
        side = trimesh.creation.box((a, b, height))
        side.apply_translation((x, y, 0.5 * (height - wall)))
        parts.append(side)
    mesh = trimesh.util.concatenate(parts)
    mesh.apply_translation((0.0, 0.0, 0.5 * wall))
    return mesh


def _target(kind: str, rng: np.random.Generator):
    """Return a target that stands on z = 0, centred on the z axis, and its true contact."""
    import trimesh

    if kind == "box":
        size = np.sort(rng.uniform(0.15, 0.6, 2))[::-1].tolist() + [rng.uniform(0.06, 0.35)]
        mesh = trimesh.creation.box(size)
        mesh.apply_translation((0.0, 0.0, 0.5 * size[2]))
        return mesh, np.array([0.0, 0.0, size[2]])
    if kind == "cylinder":
        radius, height = rng.uniform(0.08, 0.25), rng.uniform(0.06, 0.35)
        mesh = trimesh.creation.cylinder(radius, height, sections=64)
        mesh.apply_translation((0.0, 0.0, 0.5 * height))
        return mesh, np.array([0.0, 0.0, height])
    if kind == "tray":
        length, width = np.sort(rng.uniform(0.2, 0.6, 2))[::-1]
        mesh = tray_mesh(length, width, rng.uniform(0.04, 0.12))
        return mesh, np.array([0.0, 0.0, 0.015])
    mesh = curved_mesh(kind).copy()
    mesh.apply_scale(rng.uniform(0.7, 1.3))
    lower, upper = mesh.bounds
    mesh.apply_translation([*(-0.5 * (lower + upper)[:2]), -lower[2]])
    return mesh, above_centroid(mesh)


def _clutter(rng: np.random.Generator, target, count: int) -> list:
    """Return things beside the target that touch neither it nor one another."""
    import trimesh

    placed = [(np.zeros(2), 0.5 * np.linalg.norm(np.ptp(target.vertices[:, :2], axis=0)))]
    found: list = []
    for _ in range(20 * count):
        if len(found) == count:
            break
        if rng.random() < 0.5:
            size = rng.uniform(0.06, 0.3, 3)
            mesh, radius = trimesh.creation.box(size), 0.5 * float(np.hypot(*size[:2]))
        else:
            radius, tall = rng.uniform(0.03, 0.12), rng.uniform(0.06, 0.3)
            mesh, size = trimesh.creation.cylinder(radius, tall, sections=48), (0, 0, tall)
        bearing, gap = rng.uniform(-np.pi, np.pi), rng.uniform(0.02, 0.35)
        at = (placed[0][1] + radius + gap) * np.array([np.cos(bearing), np.sin(bearing)])
        if any(np.linalg.norm(at - other) < radius + r + 0.01 for other, r in placed[1:]):
            continue
        placed.append((at, radius))
        mesh.apply_transform(_turned(rng.uniform(-np.pi, np.pi)))
        mesh.apply_translation((*at, 0.5 * size[2]))
        found.append(mesh)
    return found


def _occluder(kind: str, rng: np.random.Generator, target, turn: np.ndarray, X_WC: Pose):
    """Return a plate between camera and target that hides a part of the target's top."""
    import trimesh

    corners = (target.vertices @ turn[:3, :3])[:, :2]
    half = 0.5 * np.ptp(corners, axis=0)
    top = target.vertices[:, 2].max()
    # In the target's own axes: how much of the half extents is hidden, from the +x side.
    depth, width = rng.uniform(0.2, 0.55, 2) * half
    spans = {
        "corner": ((half[0] - depth, half[0] + 0.2), (half[1] - width, half[1] + 0.2)),
        "notch": ((half[0] - depth, half[0] + 0.2), (-width, 0.6 * width)),
        "strip": ((half[0] - depth, half[0] + 0.2), (-half[1] - 0.3, half[1] + 0.3)),
    }
    (x0, x1), (y0, y1) = spans[kind]
    outline = np.array([(x0, y0, top), (x1, y0, top), (x1, y1, top), (x0, y1, top)])
    outline = outline @ turn[:3, :3].T
    # Moved towards the camera it hides the same rays.
    share = rng.uniform(0.15, 0.4)
    near = outline + share * (X_WC.p - outline)
    return trimesh.Trimesh(np.vstack([near, near - 0.003 * Z]), _plate_faces(), process=False)


def _plate_faces() -> list[list[int]]:
    return [[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]]


def _support(kind: str, rng: np.random.Generator):
    """Return a floor, or a table with a floor 0.7 m below it."""
    import trimesh

    if kind == "floor":
        mesh = trimesh.creation.box((12.0, 12.0, 0.02))
        mesh.apply_translation((0.0, 0.0, -0.01))
        return mesh
    table = trimesh.creation.box((*rng.uniform((1.1, 0.8), (1.8, 1.2)), 0.03))
    table.apply_transform(_turned(rng.uniform(-np.pi, np.pi)))
    table.apply_translation((0.0, 0.0, -0.015))
    floor = trimesh.creation.box((12.0, 12.0, 0.02))
    floor.apply_translation((0.0, 0.0, -0.75))
    return trimesh.util.concatenate([table, floor])


def _camera(rng: np.random.Generator, elevation: float, distance: float, jitter: float) -> Pose:
    """Return X_WC: x right, y down, z forward, with a roll of up to 10 deg."""
    bearing, down = rng.uniform(-np.pi, np.pi), np.deg2rad(elevation)
    eye = distance * np.array(
        [np.cos(bearing) * np.cos(down), np.sin(bearing) * np.cos(down), np.sin(down)]
    )
    forward = np.append(rng.uniform(-jitter, jitter, 2), 0.05) - eye
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, Z + 1e-6 * np.array([np.sin(bearing), -np.cos(bearing), 0.0]))
    right /= np.linalg.norm(right)
    down_axis = np.cross(forward, right)
    roll = np.deg2rad(rng.uniform(-10.0, 10.0))
    x = np.cos(roll) * right + np.sin(roll) * down_axis
    R = np.stack([x, np.cross(forward, x), forward], axis=1)
    return Pose(eye, quat_from_matrix(R))


def _render(meshes: list, X_WC: Pose) -> tuple[np.ndarray, np.ndarray]:
    """Return depths and labels (480, 640) of meshes in the order support, target, others."""
    rays = CAMERA.rays()
    distance, hit = _cast(meshes, X_WC, rays)
    return distance, np.where(np.isfinite(distance), hit + 1, 0)


def _pixels_alone(mesh, X_WC: Pose) -> int:
    """Return the number of pixels of a mesh in an image of three times the size, alone."""
    wide = DepthCamera(1920, 1440, fx=525.0, fy=525.0, cx=959.5, cy=719.5)
    distance, _ = _cast([mesh], X_WC, wide.rays()[::2, ::2])
    return 4 * int(np.isfinite(distance).sum())


def _cast(meshes: list, X_WC: Pose, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    for mesh in meshes:
        vertices = (np.asarray(mesh.vertices) - X_WC.p).astype(np.float32)
        scene.add_triangles(vertices, np.asarray(mesh.faces).astype(np.uint32))
    along = rotate(X_WC.q, np.concatenate([rays, np.ones((*rays.shape[:2], 1))], axis=-1))
    cast = np.concatenate([np.zeros_like(along), along], axis=-1).astype(np.float32)
    answer = scene.cast_rays(cast)
    return answer["t_hit"].numpy().astype(float), answer["geometry_ids"].numpy().astype(int)


def _turned(yaw: float) -> np.ndarray:
    T = np.eye(4)
    c, s = np.cos(yaw), np.sin(yaw)
    T[:2, :2] = [[c, -s], [s, c]]
    return T


__all__ = ["CAMERA", "KINDS", "OCCLUDERS", "RenderedScene", "random_scene"]
