"""A 3-D picture as one coloured triangle mesh, from which both a PNG and a page are made.

Everything drawn (points, frames, cables, quadrotors) becomes triangles with vertex colours in one binary glTF, so that the
headless renderer and the browser show the same thing.
"""

from __future__ import annotations

import itertools
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.geometry import Array, Pose, matrix_from_quat, perpendicular, transform

Color = tuple[float, float, float]

GREY: Color = (0.62, 0.65, 0.70)
RED: Color = (0.85, 0.12, 0.10)
BLACK: Color = (0.05, 0.05, 0.06)
BLUE: Color = (0.10, 0.35, 0.85)
GREEN: Color = (0.10, 0.60, 0.25)
ORANGE: Color = (0.95, 0.55, 0.05)
AXES: tuple[Color, Color, Color] = ((0.90, 0.10, 0.10), (0.10, 0.70, 0.15), (0.12, 0.25, 0.95))

_OCTAHEDRON = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
_OCTAHEDRON_FACES = np.array(
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]],
    np.int64,
)


class Picture:
    """Coloured triangles collected from marks; all positions in one frame [m].

    Examples
    --------
    >>> import numpy as np
    >>> picture = Picture()
    >>> picture.add_points(np.zeros((4, 3)), color=(1, 0, 0), radius=0.01)
    >>> picture.vertices.shape
    (24, 3)
    """

    def __init__(self) -> None:
        self._vertices: list[Array] = []
        self._normals: list[Array] = []
        self._faces: list[np.ndarray] = []
        self._colors: list[Array] = []
        self._count = 0

    @property
    def vertices(self) -> Array:
        """All vertices (V, 3) [m]."""
        return np.concatenate(self._vertices) if self._vertices else np.zeros((0, 3))

    def bounds(self) -> tuple[Array, Array]:
        """Return the lower and upper corner (3,) of what is drawn [m]; the unit cube when nothing is."""
        vertices = self.vertices
        if not len(vertices):
            return np.zeros(3), np.ones(3)
        return vertices.min(0), vertices.max(0)

    def add_triangles(
        self, vertices: ArrayLike, faces: ArrayLike, colors: ArrayLike, normals: ArrayLike
    ) -> None:
        """Add triangles: vertices (V, 3) [m], faces (F, 3), colours (3,) or (V, 3) in 0..1, unit normals (V, 3)."""
        vertices = np.asarray(vertices, float).reshape(-1, 3)
        self._vertices.append(vertices)
        self._normals.append(np.asarray(normals, float).reshape(-1, 3))
        self._faces.append(np.asarray(faces, np.int64).reshape(-1, 3) + self._count)
        self._colors.append(np.broadcast_to(np.asarray(colors, float), vertices.shape))
        self._count += len(vertices)

    def add_points(
        self, points: ArrayLike, *, color: ArrayLike = GREY, radius: float = 0.003
    ) -> None:
        """Draw points (N, 3) as small octahedra of `radius` [m]; colour (3,) or one a point, (N, 3)."""
        points = np.asarray(points, float).reshape(-1, 3)
        shape = (len(points), 6, 3)
        vertices = points[:, None] + radius * _OCTAHEDRON
        faces = 6 * np.arange(len(points))[:, None, None] + _OCTAHEDRON_FACES
        colors = np.broadcast_to(np.asarray(color, float).reshape(-1, 1, 3), shape)
        self.add_triangles(
            vertices, faces, colors.reshape(-1, 3), np.broadcast_to(_OCTAHEDRON, shape)
        )

    def add_mesh(self, vertices: ArrayLike, faces: ArrayLike, *, color: Color = GREY) -> None:
        """Draw a triangle mesh, flat shaded: vertices (V, 3) [m], faces (F, 3)."""
        corners = np.asarray(vertices, float)[np.asarray(faces, np.int64)]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        self.add_triangles(
            corners, np.arange(3 * len(corners)).reshape(-1, 3), color, np.repeat(normal, 3, axis=0)
        )

    def add_sphere(self, center: ArrayLike, *, color: Color = RED, radius: float = 0.01) -> None:
        """Draw a ball of `radius` [m] at `center` (3,)."""
        import trimesh

        ball = trimesh.creation.icosphere(subdivisions=2, radius=1.0)
        self.add_triangles(
            np.asarray(center) + radius * ball.vertices, ball.faces, color, ball.vertices
        )

    def add_tube(self, path: ArrayLike, *, color: Color = BLACK, radius: float = 0.003) -> None:
        """Draw a polyline (N, 3) as a tube of `radius` [m]."""
        path = np.asarray(path, float)
        for start, end in itertools.pairwise(path):
            self._add_cylinder(start, end, radius, radius, color)

    def add_arrow(
        self, start: ArrayLike, end: ArrayLike, *, color: Color, radius: float = 0.003
    ) -> None:
        """Draw an arrow between two points (3,), its shaft of `radius` [m]."""
        start, end = np.asarray(start, float), np.asarray(end, float)
        neck = start + 0.75 * (end - start)
        self._add_cylinder(start, neck, radius, radius, color)
        self._add_cylinder(neck, end, 2.5 * radius, 0.0, color)

    def add_frame(self, X: Pose, *, length: float = 0.06, radius: float = 0.003) -> None:
        """Draw the axes of one pose: x red, y green, z blue, of `length` [m]."""
        p = np.asarray(X.p, float).reshape(3)
        R = matrix_from_quat(np.asarray(X.q, float).reshape(4))
        for axis, color in enumerate(AXES):
            self.add_arrow(p, p + length * R[:, axis], color=color, radius=radius)

    def add_quadrotor(self, X: Pose, *, arm: float = 0.09, color: Color = BLACK) -> None:
        """Draw a quadrotor at one pose: two crossed arms of half-length `arm` [m] and four rotor discs."""
        X = Pose(np.asarray(X.p, float).reshape(3), np.asarray(X.q, float).reshape(4))
        diagonal = arm / np.sqrt(2.0)
        tips = transform(
            X, diagonal * np.array([[1, 1, 0], [-1, -1, 0], [1, -1, 0], [-1, 1, 0]], float)
        )
        z = matrix_from_quat(X.q)[:, 2]
        self._add_cylinder(tips[0], tips[1], 0.07 * arm, 0.07 * arm, color)
        self._add_cylinder(tips[2], tips[3], 0.07 * arm, 0.07 * arm, color)
        self._add_cylinder(
            X.p - 0.15 * arm * z, X.p + 0.15 * arm * z, 0.25 * arm, 0.25 * arm, color
        )
        for tip in tips:
            self._add_cylinder(
                tip + 0.12 * arm * z, tip + 0.16 * arm * z, 0.55 * arm, 0.55 * arm, (0.35, 0.6, 0.9)
            )

    def _add_cylinder(
        self, start: Array, end: Array, r0: float, r1: float, color: Color, sides: int = 12
    ) -> None:
        axis = end - start
        length = np.linalg.norm(axis)
        if length < 1e-9:
            return
        z = axis / length
        x = perpendicular(z)
        y = np.cross(z, x)
        angle = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
        ring = np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * y
        slope = (r0 - r1) / length
        side_normal = (ring + slope * z) / np.hypot(1.0, slope)
        low, high = start + r0 * ring, end + r1 * ring
        i = np.arange(sides)
        j = (i + 1) % sides
        side = np.concatenate(
            [np.stack([i, j, j + sides], 1), np.stack([i, j + sides, i + sides], 1)]
        )
        self.add_triangles(
            np.concatenate([low, high]), side, color, np.concatenate([side_normal, side_normal])
        )
        for center, rim, normal, flip in ((start, low, -z, True), (end, high, z, False)):
            fan = np.stack([np.full(sides, sides), i, j], 1)
            self.add_triangles(
                np.concatenate([rim, center[None]]),
                fan[:, ::-1] if flip else fan,
                color,
                np.broadcast_to(normal, (sides + 1, 3)),
            )

    def to_glb(self) -> bytes:
        """Return the picture as one binary glTF (.glb) with vertex colours and a matt material."""
        buffers = [
            self.vertices.astype("<f4").tobytes(),
            np.concatenate(self._normals).astype("<f4").tobytes(),
            self._linear_colors().tobytes(),
            np.concatenate(self._faces).astype("<u4").tobytes(),
        ]
        low, high = self.bounds()
        document = _gltf_document([len(b) for b in buffers], self._count, low, high)
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        body = b"".join(buffers)
        header = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(body))
        return (
            header
            + struct.pack("<I4s", len(text), b"JSON")
            + text
            + struct.pack("<I4s", len(body), b"BIN\0")
            + body
        )

    def _linear_colors(self) -> np.ndarray:
        """Vertex colours are linear in glTF, and ours are given as they should look on the screen."""
        linear = np.concatenate(self._colors).clip(0.0, 1.0) ** 2.2
        rgba = np.concatenate([linear, np.ones((len(linear), 1))], axis=1)
        return np.round(255 * rgba).astype(np.uint8)

    def write_glb(self, path: str | Path) -> None:
        """Write the picture as a .glb file."""
        Path(path).write_bytes(self.to_glb())


