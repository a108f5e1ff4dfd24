"""Join the parts of one object: over noise, inside hollow things, behind occluders, at handles."""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_aerial.geometry import Array
from drake_aerial.scene.creases import JUMP_DEVIATIONS
from drake_aerial.scene.parameters import SceneParameters
from drake_aerial.scene.part_groups import Groups
from drake_aerial.scene.parts import Part
from drake_aerial.scene.regions import find_rims, nearest_labelled
from drake_aerial.scene.surfaces import Surfaces

Labels = NDArray[np.int64]
# Pairs of pixels closer than this see the same rim; wider gaps are shadows [pixels].
_CLOSE = 8.0
# Least number of pixels [and of votes more for than against] by which parts are neighbours.
_LEAST_RIM, _LEAST_VOTES = 8, 4.0
# Surfaces jump if their points are farther apart than their pixels by this length [m].
_APART = 0.02
# Facing up: cosine of the angle to the vertical.
_UP, _WALL = 0.75, 0.5
# A hollow thing's top faces cover at most this share of its footprint.
_HOLLOW = 0.35
# Rims of a hollow thing are level within this share of its height, and at least this length [m].
_LEVEL_SHARE, _LEVEL = 0.15, 0.01
# The common width of a near and a far wall, as a share of their whole width.
_WIDTH = 0.5
# The viewer must look into a hollow thing from this far [deg] above.
_INTO = 10.0
# A floor's share inside the footprint of its walls.
_INSIDE = 0.8


@dataclass(frozen=True, eq=False)
class Contact:
    """The common rim of two labels.

    Attributes
    ----------
    own, other : (K,) int array
        Flat pixels of the lower and the higher label.
    gap : (K,) array
        Pixels between them.
    jump, concave : (K,) bool array
        Whether the surface jumps or is concave there.
    nearer : (K,) bool array
        Whether the lower label's surface is in front of the other's.
    """

    own: Labels
    other: Labels
    gap: Array
    jump: NDArray[np.bool_]
    concave: NDArray[np.bool_]
    nearer: NDArray[np.bool_]


def find_contacts(
    labels: Labels, surfaces: Surfaces, parameters: SceneParameters
) -> dict[tuple[int, int], Contact]:
    """Return the common rims of all pairs of labels (lower, higher)."""
    rims = find_rims(labels, nearest_labelled(labels), parameters.widest_shadow)
    flat = labels.ravel()
    swap = flat[rims.first] > flat[rims.second]
    own = np.where(swap, rims.second, rims.first)
    other = np.where(swap, rims.first, rims.second)
    planes = surfaces.planes
    rays = planes.rays.reshape(-1, 2)
    coefficients = planes.coefficients.reshape(-1, 3)
    normal = planes.normal.reshape(-1, 3)
    points = surfaces.points.reshape(-1, 3)

    def lead(at: Labels) -> Array:
        """Return how far the plane at `own` is in front of that at `other`, at a pixel."""
        difference = coefficients[own] - coefficients[other]
        return towards * ((difference[:, :2] * rays[at]).sum(axis=1) + difference[:, 2])

    # Along the line from one pixel to the other and half as far beyond, the two planes meet, or
    # come as close as the noise, where the surface is continuous.
    towards = 1.0 if planes.perspective else -1.0
    at_own, at_other = lead(own), lead(other)
    step = 0.5 * (at_other - at_own)
    ends = np.stack([at_own - step, at_other + step])
    least = np.where(np.sign(ends[0]) != np.sign(ends[1]), 0.0, np.abs(ends).min(axis=0))
    jump = ~(least <= JUMP_DEVIATIONS * planes.noise)
    # Planes may meet by chance: the points must be as close as their pixels, too.
    lateral = np.linalg.norm(rays[own] - rays[other], axis=1)
    if planes.perspective:
        lateral *= np.minimum(points[own, 2], points[other, 2])
    jump |= np.linalg.norm(points[own] - points[other], axis=1) > _APART + 3.0 * lateral
    limit = planes.least_angle(parameters.concave_angle).ravel()[own]
    bent = (normal[own] * normal[other]).sum(axis=1) < np.cos(limit)
    lean = ((normal[own] - normal[other]) * (points[own] - points[other])).sum(axis=1)
    nearer = points[own, 2] < points[other, 2]
    key = flat[own] * (flat.max() + 1) + flat[other]
    order = np.argsort(key, kind="stable")
    found = {}
    for run in np.split(order, np.flatnonzero(np.diff(key[order])) + 1):
        if len(run):
            pair = int(flat[own[run[0]]]), int(flat[other[run[0]]])
            found[pair] = Contact(
                own[run],
                other[run],
                rims.gap[run],
                jump[run],
                (bent & (lean < 0.0))[run],
                nearer[run],
            )
    return found


