"""A demonstration: one cloud with the poses of grippers and quadrotors on it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, Pose, perpendicular, quat_from_xz, quat_normalize
from drake_aerial.io import model_files
from drake_aerial.io.records import read_record
from drake_aerial.skill.demonstration_file import DemonstrationFile, GripperEntry, read_cloud

CABLE_LENGTH = 0.5
"""Default cable length of a demonstration [m]; the paper's."""


@dataclass(frozen=True, eq=False)
class Demonstration:
    """The cloud of one object, with n grippers and their quadrotors on it.

    Attributes
    ----------
    name : str
        Short name, by default the file's stem.
    cloud : PointCloud
        The visible surface, in its frame S [m].
    grippers : Pose
        Gripper poses X_SG, batch (n,): z along the outward surface normal, origin on the surface.
    quadrotors : Pose
        Quadrotor poses X_SQ, batch (n,).
    cable_length : (n,) array
        Cable lengths [m].
    description : str
        One sentence about the demonstration.
    label : str
        Name of the skill that is learnt from it.

    Examples
    --------
    >>> from drake_aerial import Demonstration, read_scan
    >>> shown = Demonstration.make(read_scan("box_68x61x28"), [0.2, 0.0, 0.14], cable_length=0.6)
    >>> shown.quadrotors.p.round(2).tolist()
    [[0.2, 0.0, 0.74]]
    """

    name: str
    cloud: PointCloud
    grippers: Pose
    quadrotors: Pose
    cable_length: Array
    description: str
    label: str

    def __len__(self) -> int:
        """Return the number of grippers n."""
        return len(self.cable_length)

    @classmethod
    def make(
        cls,
        cloud: PointCloud,
        positions: ArrayLike,
        *,
        axes: ArrayLike | None = None,
        cable_length: ArrayLike = CABLE_LENGTH,
        cable_directions: ArrayLike | None = None,
        name: str = "demonstration",
        description: str = "",
        label: str | None = None,
    ) -> Demonstration:
        """Make a demonstration of grippers at `positions` on a cloud.

        Parameters
        ----------
        cloud : PointCloud
            The visible surface, in its frame S.
        positions : (n, 3) or (3,) array
            Gripper positions on the surface, in S [m].
        axes : (n, 3) array, optional
            Gripper axes, along the outward surface normals, in S; of any length. Default: up.
        cable_length : float or (n,) array
            Cable lengths [m].
        cable_directions : (n, 3) array, optional
            Directions from each gripper to its quadrotor, in S; of any length. Default: up.
        name, description, label : str
            Name, description and label; the label is the name by default.

        Raises
        ------
        InputError
            If a shape is wrong, a direction vanishes, a cable has no length, or the cloud's `up`
            is not known.
        """
        cloud.require_up()
        p = np.atleast_2d(np.asarray(positions, float))
        if p.ndim != 2 or p.shape[1] != 3 or len(p) == 0 or not np.isfinite(p).all():
            raise InputError(
                f"`positions` must be finite and of shape (n, 3), got {np.shape(positions)}"
            )
        z = _directions(axes, cloud.up, len(p), "axes")
        along = _directions(cable_directions, cloud.up, len(p), "cable_directions")
        length = np.broadcast_to(np.asarray(cable_length, float), (len(p),)).copy()
        if not np.all(np.isfinite(length) & (length > 0.0)):
            raise InputError(f"`cable_length` must be positive, in metres, got {length.tolist()}")
        x = perpendicular(cloud.up)
        level = quat_from_xz(x, cloud.up)
        # The gripper's x axis is as close as possible to a fixed horizontal one.
        tilted = np.abs(z @ x) > 0.999
        grippers = Pose(p, quat_from_xz(np.where(tilted[:, None], cloud.up, x), z))
        quadrotors = Pose(p + length[:, None] * along, np.tile(level, (len(p), 1)))
        return cls(name, cloud, grippers, quadrotors, length, description, label or name)

    @classmethod
    def read(cls, path_or_name: str | Path) -> Demonstration:
        """Read a demonstration from a YAML file, or a shipped one by name.

        The file has a `cloud` (see `demonstration_file.CloudEntry`) and a list of `grippers`.
        `name`, `label` and `description` are optional. Each gripper has a `position` [m]. Optional
        are its `axis` or `quaternion_wxyz`, its `cable_length` [m], and its `cable_direction` or
        the position of its `quadrotor` [m]. All are in the cloud's frame.

        Raises
        ------
        InputError
            If the file is missing or not YAML, a key is unknown or missing, a value is of the wrong
            kind, or the cloud cannot be read.
        """
        path = model_files.find("demonstrations", path_or_name)
        content = read_record(DemonstrationFile, path)
        try:
            cloud = read_cloud(content.cloud, path.parent)
        except InputError as error:
            raise InputError(f"{path}: `cloud`: {error}") from error
        name = content.name or path.stem
        cables = [_cable(gripper, cloud.up) for gripper in content.grippers]
        demonstration = cls.make(
            cloud,
            np.array([gripper.position for gripper in content.grippers]),
            axes=np.array([cloud.up if g.axis is None else g.axis for g in content.grippers]),
            cable_length=np.array([length for length, _ in cables]),
            cable_directions=np.array([direction for _, direction in cables]),
            name=name,
            description=content.description.strip(),
            label=content.label or name,
        )
        q = demonstration.grippers.q.copy()
        for n, gripper in enumerate(content.grippers):
            if gripper.quaternion_wxyz is not None:
                q[n] = quat_normalize(np.array(gripper.quaternion_wxyz))
        return replace(demonstration, grippers=Pose(demonstration.grippers.p, q))


def _cable(gripper: GripperEntry, up: Array) -> tuple[float, Array]:
    """Return the length [m] of a gripper's cable and its direction."""
    direction, length = up, CABLE_LENGTH
    if gripper.cable_direction is not None:
        direction = np.array(gripper.cable_direction)
    if gripper.quadrotor is not None:
        direction = np.subtract(gripper.quadrotor, gripper.position)
        length = float(np.linalg.norm(direction))
    return gripper.cable_length or length, direction


def _directions(values: ArrayLike | None, default: Array, count: int, name: str) -> Array:
    """Return unit directions (count, 3), or as many times the default direction (3,)."""
    d = np.tile(default, (count, 1)) if values is None else np.atleast_2d(np.asarray(values, float))
    if d.shape != (count, 3):
        raise InputError(f"`{name}` must be of shape ({count}, 3), got {d.shape}")
    length = np.linalg.norm(d, axis=1, keepdims=True)
    if not np.all(length > 1e-9):
        raise InputError(f"`{name}` must be vectors of positive length, got {d.tolist()}")
    return d / length
