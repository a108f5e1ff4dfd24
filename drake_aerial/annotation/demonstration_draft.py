"""A demonstration before it is saved: a cloud, contacts on its surface, and the file."""

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

_FLAT = 0.15
"""Upper limit of |r1| of a flat surface: it bends less than 1 cm over a neighbourhood of 3 cm."""
_EDGE = 0.6
"""Lower limit of |r1| of an edge; a right-angled edge has 1.1."""


@dataclass(frozen=True, eq=False)
class Touch:
    """A contact on the surface of a cloud.

    Attributes
    ----------
    position : (3,) array
        On the surface, in the cloud's frame S [m].
    normal : (3,) array
        Outward unit normal at the position, in S.
    distance : float
        Distance of the requested position from the surface [m].
    features : int
        Number of surface features within the contact radius.
    surface : str
        Shape of the surface within the contact radius, in words.
    """

    position: Array
    normal: Array
    distance: float
    features: int
    surface: str


class DemonstrationDraft:
    """A cloud and its surface, on which the contacts of a demonstration are placed.

    Attributes
    ----------
    cloud : PointCloud
        In its frame S [m].
    source : Path or None
        File of the cloud; None for a cloud that is written together with the demonstration.
    whole : bool
        Whether all points of the file are the payload, whatever is seen in them.
    contact_radius : float
        Radius of the surface that a contact is learnt from [m].
    """

    def __init__(
        self,
        cloud: PointCloud,
        source: str | Path | None = None,
        parameters: LearningParameters | None = None,
        *,
        whole: bool = False,
    ):
        """Compute the surface features of a cloud. Raises InputError if it has none."""
        parameters = parameters or LearningParameters()
        self.cloud = cloud
        self.whole = whole
        self.source = None if source is None else Path(source)
        self.contact_radius = parameters.contact_radius
        self._features = compute_features(cloud, parameters.features)
        self._tree = cKDTree(self._features.p)

    def touch(self, p_S: ArrayLike) -> Touch:
        """Return the contact of a gripper at p_S (3,) [m], moved along the normal onto the surface.

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
                f"a contact must be three finite numbers X Y Z in metres, got {p_S!r:.80}"
            )
        features = self._features
        distance, nearest = self._tree.query(p)
        normal = features.normal[nearest]
        height = float((p - features.p[nearest]) @ normal)
        # The nearest feature may be beside a position on the surface, by at most rho.
        away = distance if distance > max(TOUCH, features.rho) else abs(height)
        if away > TOUCH:
            raise InputError(
                f"a contact must be within {TOUCH:.3f} m of the surface, "
                f"got {' '.join(f'{v:.4g}' for v in p)}, which is {away:.3f} m from it; "
                "give a position on the cloud"
            )
        position = p - height * normal
        around = self._tree.query_ball_point(position, self.contact_radius)
        return Touch(position, normal, abs(height), len(around), self._words(np.array(around, int)))

    def _words(self, around: Array) -> str:
        features = self._features.take(around)
        strongest = float(np.quantile(np.abs(features.r[:, 0]), 0.9)) if len(features) else 0.0
        if strongest < _FLAT:
            shape = "flat"
        else:
            shape = "gently curved" if strongest < _EDGE else "an edge or a tight curve"
        return f"{shape}, at the rim of the visible part" if features.rim.any() else shape

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
        """Return the demonstration of grippers at `positions` (n, 3) [m].

        Each gripper is moved onto the surface; its axis is the normal there. The other parameters
        and errors are those of `Demonstration.make`.

        Raises
        ------
        InputError
            If a position is not on the surface; see `touch`.
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
        """Write DEMONSTRATION.yaml, and the cloud if it has no file; return the YAML's path.

        Raises
        ------
        InputError
            If the path does not end in .yaml or .yml, or cannot be written.
        """
        path = Path(path)
        check_file_name(path)
        source = self.source
        if source is None:
            source = path.with_name(f"{path.stem}_cloud.npz")
            with replacing(source) as temporary:
                np.savez_compressed(temporary, points=self.cloud.points)
        cloud: dict[str, Any] = {"file": os.path.relpath(source.resolve(), path.parent.resolve())}
        of_bag = self.source is not None and self.cloud.topic is not None
        if of_bag:
            cloud["topic"] = self.cloud.topic
        if self.source is not None and self.whole:
            cloud["whole"] = True
        up: Any = self.cloud.up
        if self.source is not None and self.cloud.scene_object is not None:
            # The scene finds gravity again.
            cloud["object"] = self.cloud.scene_object["number"]
            up = self.cloud.scene_object["scene_up"]
        # Without `up`, an IMU of the bag may give another one.
        if up is not None and (of_bag or not np.array_equal(up, [0.0, 0.0, 1.0])):
            cloud["up"] = _rounded(np.asarray(up))
        if self.cloud.camera is not None:
            cloud["camera"] = self.cloud.camera
        elif self.cloud.viewpoint is not None:
            cloud["viewpoint"] = _rounded(self.cloud.viewpoint)
        lift = demonstration.quadrotors.p - demonstration.grippers.p
        axes = np.atleast_2d(axis_of(demonstration.grippers.q, 2))
        document = {
            "name": demonstration.name,
            **({"description": demonstration.description} if demonstration.description else {}),
            "cloud": cloud,
            "grippers": [
                {
                    "position": _rounded(p),
                    "axis": _rounded(axis),
                    "cable_length": float(np.round(length, 6)),
                    "cable_direction": _rounded(direction / np.linalg.norm(direction)),
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


def check_file_name(path: Path) -> None:
    """Raise InputError if a path does not end in .yaml or .yml."""
    if path.suffix not in (".yaml", ".yml"):
        raise InputError(f"a demonstration file must end in .yaml or .yml, got {str(path)!r}")


def _rounded(values: Array) -> list[float]:
    return [float(v) for v in np.round(values, 6) + 0.0]
