"""A demonstration in the making: a cloud, what a gripper would touch on it, and the file to write."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.features.surface_features import compute_features
from drake_aerial.geometry import Array, axis_of
from drake_aerial.io.files import replacing, write_text
from drake_aerial.skill.demonstration import CABLE_LENGTH, Demonstration
from drake_aerial.skill.learn import TOUCH
from drake_aerial.skill.parameters import LearningParameters

# |r1| of a surface that bends less than 1 cm over a neighbourhood's 3 cm is below the first; a right-angled edge's is 1.1.
_FLAT, _EDGE = 0.15, 0.6


@dataclass(frozen=True, eq=False)
class Touch:
    """What a gripper touches at one place.

    Attributes
    ----------
    position : (3,) array
        On the surface, in the cloud's frame S [m].
    normal : (3,) array
        Outward unit normal there, in S.
    distance : float
        From the place asked for to the surface [m].
    features : int
        Surface features within the contact radius.
    surface : str
        What they look like, in words.
    """

    position: Array
    normal: Array
    distance: float
    features: int
    surface: str


class DemonstrationDraft:
    """A cloud on which contacts are being chosen.

    Attributes
    ----------
    cloud : PointCloud
        In its frame S [m].
    source : Path or None
        The file that the cloud was read from; None for one that has to be written too.
    contact_radius : float
        Of the surface that a contact is learnt from [m].
    """

    def __init__(
        self,
        cloud: PointCloud,
        source: str | Path | None = None,
        parameters: LearningParameters | None = None,
    ):
        """Compute the surface features of a cloud. Raises InputError if it has none."""
        parameters = parameters or LearningParameters()
        self.cloud = cloud
        self.source = None if source is None else Path(source)
        self.contact_radius = parameters.contact_radius
        self._features = compute_features(cloud, parameters.features)
        self._tree = cKDTree(self._features.p)

    def touch(self, p_S: ArrayLike) -> Touch:
        """Return what a gripper at p_S (3,) [m] touches: the place is moved along the normal onto the surface.

        Raises
        ------
        InputError
            If p_S is not three finite numbers, or the surface is more than 2 cm away.
        """
        try:
            p = np.asarray(p_S, float)
        except (TypeError, ValueError):
            p = np.full(1, np.nan)
        if p.shape != (3,) or not np.isfinite(p).all():
            raise InputError(
                f"a contact should be three finite numbers X Y Z in metres, got {p_S!r:.80}"
            )
        features = self._features
        distance, nearest = self._tree.query(p)
        if distance > max(TOUCH, features.rho):
            raise InputError(
                f"a gripper at {_numbers(p)} touches nothing: the nearest surface is {distance:.3f} m away, "
                f"at most {TOUCH:.3f} m is accepted"
            )
        normal = features.normal[nearest]
        height = float((p - features.p[nearest]) @ normal)
        if abs(height) > TOUCH:
            raise InputError(
                f"a gripper at {_numbers(p)} touches nothing: it is {abs(height):.3f} m off the surface, at most "
                f"{TOUCH:.3f} m is accepted"
            )
        position = p - height * normal
        around = self._tree.query_ball_point(position, self.contact_radius)
        return Touch(position, normal, abs(height), len(around), self._words(np.array(around, int)))

    def _words(self, around: Array) -> str:
        features = self._features.take(around)
        strongest = float(np.quantile(np.abs(features.r[:, 0]), 0.9)) if len(features) else 0.0
        bent = (
            "flat"
            if strongest < _FLAT
            else "gently curved"
            if strongest < _EDGE
            else "an edge or a tight curve within"
        )
        return f"{bent}, at the rim of the visible part" if features.rim.any() else bent

    def points_and_normals(self, most: int = 80_000) -> Array:
        """Return at most `most` points with their outward normals, (N, 6), in S."""
        points = self.cloud.points
        if len(points) > most:
            points = points[np.random.default_rng(0).choice(len(points), most, replace=False)]
        _, nearest = self._tree.query(points)
        return np.hstack([points, self._features.normal[nearest]])

    def demonstration(
        self,
        positions: ArrayLike,
        *,
        cable_length: ArrayLike = CABLE_LENGTH,
        cable_directions: ArrayLike | None = None,
        name: str = "demonstration",
        description: str = "",
    ) -> Demonstration:
        """Return the demonstration of grippers at `positions` (n, 3) [m], each moved onto the surface, its axis the normal there.

        The other parameters and errors are those of `Demonstration.make`; also raises InputError if a gripper touches nothing.
        """
        touches = [self.touch(p) for p in np.atleast_2d(np.asarray(positions, float))]
        return Demonstration.make(
            self.cloud,
            np.array([t.position for t in touches]),
            axes=np.array([t.normal for t in touches]),
            cable_length=cable_length,
            cable_directions=cable_directions,
            name=name,
            description=description,
        )

    def write(self, path: str | Path, demonstration: Demonstration) -> Path:
        """Write DEMONSTRATION.yaml, and the cloud beside it where it is in no file yet; return the YAML's path.

        Raises
        ------
        InputError
            If the path does not end in .yaml or .yml, or cannot be written.
        """
        path = Path(path)
        if path.suffix not in (".yaml", ".yml"):
            raise InputError(f"a demonstration is written as .yaml, got {str(path)!r}")
        source = self.source
        if source is None:
            source = path.with_name(f"{path.stem}_cloud.npz")
            with replacing(source) as temporary:
                np.savez_compressed(temporary, points=self.cloud.points)
        cloud: dict[str, Any] = {"file": os.path.relpath(source.resolve(), path.parent.resolve())}
        if not np.array_equal(self.cloud.up, [0.0, 0.0, 1.0]):
            cloud["up"] = _plain(self.cloud.up)
        if self.cloud.camera is not None:
            cloud["camera"] = self.cloud.camera
        elif self.cloud.viewpoint is not None:
            cloud["viewpoint"] = _plain(self.cloud.viewpoint)
        lift = demonstration.quadrotors.p - demonstration.grippers.p
        axes = np.atleast_2d(axis_of(demonstration.grippers.q, 2))
        document = {
            "name": demonstration.name,
            **({"description": demonstration.description} if demonstration.description else {}),
            "cloud": cloud,
            "grippers": [
                {
                    "position": _plain(p),
                    "axis": _plain(axis),
                    "cable_length": float(np.round(length, 6)),
                    "cable_direction": _plain(direction / np.linalg.norm(direction)),
                }
                for p, axis, length, direction in zip(
                    demonstration.grippers.p, axes, demonstration.cable_length, lift, strict=True
                )
            ],
        }
        write_text(
            path, yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=120)
        )
        return path


def _plain(values: Array) -> list[float]:
    return [float(v) for v in np.round(values, 6) + 0.0]


def _numbers(values: Array) -> str:
    return " ".join(f"{v:.4g}" for v in values)