def join_convex(groups: Groups, contacts: dict[tuple[int, int], Contact]) -> None:
    """Join parts whose common rims are mostly convex or smooth.

    Each pair of pixels across a rim votes: for one object where the surface is convex or smooth,
    against it where the surface jumps or is concave. Greedy additive edge contraction (Keuper et
    al., 2015): the two groups with most votes for each other are joined, their votes for others
    are added, until no pair has more votes for than against. A short leak does not join objects
    that a long edge parts.
    """
    votes: dict[int, dict[int, float]] = {number: {} for number in groups.parts}
    for (first, second), contact in contacts.items():
        if first in groups.parts:
            close = contact.gap <= _CLOSE
            parted = contact.jump[close] | contact.concave[close]
            votes[first][second] = votes[second][first] = float((1.0 - 2.0 * parted).sum())
    queue = [(-weight, a, b) for a in votes for b, weight in votes[a].items() if a < b]
    heapq.heapify(queue)
    while queue and queue[0][0] < -_LEAST_VOTES:
        cost, first, second = heapq.heappop(queue)
        if votes.get(first, {}).get(second) != -cost:
            continue
        groups.join(first, second)
        for other, weight in votes.pop(second).items():
            del votes[other][second]
            if other != first:
                total = votes[first].get(other, 0.0) + weight
                votes[first][other] = votes[other][first] = total
                heapq.heappush(queue, (-total, min(first, other), max(first, other)))


def join_hollow(
    groups: Groups, contacts: dict[tuple[int, int], Contact], p_U_viewer: Array | None
) -> set[int]:
    """Join the walls of bowls, cups and trays; return the groups that are hollow.

    Seen from above, a closed thing shows its top. Two walls with level rims and no top between them
    belong to one hollow thing: neighbours in a concave edge, or the near wall and the far wall
    behind its rim.
    """
    hollow: set[int] = set()
    changed = True
    while changed:
        changed = False
        for (first, second), contact in [*contacts.items(), *_across_floors(groups, contacts)]:
            if first not in groups.parts or groups.of(first) == groups.of(second):
                continue
            walls = groups.part(first), groups.part(second)
            if not _level_rims(*walls) or not _open(walls, p_U_viewer):
                continue
            if contact is None:
                away = [np.linalg.norm(wall.points.mean(axis=0)) for wall in walls]
                near, far = walls if away[0] < away[1] else walls[::-1]
                if min(map(_wall_share, walls)) > 0.8 and _same_width(near, far, p_U_viewer):
                    changed |= groups.join(first, second)
                    hollow.add(groups.of(first))
                continue
            beside = np.count_nonzero(~contact.jump & contact.concave & (contact.gap <= _CLOSE))
            if beside >= 0.3 * len(contact.own) and min(map(_wall_share, walls)) > 0.8:
                changed |= groups.join(first, second)
                continue
            if np.mean(contact.jump) < 0.5:
                continue
            near, far = walls if np.mean(contact.nearer) > 0.5 else walls[::-1]
            if _same_width(near, far, p_U_viewer):
                changed |= groups.join(first, second)
                hollow.add(groups.of(first))
    return {groups.of(number) for number in hollow}


