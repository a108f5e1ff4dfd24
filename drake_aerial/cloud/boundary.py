"""Boundary of an object in a view: the object's end, a nearer thing, or the end of the view."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from drake_aerial.geometry import Array, Pose, transform


class BoundaryKind(IntEnum):
    """Kind of a boundary point of an object in a view: seen, occluded or cut."""

    SEEN = 0
    """The object ends here: what lies beyond is farther away, or the support it stands on."""
    OCCLUDED = 1
    """A nearer thing hides what lies beyond; the object may go on."""
    CUT = 2
    """The view ends here, at the image's border or where the sensor gave nothing."""


@dataclass(frozen=True, eq=False)
class Boundary:
    """Points on the boundary of an object in a view, and the kind of each.

    Attributes
    ----------
    points : (K, 3) array
        Points of the object beside its boundary [m], in the cloud's frame.
    kind : (K,) int8 array
        The `BoundaryKind` at each point.
    """

    points: Array
    kind: NDArray[np.int8]

    def __len__(self) -> int:
        return len(self.points)

    def points_of(self, kind: BoundaryKind) -> Array:
        """Return the points (M, 3) [m] of one kind."""
        return self.points[self.kind == kind]

    def share(self, kind: BoundaryKind) -> float:
        """Return the fraction of the boundary's points that are of one kind; 0 without points."""
        return float(np.mean(self.kind == kind)) if len(self.kind) else 0.0

    def transformed(self, X_NS: Pose) -> Boundary:
        """Return the boundary in another frame N, where `X_NS` is the pose of its own frame S."""
        return Boundary(transform(X_NS, self.points), self.kind)
