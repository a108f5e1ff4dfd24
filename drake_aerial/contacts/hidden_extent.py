"""Horizontal dimensions of an object that are not fully seen, and limits of its contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_aerial.contacts.votes.hull_votes import HullVotes
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.geometry import Array, Pose, rotate
from drake_aerial.skill.contact_skill import ContactSkill

# Largest extent that is allowed for, in seen extents and in extents by the demonstrated proportion.
_MOST_SEEN, _MOST_PROPORTIONAL = 2.0, 1.6
# Error of a contact on an object that is seen whole [m]; it widens the intervals.
_TOLERANCE = 0.02
# Distance from the votes' mode within which votes say how the object is turned [m].
_NEAR_MODE = 0.05
_YAW_BINS = 36


@dataclass(frozen=True, eq=False)
class HiddenExtent:
    """Horizontal dimension of an object of which one end or both are not seen.

    Attributes
    ----------
    direction : (3,) array
        Unit direction in the cloud's frame S, towards an end that is not seen.
    cause : str
        `occluded` (another thing hides that end) or `cut` (the view ends there).
    low, high : (n,) arrays
        Limits of the coordinate direction . p of each gripper's contact in S [m]. They follow from
        the demonstrated proportion, on the smallest object that is seen and on the largest one that
        is allowed for.
    """

    direction: Array
    cause: str
    low: Array
    high: Array

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of contacts.json."""
        return {
            "direction": self.direction.tolist(),
            "cause": self.cause,
            "coordinates": np.column_stack([self.low, self.high]).tolist(),
        }

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> HiddenExtent:
        """Return the extent of an entry of contacts.json; the inverse of `to_dict`."""
        direction = np.array(values["direction"], float)
        limits = np.array(values["coordinates"], float)
        if direction.shape != (3,) or limits.ndim != 2 or limits.shape[1] != 2:
            raise ValueError(
                "`hidden` must have a direction (3,) and coordinates (n, 2), got "
                f"{direction.shape} and {limits.shape}"
            )
        return cls(direction, str(values["cause"]), limits[:, 0], limits[:, 1])

    def about(self, position: Array, gripper: int = 0) -> tuple[float, float]:
        """Return the limits [m] along the direction relative to a contact's position (3,) in S."""
        at = float(self.direction @ position)
        return float(self.low[gripper]) - at, float(self.high[gripper]) - at

    def sentences(self, positions: Array) -> list[str]:
        """Return one line for each contact (n, 3) in S: where it may be instead."""
        axis = " ".join(f"{x:+.2f}" for x in self.direction)
        lines = []
        for k, position in enumerate(positions):
            low, high = self.about(position, k)
            lines.append(
                f"the end of the object along ({axis}) is {self.cause}: contact {k + 1} may lie "
                f"{100 * low:+.0f} to {100 * high:+.0f} cm along it; look from another side"
            )
        return lines


def hidden_extents(
    skill: ContactSkill, votes: HullVotes | None, hull: HorizontalHull, X_SN: Pose
) -> tuple[HiddenExtent, ...]:
    """Return the dimensions of an object that are not known; none for a known or whole outline.

    Parameters
    ----------
    skill : ContactSkill
        The learnt skill, for n grippers.
    votes : HullVotes or None
        Votes on the object. Without votes, nothing is said.
    hull : HorizontalHull
        Hull of the object's features in its canonical frame N.
    X_SN : Pose
        N in the cloud's frame S.
    """
    if votes is None or not votes.cuts or votes.cuts.outline is None:
        return ()
    axis = _main_direction(votes.cuts.flags)
    found = []
    for e in (axis, np.array([-axis[1], axis[0]])):
        ahead, behind = bool(votes.cuts.towards(e)), bool(votes.cuts.towards(-e))
        if not (ahead or behind):
            continue
        low, high = _limits(skill, _yaw(votes), hull, e, behind, ahead)
        if behind and not ahead:
            e, low, high = -e, -high, -low
        direction = rotate(X_SN.q, np.append(e, 0.0))
        offset = float(direction @ X_SN.p)
        cause = "cut" if votes.cuts.outline.cut else "occluded"
        found.append(HiddenExtent(direction, cause, low + offset, high + offset))
    return tuple(found)


def _main_direction(flags: np.ndarray) -> Array:
    """Return the mean (2,) of the longest run of flagged directions."""
    doubled = np.concatenate([flags, flags]).astype(int)
    change = np.flatnonzero(np.diff(doubled, prepend=0, append=0)).reshape(-1, 2)
    first, last = max(change, key=lambda run: min(run[1] - run[0], len(flags)))
    angle = 2.0 * np.pi * 0.5 * (first + min(last, first + len(flags)) - 1) / len(flags)
    return np.array([np.cos(angle), np.sin(angle)])


def _yaw(votes: HullVotes) -> float:
    """Return the yaw [rad] by which the demonstrated object is turned onto the new one."""
    mode = votes.density.mode
    if votes.with_yaw:
        return float(mode[2])
    near = np.linalg.norm(votes.positions - mode[:2], axis=1) < _NEAR_MODE
    count, edges = np.histogram(
        votes.yaw[near], _YAW_BINS, (0.0, 2.0 * np.pi), weights=votes.weights[near]
    )
    best = int(np.argmax(count + np.roll(count, 1) + np.roll(count, -1)))
    return float(0.5 * (edges[best] + edges[best + 1]))


def _limits(
    skill: ContactSkill, yaw: float, hull: HorizontalHull, e: Array, behind: bool, ahead: bool
) -> tuple[Array, Array]:
    """Return the limits (n,) of the contacts' coordinates along e in N [m]."""
    c, s = np.cos(yaw), np.sin(yaw)
    e_old = np.array([c * e[0] + s * e[1], c * e[1] - s * e[0]])
    turned, turned_old = np.array([-e[1], e[0]]), np.array([-e_old[1], e_old[0]])
    least, most = _span(hull, e)
    across = np.ptp(_span(hull, turned)) / np.ptp(_span(skill.hull, turned_old))
    old_least, old_most = _span(skill.hull, e_old)
    seen, length = most - least, old_most - old_least
    growth = max(_MOST_SEEN * seen, _MOST_PROPORTIONAL * across * length) - seen
    share = (skill.X_NG.p[:, :2] @ e_old - old_least) / length
    low = (1.0 - share) * (least - growth * behind) + share * most
    high = (1.0 - share) * least + share * (most + growth * ahead)
    return np.minimum(low, high) - _TOLERANCE, np.maximum(low, high) + _TOLERANCE


def _span(hull: HorizontalHull, e: Sequence[float] | Array) -> tuple[float, float]:
    along = hull.vertices @ np.asarray(e)
    return float(along.min()), float(along.max())
