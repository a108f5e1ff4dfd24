"""The payload: its shape, its mass properties, and its pose in the scan."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial import geometry
from drake_aerial.cloud.assumptions import Assumption
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
from drake_aerial.plant.scan_hull import scan_hull

TABLE_MASS = 0.25
"""Payload mass of the paper's parameter table [kg]."""
TABLE_INERTIA = (0.006, 0.0059, 0.0107)
"""Principal moments of the paper's parameter table [kg m^2].

The table prints J_zz = 0.107, which is impossible beside the other two.
"""


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
        Surface in P; triangles are counter-clockwise when viewed from outside.
    X_SP : Pose
        Pose of P in the scan's frame S; identity by default.
    is_hull : bool
        Whether the surface is the closed hull of a scan (`from_cloud`). The real surface, with the
        contacts on it, may then be inside of it.
    assumptions : tuple of Assumption
        What is assumed about the part of a scanned payload that was not seen.

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
    is_hull: bool = False
    assumptions: tuple[Assumption, ...] = ()

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mass) and self.mass > 0.0):
            raise InputError(f"`mass` of a payload must be positive [kg], got {self.mass!r}")
        com = strict_yaml.numbers(self.com, (3,), "the payload's com")
        object.__setattr__(self, "com", com)
        object.__setattr__(self, "inertia", check_inertia(self.inertia, "the payload's inertia"))

    @classmethod
    def read(cls, name_or_path: str | Path) -> Payload:
        """Read a payload from a PAYLOAD.yaml, or a shipped one by its name.

        The file has `mass` [kg] and either `mesh` (a file beside it, or package://drake_aerial/...)
        or `box` (three edges [m]). Optional keys are `name`, `description`, `scale`, `com` (three
        numbers in P [m]), `inertia` (three moments or a 3x3 matrix, about the centre of mass
        [kg m^2]) and `pose` (position and quaternion_wxyz of X_SP).

        Raises
        ------
        InputError
            If the file is missing, or has an unknown key (the message names the nearest known one)
            or an impossible value.
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
        """Return a box of edges `size` (3,) [m] centred on P.

        Its density is uniform unless `com` or `inertia` is given; see `from_mesh` for the others.
        """
        size = strict_yaml.numbers(size, (3,), "the box's size")
        if (size <= 0.0).any():
            raise InputError(f"`size` of a box must be positive [m], got {size.tolist()}")
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
            Factor for the mesh's coordinates.
        com : (3,), optional
            Centre of mass in P after scaling [m]; by default the centroid of the volume.
        inertia : (3,) or (3, 3), optional
            About the centre of mass [kg m^2]; by default that of a uniform solid.
        name : str, optional
            By default the name of the file.
        X_SP : Pose, optional
            Pose of P in the scan's frame; by default the identity.

        Raises
        ------
        InputError
            If `com` or `inertia` is not given and the mesh is open or has no volume.
        """
        vertices, faces, stem = triangles.read(mesh)
        name = stem if name is None else name
        return cls._of_solid(vertices * scale, faces, mass, com, inertia, name, X_SP)

    @classmethod
    def from_cloud(
        cls, cloud: Any, mass: float = TABLE_MASS, *, name: str = "scan", depth: float = 0.02
    ) -> Payload:
        """Return the closed convex hull of a scan as a solid of uniform density.

        The hull of a partial view is closed downwards to the level of its lowest point.

        Parameters
        ----------
        cloud : PointCloud or (N, 3) array
            The scan in S [m]. P is S: `X_SP` is the identity.
        mass : float
            [kg]
        depth : float
            Least thickness of the hull [m]. A thinner one, such as that of a single flat face, is
            thickened away from the viewpoint, or downwards if the viewpoint is not known.
        """
        vertices, faces, assumptions = scan_hull(cloud, depth)
        solid = cls._of_solid(vertices, faces, mass, None, None, name, None)
        return replace(solid, is_hull=True, assumptions=assumptions)

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
        X_SP = geometry.identity() if X_SP is None else geometry.as_pose(X_SP)
        # Checked, and made arrays, in the constructor.
        return cls(name, float(mass), cast(Array, com), cast(Array, inertia), vertices, faces, X_SP)

    def in_tracked_frame(self, p_SL: ArrayLike, q_SL: ArrayLike = (1.0, 0.0, 0.0, 0.0)) -> Payload:
        """Return the same payload expressed in the tracked frame L; X_SL replaces X_SP.

        Parameters
        ----------
        p_SL : (3,)
            Origin of L in the scan's frame [m]: the scan's centroid.
        q_SL : (4,)
            Rotation of L in the scan's frame, z up. The identity if the scan is z-up.
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
        """Return the surface points that are closest to given points.

        Parameters
        ----------
        p_P : (..., 3)
            Points in P [m].

        Returns
        -------
        points : (..., 3) array
            Closest points on the surface, in P [m].
        normals : (..., 3) array
            Outward unit normals of their triangles.
        distances : (...) array
            Unsigned distances [m].
        """
        return triangles.closest_points(self.vertices, self.faces, np.asarray(p_P, dtype=float))

    def contact_distances(self, p_PC: Array) -> Array:
        """Return the distances (n,) of contacts (n, 3) in P from the surface [m].

        Contacts inside the hull of a scan have the distance 0, because the real surface may be
        there.
        """
        _, _, distances = self.closest_point(p_PC)
        if self.is_hull:
            distances[triangles.is_inside_hull(self.vertices, self.faces, p_PC)] = 0.0
        return distances


def _solid(vertices: Array, faces: Array, name: str) -> SolidProperties:
    solid = solid_properties(vertices, faces)
    extent = np.ptp(vertices, axis=0)
    if not is_closed(faces) or solid.volume <= 1e-9 * float(extent.max()) ** 3:
        raise InputError(
            f"the mesh of payload {name!r} must be closed, with outward triangles, to have a "
            "volume: give another mesh, or give com (three numbers, m) and inertia (three moments "
            "about the centre of mass, kg m^2)"
        )
    return solid
