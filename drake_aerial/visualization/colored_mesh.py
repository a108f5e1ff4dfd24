"""A 3-D drawing as one triangle mesh with vertex colours, for the renderer and for Meshcat.

Points, frames, cables and quadrotors all become triangles of one glTF file, so that a rendered
image and a page in the browser show the same thing.
"""

import itertools
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.geometry import Array, Pose, matrix_from_quat, perpendicular, transform
from drake_aerial.visualization.colors import AXES, BLACK, GREY, RED, Color

_OCTAHEDRON = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
_OCTAHEDRON_FACES = np.array(
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]],
    np.int64,
)


class ColoredMesh:
    """Triangles with vertex colours; all positions are in one frame [m].

    Examples
    --------
    >>> import numpy as np
    >>> mesh = ColoredMesh()
    >>> mesh.add_points(np.zeros((4, 3)), color=(1, 0, 0), radius=0.01)
    >>> mesh.vertices.shape
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

    @property
    def faces(self) -> np.ndarray:
        """All triangles (F, 3), as indices of vertices."""
        return np.concatenate(self._faces) if self._faces else np.zeros((0, 3), np.int64)

    @property
    def colors(self) -> Array:
        """Colours (V, 3) of the vertices in 0..1."""
        return np.concatenate(self._colors) if self._colors else np.zeros((0, 3))

    def bounds(self) -> tuple[Array, Array]:
        """Return the lower and upper corner (3,) [m]; the unit cube if the mesh is empty."""
        vertices = self.vertices
        if not len(vertices):
            return np.zeros(3), np.ones(3)
        return vertices.min(0), vertices.max(0)

    def add_triangles(
        self, vertices: ArrayLike, faces: ArrayLike, colors: ArrayLike, normals: ArrayLike
    ) -> None:
        """Add triangles.

        Parameters
        ----------
        vertices : (V, 3) array
            [m]
        faces : (F, 3) int array
            Indices of vertices.
        colors : (3,) or (V, 3) array
            In 0..1.
        normals : (V, 3) array
            Outward unit normals.
        """
        vertices = np.asarray(vertices, float).reshape(-1, 3)
        self._vertices.append(vertices)
        self._normals.append(np.asarray(normals, float).reshape(-1, 3))
        self._faces.append(np.asarray(faces, np.int64).reshape(-1, 3) + self._count)
        self._colors.append(np.broadcast_to(np.asarray(colors, float), vertices.shape))
        self._count += len(vertices)

    def add_points(
        self, points: ArrayLike, *, color: ArrayLike = GREY, radius: float = 0.003
    ) -> None:
        """Add points (N, 3) as octahedra of `radius` [m]; one colour (3,) or one a point (N, 3)."""
        points = np.asarray(points, float).reshape(-1, 3)
        shape = (len(points), 6, 3)
        vertices = points[:, None] + radius * _OCTAHEDRON
        faces = 6 * np.arange(len(points))[:, None, None] + _OCTAHEDRON_FACES
        colors = np.broadcast_to(np.asarray(color, float).reshape(-1, 1, 3), shape)
        self.add_triangles(
            vertices, faces, colors.reshape(-1, 3), np.broadcast_to(_OCTAHEDRON, shape)
        )

    def add_mesh(self, vertices: ArrayLike, faces: ArrayLike, *, color: Color = GREY) -> None:
        """Add a triangle mesh with flat shading: vertices (V, 3) [m], faces (F, 3)."""
        corners = np.asarray(vertices, float)[np.asarray(faces, np.int64)]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        self.add_triangles(
            corners, np.arange(3 * len(corners)).reshape(-1, 3), color, np.repeat(normal, 3, axis=0)
        )

    def add_sphere(self, center: ArrayLike, *, color: Color = RED, radius: float = 0.01) -> None:
        """Add a ball of `radius` [m] at `center` (3,)."""
        vertices, faces, normals = _unit_shape("sphere")
        self.add_triangles(np.asarray(center) + radius * vertices, faces, color, normals)

    def add_tube(self, path: ArrayLike, *, color: Color = BLACK, radius: float = 0.003) -> None:
        """Add a polyline (N, 3) as a tube of `radius` [m]."""
        for start, end in itertools.pairwise(np.asarray(path, float)):
            self._add_along("cylinder", start, end, radius, color)

    def add_arrow(
        self, start: ArrayLike, end: ArrayLike, *, color: Color, radius: float = 0.003
    ) -> None:
        """Add an arrow between two points (3,) with a shaft of `radius` [m]."""
        start, end = np.asarray(start, float), np.asarray(end, float)
        neck = start + 0.75 * (end - start)
        self._add_along("cylinder", start, neck, radius, color)
        self._add_along("cone", neck, end, 2.5 * radius, color)

    def add_frame(self, X: Pose, *, length: float = 0.06, radius: float = 0.003) -> None:
        """Add the axes of one pose: x red, y green, z blue, of `length` [m]."""
        p = np.asarray(X.p, float).reshape(3)
        R = matrix_from_quat(np.asarray(X.q, float).reshape(4))
        for axis, color in enumerate(AXES):
            self.add_arrow(p, p + length * R[:, axis], color=color, radius=radius)

    def add_quadrotor(self, X: Pose, *, arm: float = 0.09, color: Color = BLACK) -> None:
        """Add a quadrotor at one pose: two crossed arms, each half `arm` [m] long, four rotors."""
        X = Pose(np.asarray(X.p, float).reshape(3), np.asarray(X.q, float).reshape(4))
        diagonal = arm / np.sqrt(2.0)
        tips = transform(
            X, diagonal * np.array([[1, 1, 0], [-1, -1, 0], [1, -1, 0], [-1, 1, 0]], float)
        )
        z = arm * matrix_from_quat(X.q)[:, 2]
        self._add_along("cylinder", tips[0], tips[1], 0.07 * arm, color)
        self._add_along("cylinder", tips[2], tips[3], 0.07 * arm, color)
        self._add_along("cylinder", X.p - 0.15 * z, X.p + 0.15 * z, 0.25 * arm, color)
        for tip in tips:
            self._add_along(
                "cylinder", tip + 0.12 * z, tip + 0.16 * z, 0.55 * arm, (0.35, 0.6, 0.9)
            )

    def _add_along(self, kind: str, start: Array, end: Array, radius: float, color: Color) -> None:
        """Add a cylinder or a cone from `start` to `end`, (3,) [m]; the radius is at the start."""
        length = float(np.linalg.norm(end - start))
        if length < 1e-9:
            return
        z = (end - start) / length
        x = perpendicular(z)
        R = np.stack([x, np.cross(z, x), z])
        vertices, faces, normals = _unit_shape(kind)
        scale = np.array([radius, radius, length])
        normals = normals / scale
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        self.add_triangles(start + (scale * vertices) @ R, faces, color, normals @ R)

    def to_gltf(self) -> bytes:
        """Return the mesh as a glTF file with embedded buffers and a matt material."""
        import trimesh
        from trimesh.exchange.gltf import export_gltf

        material = trimesh.visual.material.PBRMaterial(
            baseColorFactor=[255, 255, 255, 255],
            metallicFactor=0.0,
            roughnessFactor=1.0,
            doubleSided=True,
        )
        visual = trimesh.visual.TextureVisuals(material=material)
        # Vertex colours are linear in glTF.
        linear = self.colors.clip(0.0, 1.0) ** 2.2
        alpha = np.ones((len(linear), 1))
        visual.vertex_attributes["color"] = np.round(255 * np.hstack([linear, alpha]))
        mesh = trimesh.Trimesh(
            self.vertices,
            self.faces,
            vertex_normals=np.concatenate(self._normals),
            visual=visual,
            process=False,
        )
        # glTF is y-up, the drawing is z-up.
        y_up = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], float)
        scene = trimesh.Scene()
        scene.add_geometry(mesh, transform=y_up)
        files = export_gltf(scene, include_normals=True, merge_buffers=True, embed_buffers=True)
        return files["model.gltf"]

    def to_drake(self) -> Any:
        """Return the mesh as a pydrake.geometry.Mesh."""
        from pydrake.common import MemoryFile
        from pydrake.geometry import InMemoryMesh, Mesh

        return Mesh(InMemoryMesh(mesh_file=MemoryFile(self.to_gltf(), ".gltf", "colored mesh")))


@lru_cache
def _unit_shape(kind: str) -> tuple[Array, Array, Array]:
    """Return vertices, faces and unit normals: a ball of radius 1, or a bar from z = 0 to z = 1."""
    import trimesh

    if kind == "sphere":
        mesh = trimesh.creation.icosphere(subdivisions=2, radius=1.0)
        return mesh.vertices, mesh.faces, mesh.vertices
    if kind == "cone":
        mesh = trimesh.creation.cone(radius=1.0, height=1.0, sections=12)
    else:
        mesh = trimesh.creation.cylinder(radius=1.0, height=1.0, sections=12)
        mesh.apply_translation([0.0, 0.0, 0.5])
    # The side is smooth; the edges to the ends are sharp.
    mesh = trimesh.graph.smooth_shade(mesh, angle=np.pi / 3, facet_minarea=None)
    return mesh.vertices, mesh.faces, mesh.vertex_normals