def _across_floors(
    groups: Groups, contacts: dict[tuple[int, int], Contact]
) -> list[tuple[tuple[int, int], None]]:
    """Return pairs of groups that both have a rim in common with a low, flat part."""
    beside: dict[int, set[int]] = {}
    for first, second in contacts:
        if first in groups.parts:
            beside.setdefault(first, set()).add(groups.of(second))
            beside.setdefault(second, set()).add(groups.of(first))
    found = set()
    for number, around in beside.items():
        if np.mean(groups.parts[number].normals[:, 2] > _UP) > 0.6:
            heads = sorted(around - {groups.of(number)})
            found |= {(a, b) for k, a in enumerate(heads) for b in heads[k + 1 :]}
    return [(pair, None) for pair in sorted(found)]


def join_floors(groups: Groups, hollow: set[int]) -> None:
    """Join the floors that lie inside hollow groups, below their rims."""
    for head in sorted(hollow):
        for number, part in groups.parts.items():
            if groups.of(number) == groups.of(head):
                continue
            whole = groups.part(head)
            low = np.percentile(part.height, 95) < np.percentile(whole.height, 95) - _LEVEL
            flat = np.mean(part.normals[:, 2] > _UP) > 0.6
            if flat and low and inside_share(part.points, whole.points) > _INSIDE:
                groups.join(head, number)


def _level_rims(first: Part, second: Part) -> bool:
    tops = [np.percentile(part.height, 97) for part in (first, second)]
    return bool(abs(tops[0] - tops[1]) < max(_LEVEL, _LEVEL_SHARE * max(tops)))


def _wall_share(part: Part) -> float:
    return float(np.mean(part.normals[:, 2] < _UP))


def _open(walls: tuple[Part, Part], p_U_viewer: Array | None) -> bool:
    """Return whether two walls' tops cover little of their footprint, seen from above."""
    points = np.concatenate([wall.points for wall in walls])
    height = np.concatenate([wall.height for wall in walls])
    normals = np.concatenate([wall.normals for wall in walls])
    area = np.concatenate([wall.area for wall in walls])
    if p_U_viewer is not None:
        away = p_U_viewer - points[np.argmax(height)]
        if away[2] < np.tan(np.deg2rad(_INTO)) * np.linalg.norm(away[:2]):
            return False
    top = height > np.percentile(height, 97) - max(_LEVEL, 0.5 * np.ptp(height))
    covered = float((area * normals[:, 2])[top & (normals[:, 2] > _UP)].sum())
    return covered < _HOLLOW * _hull_area(points[:, :2])


def _same_width(near: Part, far: Part, p_U_viewer: Array | None) -> bool:
    """Return whether a far wall lies behind a near one over most of their width."""
    if p_U_viewer is None:
        return False
    middle = near.points[:, :2].mean(axis=0) - p_U_viewer[:2]
    across = np.array([-middle[1], middle[0]]) / max(np.linalg.norm(middle), 1e-9)
    ends = np.array([np.percentile(part.points[:, :2] @ across, [1, 99]) for part in (near, far)])
    common = ends[:, 1].min() - ends[:, 0].max()
    return bool(common > _WIDTH * np.ptp(ends))


def _hull_area(flat: Array) -> float:
    import cv2

    hull = cv2.convexHull(flat.astype(np.float32))
    return float(cv2.contourArea(hull))


def inside_share(points: Array, around: Array) -> float:
    """Return the share of points (N, 3) whose footprint is in the hull of others' (M, 3)."""
    import cv2

    hull = cv2.convexHull(around[:, :2].astype(np.float32))
    chosen = points[:: max(1, len(points) // 200), :2].astype(np.float32)
    return float(
        np.mean([cv2.pointPolygonTest(hull, tuple(map(float, p)), False) >= 0 for p in chosen])
    )
