"""The payload: its shape, its mass properties, and where it is in the scan."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial import geometry
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, Pose
from drake_aerial.io import strict_yaml
from drake_aerial.plant import triangles
from drake_aerial.plant.mass_properties import (
    SolidProperties,
    check_inertia,
    is_closed,
    solid_properties,
)
from drake_aerial.plant.payload_file import read_payload_file

TABLE_MASS = 0.25
"""Payload mass of the paper's parameter table [kg]."""
TABLE_INERTIA = (0.006, 0.0059, 0.0107)
"""Principal moments of the paper's parameter table [kg m^2]; its J_zz is printed as 0.107, which no body has."""


@dataclass(frozen=True, eq=False)
class Payload:
    """A rigid payload, in its own model frame P.

    Attributes
    ----------
    name : str
    mass : float
        [kg]
    com : (3,) array
        Centre of mass p_PPcm [m].
    inertia : (3, 3) array
        Rotational inertia about the centre of mass, in P's axes [kg m^2].
    vertices, faces : (V, 3) array [m], (F, 3) int array
        Its surface in P, triangles counter-clockwise seen from outside.
    X_SP : Pose
        P's pose in the scan's frame S; identity by default.

    Examples
    --------
    >>> from drake_aerial import Payload
    >>> box = Payload.from_box([0.6, 0.4, 0.2], mass=0.3)
    >>> box.inertia.diagonal().round(4).tolist()
    [0.005, 0.01, 0.013]
    >>> Payload.read("bunny").com.tolist()  # at the neck, as in the paper
    [-0.15, -0.025, 0.285]
    """

    name: str
    mass: float
    com: Array
    inertia: Array
    vertices: Array = field(repr=False)
    faces: Array = field(repr=False)
    X_SP: Pose = field(default_factory=geometry.identity)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mass) and self.mass > 0.0):
            raise InputError(f"the payload's mass is {self.mass!r} kg; a positive number accepted")
        com = strict_yaml.numbers(self.com, (3,), "the payload's com")
        object.__setattr__(self, "com", com)
        object.__setattr__(self, "inertia", check_inertia(self.inertia, "the payload's inertia"))

    @classmethod
    def read(cls, name_or_path: str | Path) -> Payload:
        """Return the payload of a PAYLOAD.yaml, or of a shipped one by its name.

        The file has `mesh` (a file beside it, or package://drake_aerial/...) or `box` (three edges [m]), `mass` [kg], and optionally `name`,
        `description`, `scale`, `com` (three numbers in P [m]), `inertia` (three moments or a 3x3 matrix, about the centre of
        mass [kg m^2]) and `pose` (position, quaternion_wxyz: X_SP).

        Raises
        ------
        InputError
            For a missing file, an unknown key (the nearest known one is named) or an impossible value.
        """
        arguments = read_payload_file(name_or_path)
        return cls.from_box(**arguments) if "size" in arguments else cls.from_mesh(**arguments)

    @classmethod
    def from_box(
        cls,
        size: ArrayLike,
        mass: float = TABLE_MASS,
        *,
        com: ArrayLike | None = None,
        inertia: ArrayLike | None = None,
        name: str = "box",
        X_SP: Pose | None = None,
    ) -> Payload:
        """Return a box of full edges `size` (3,) [m] centred on P; uniform density unless com or inertia is given."""
        size = strict_yaml.numbers(size, (3,), "the box's size")
        if (size <= 0.0).any():
            raise InputError(f"the box's size is {size.tolist()} m; three positive edges accepted")
        vertices, faces = triangles.box(size)
        return cls._of_solid(vertices, faces, mass, com, inertia, name, X_SP)

    @classmethod
    def from_mesh(
        cls,
        mesh: Any,
        mass: float = TABLE_MASS,
        *,
        scale: float = 1.0,
        com: ArrayLike | None = None,
        inertia: ArrayLike | None = None,
        name: str | None = None,
        X_SP: Pose | None = None,
    ) -> Payload:
        """Return a payload from a triangle mesh.

        Parameters
        ----------
        mesh : path, trimesh.Trimesh, or pair of vertices (V, 3) [m] and faces (F, 3)
        mass : float
            [kg]
        scale : float
            Factor on the mesh's coordinates.
        com : (3,), optional
            Centre of mass in P, after scaling [m]; the volume centroid by default.
        inertia : (3,) or (3, 3), optional
            About the centre of mass [kg m^2]; a uniform solid's by default.

        Raises
        ------
        InputError
            If inertia is not given and the mesh is open or has no volume.
        """
        vertices, faces, stem = triangles.read(mesh)
        name = stem if name is None else name
        return cls._of_solid(vertices * scale, faces, mass, com, inertia, name, X_SP)

    @classmethod
    def from_cloud(
        cls, cloud: Any, mass: float = TABLE_MASS, *, name: str = "scan", depth: float = 0.02
    ) -> Payload:
        """Return the closed convex hull of a scan as a solid of uniform density: all that a scan alone tells.

        Parameters
        ----------
        cloud : PointCloud or (N, 3) array
            In S [m]. P is S: `X_SP` is the identity.
        mass : float
            [kg]
        depth : float
            A hull thinner than this along some direction, such as a view of one flat face, is thickened to it, away
            from the viewer where the viewpoint is known and downwards otherwise [m].
        """
        points = np.asarray(getattr(cloud, "points", cloud), dtype=float)
        away = -np.asarray(getattr(cloud, "up", (0.0, 0.0, 1.0)), dtype=float)
        viewpoint = getattr(cloud, "viewpoint", None)
        if viewpoint is not None:
            away = points.mean(axis=0) - np.asarray(viewpoint, dtype=float)
        vertices, faces = triangles.closed_hull(points, depth, away)
        return cls._of_solid(vertices, faces, mass, None, None, name, None)

    @classmethod
    def _of_solid(
        cls,
        vertices: Array,
        faces: Array,
        mass: float,
        com: ArrayLike | None,
        inertia: ArrayLike | None,
        name: str,
        X_SP: Pose | None,
    ) -> Payload:
        solid = _solid(vertices, faces, name) if com is None or inertia is None else None
        if com is None:
            assert solid is not None
            com = solid.centroid
        if inertia is None:
            assert solid is not None
            inertia = solid.inertia(mass)
        X_SP = geometry.identity() if X_SP is None else X_SP
        # Checked, and made arrays, in the constructor.
        return cls(name, float(mass), cast(Array, com), cast(Array, inertia), vertices, faces, X_SP)

    def with_pose(self, X_SP: Pose) -> Payload:
        """Return the same payload with P elsewhere in the scan's frame."""
        return replace(self, X_SP=X_SP)

    def in_tracked_frame(self, p_SL: ArrayLike, q_SL: ArrayLike = (1.0, 0.0, 0.0, 0.0)) -> Payload:
        """Return the same payload with everything expressed in the tracked frame L, whose pose X_SL takes X_SP's place.

        Parameters
        ----------
        p_SL : (3,)
            L's origin in the scan's frame: the scan's centroid [m].
        q_SL : (4,)
            L's rotation: that which makes L's axes the world's at the start. The identity if the scan is z-up.
        """
        X_SL = Pose(np.asarray(p_SL, float), np.asarray(q_SL, float))
        X_LP = geometry.invert(X_SL) @ self.X_SP
        R_LP = geometry.matrix_from_quat(X_LP.q)
        return replace(
            self,
            com=geometry.transform(X_LP, self.com),
            inertia=R_LP @ self.inertia @ R_LP.T,
            vertices=geometry.transform(X_LP, self.vertices),
            X_SP=X_SL,
        )

    def to_trimesh(self) -> Any:
        """Return the surface in the scan's frame S as a trimesh.Trimesh [m]."""
        import trimesh

        vertices = geometry.transform(self.X_SP, self.vertices)
        return trimesh.Trimesh(vertices, self.faces, process=False)

    def closest_point(self, p_P: ArrayLike) -> tuple[Array, Array, Array]:
        """Return the closest surface points to given ones.

        Parameters
        ----------
        p_P : (..., 3)
            Points in P [m].

        Returns
        -------
        points : (..., 3) array
            On the surface, in P [m].
        normals : (..., 3) array
            Outward unit normals of the triangles they are on.
        distances : (...) array
            Unsigned [m].
        """
        return triangles.closest_points(self.vertices, self.faces, np.asarray(p_P, dtype=float))


def _solid(vertices: Array, faces: Array, name: str) -> SolidProperties:
    solid = solid_properties(vertices, faces)
    extent = np.ptp(vertices, axis=0)
    if not is_closed(faces) or solid.volume <= 1e-9 * float(extent.max()) ** 3:
        raise InputError(
            f"the mesh of payload {name!r} encloses no volume, so it has no inertia of its own: give com (three numbers, m) "
            "and inertia (three moments about the centre of mass, kg m^2), or a closed mesh with outward triangles"
        )
    return solid