def _gltf_document(sizes: list[int], vertices: int, low: Array, high: Array) -> dict[str, Any]:
    offsets = np.concatenate([[0], np.cumsum(sizes)]).tolist()
    views = [
        {"buffer": 0, "byteOffset": offsets[i], "byteLength": size} for i, size in enumerate(sizes)
    ]
    float32, uint8, uint32 = 5126, 5121, 5125
    return {
        "asset": {"version": "2.0", "generator": "drake_aerial"},
        "scene": 0,
        # glTF is y-up and both readers turn it z-up; undo that, our data are z-up already.
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "rotation": [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]}],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {"POSITION": 0, "NORMAL": 1, "COLOR_0": 2},
                        "indices": 3,
                        "material": 0,
                    }
                ]
            }
        ],
        "materials": [
            {
                "pbrMetallicRoughness": {
                    "baseColorFactor": [1, 1, 1, 1],
                    "metallicFactor": 0,
                    "roughnessFactor": 1,
                },
                "doubleSided": True,
            }
        ],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": float32,
                "count": vertices,
                "type": "VEC3",
                "min": low.astype("<f4").tolist(),
                "max": high.astype("<f4").tolist(),
            },
            {"bufferView": 1, "componentType": float32, "count": vertices, "type": "VEC3"},
            {
                "bufferView": 2,
                "componentType": uint8,
                "normalized": True,
                "count": vertices,
                "type": "VEC4",
            },
            {"bufferView": 3, "componentType": uint32, "count": sizes[3] // 4, "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": offsets[-1]}],
    }
