"""The content of a demonstration file (DEMONSTRATION.yaml)."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from annotated_types import Len

from drake_aerial.errors import InputError
from drake_aerial.io.records import Name, Number, Positive, Vector, record
from drake_aerial.skill.demonstration_cloud import CloudEntry


@record(frozen=True)
class GripperEntry:
    """A gripper of a demonstration file, in the cloud's frame S."""

    position: Vector
    """Position on the surface [m]."""
    axis: Vector | None = None
    """Outward surface normal of any length (dimensionless); None for up, or if `quaternion_wxyz` is
    given."""
    quaternion_wxyz: tuple[Number, Number, Number, Number] | None = None
    """Orientation q_SG, z along the outward normal (dimensionless)."""
    cable_length: Positive | None = None
    """Length of the cable [m]; None for the distance to `quadrotor`, or 0.5 without one."""
    cable_direction: Vector | None = None
    """Direction from gripper to quadrotor, of any length (dimensionless); None for up."""
    quadrotor: Vector | None = None
    """Position of the quadrotor [m]."""

    def __post_init__(self) -> None:
        for one, other in (("axis", "quaternion_wxyz"), ("cable_direction", "quadrotor")):
            if getattr(self, one) is not None and getattr(self, other) is not None:
                raise InputError(f"only one of `{one}` and `{other}` may be given, got both")
        if self.quaternion_wxyz is not None and np.linalg.norm(self.quaternion_wxyz) < 1e-6:
            raise InputError("`quaternion_wxyz` must not be zero")


@record(frozen=True)
class DemonstrationFile:
    """A DEMONSTRATION.yaml."""

    cloud: CloudEntry
    """The visible surface."""
    grippers: Annotated[tuple[GripperEntry, ...], Len(1)]
    """One entry per gripper."""
    name: Name | None = None
    """Name of the demonstration; None for the file's name."""
    label: Name | None = None
    """Label of the learnt skill; None for the name."""
    description: Name = ""
    """One sentence about the demonstration."""
