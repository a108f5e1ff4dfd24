"""Join parts of one object that something in front separates, and parts that hang in the air."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from drake_aerial.geometry import Array
from drake_aerial.scene.merging import _CLOSE, _LEAST_RIM, Contact
from drake_aerial.scene.part_groups import Groups
from drake_aerial.scene.parts import Part
from drake_aerial.scene.scene import SUPPORT
from drake_aerial.scene.scene_image import SceneImage
from drake_aerial.scene.surfaces import Surfaces

Labels = NDArray[np.int64]
# Two parts continue each other if this share of the smaller one's points lie on planes of the
# other, within this distance [m] beyond the noise and this angle [deg].
_CONTINUED, _COPLANAR, _ALIGNED = 0.5, 0.008, 12.0
# Points of a part and planes of the other that are compared.
_POINTS, _PLANES = 300, 60
# Of the lines between two parts, this share must be behind what is in front.
_HIDDEN = 0.8
# Edges across a rim of at most this many pixels, without a wider gap than this, are noise.
_SHORT_RIM, _NARROW_GAP = 16, 6.0
# Parts whose lowest points are this high [m] and under which nothing stands hang in the air.
_FLOATING = 0.02
# A part hangs on the thing that is nearest, at most this far away [m].
_HANGS = 0.04
# Parts that hang on a thing, such as handles, have less than this share of its pixels.
_SMALL = 0.2


def join_behind_occluders(
    groups: Groups,
    contacts: dict[tuple[int, int], Contact],
    image: SceneImage,
    surfaces: Surfaces,
    R_UC: Array,
) -> None:
    """Join groups that continue each other behind a group that is in front of both."""
    in_front = _occluders(groups, contacts)
    heads = sorted(in_front)
    for k, first in enumerate(heads):
        for second in heads[k + 1 :]:
            common = {groups.of(n) for n in in_front[first]} & {
                groups.of(n) for n in in_front[second]
            }
            common -= {groups.of(first), groups.of(second)}
            if not common or groups.of(first) == groups.of(second):
                continue
            parts = groups.part(first), groups.part(second)
            if continue_each_other(*parts, surfaces) and _is_hidden_between(
                *parts, image, surfaces, R_UC
            ):
                groups.join(first, second)


def join_strips(
    groups: Groups, contacts: dict[tuple[int, int], Contact], surfaces: Surfaces
) -> None:
    """Join parts with a short common rim that continue each other: such edges are noise."""
    for (first, second), contact in contacts.items():
        if first == SUPPORT or groups.of(first) == groups.of(second):
            continue
        close = contact.gap <= _NARROW_GAP
        if 0 < np.count_nonzero(close) <= _SHORT_RIM and contact.jump[close].mean() < 0.5:
            parts = sorted(
                (groups.parts[first], groups.parts[second]), key=lambda part: len(part.pixels)
            )
            if _explained(parts[0], parts[1], surfaces) > _CONTINUED:
                groups.join(first, second)


def _occluders(groups: Groups, contacts: dict[tuple[int, int], Contact]) -> dict[int, set[int]]:
    """Return for each group those that are in front of it across a jump."""
    found: dict[int, set[int]] = {}
    for (first, second), contact in contacts.items():
        if first == SUPPORT:
            continue
        for own, other, nearer in (
            (first, second, ~contact.nearer),
            (second, first, contact.nearer),
        ):
            if np.count_nonzero((contact.jump & nearer) | contact.concave) >= 5:
                found.setdefault(groups.of(own), set()).add(groups.of(other))
    return found


def continue_each_other(first: Part, second: Part, surfaces: Surfaces) -> bool:
    """Return whether the faces of two parts lie in the same planes."""
    shares = [_explained(first, second, surfaces), _explained(second, first, surfaces)]
    return (
        min(shares) > 0.5 * _CONTINUED
        and shares[len(first.pixels) > len(second.pixels)] > _CONTINUED
    )


def _explained(part: Part, by: Part, surfaces: Surfaces) -> float:
    """Return the share of a part's points that lie on local planes of another part."""
    points, normals = (
        values[:: max(1, len(values) // _POINTS)] for values in (part.points, part.normals)
    )
    chosen = slice(None, None, max(1, len(by.points) // _PLANES))
    offset = (by.normals[chosen] * by.points[chosen]).sum(axis=1)
    distance = np.abs(points @ by.normals[chosen].T - offset)
    noise = float(np.median(surfaces.depth_noise.ravel()[part.pixels]))
    near = distance < _COPLANAR + 2.0 * noise
    aligned = normals @ by.normals[chosen].T > np.cos(np.deg2rad(_ALIGNED))
    # A plane is a face if several of the other's points agree.
    return float(np.mean((near & aligned).sum(axis=1) >= max(2, 0.05 * near.shape[1])))


def _is_hidden_between(
    first: Part, second: Part, image: SceneImage, surfaces: Surfaces, R_UC: Array
) -> bool:
    """Return whether the lines between two parts pass behind what the image shows."""
    distance, nearest = cKDTree(first.points).query(second.points)
    close = np.argsort(distance)[:: max(1, len(distance) // 40)][:20]
    starts, ends = first.points[nearest[close]], second.points[close]
    steps = np.linspace(0.0, 1.0, 14)[1:-1]
    between_U = starts[:, None] + steps[:, None] * (ends - starts)[:, None]
    between_C = between_U.reshape(-1, 3) @ R_UC
    rows, columns = np.rint(image.pixels_of(between_C)).astype(np.int64).T
    height, width = image.shape
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    rows, columns, depth = rows[inside], columns[inside], between_C[inside, 2]
    own = np.zeros(height * width, dtype=bool)
    own[first.pixels] = own[second.pixels] = True
    outside = ~own[rows * width + columns]
    if np.count_nonzero(outside) < 10:
        return False
    seen = surfaces.points[rows, columns, 2]
    hidden = ~(seen > depth + _COPLANAR)
    return bool(hidden[outside].mean() > _HIDDEN)


def join_floating(
    groups: Groups,
    contacts: dict[tuple[int, int], Contact],
    image: SceneImage,
    surfaces: Surfaces,
    R_UC: Array,
) -> None:
    """Join groups under which nothing stands, such as handles, to the nearest group."""
    normals_up = surfaces.planes.normal.reshape(-1, 3) @ R_UC[2]
    size = {
        head: sum(len(groups.parts[n].pixels) for n in numbers)
        for head, numbers in groups.members().items()
    }
    for head in sorted(size, key=lambda head: size[head]):
        if groups.of(head) != head or _is_carried(head, groups, contacts, image, normals_up, R_UC):
            continue
        part, best, least = groups.part(head), None, _HANGS
        for other in {groups.of(number) for number in groups.parts} - {head}:
            whole = groups.part(other)
            if len(part.pixels) < _SMALL * len(whole.pixels):
                gap = float(np.percentile(cKDTree(whole.points).query(part.points)[0], 2))
                if gap < least:
                    best, least = other, gap
        if best is not None:
            groups.join(head, best)


def _is_carried(
    head: int,
    groups: Groups,
    contacts: dict[tuple[int, int], Contact],
    image: SceneImage,
    normals_up: Array,
    R_UC: Array,
) -> bool:
    """Return whether a group stands on something, or what carries it may be hidden."""
    part = groups.part(head)
    if np.percentile(part.height, 3) < _FLOATING:
        return True
    middle = part.points.mean(axis=0)
    # Where a point 1 cm lower is seen, in pixels.
    ends = image.pixels_of(np.array([middle, middle - [0.0, 0.0, 0.01]]) @ R_UC)
    down = (ends[1] - ends[0]) / max(float(np.linalg.norm(ends[1] - ends[0])), 1e-9)
    width = image.shape[1]
    rim = hidden = free = 0
    across = np.array([-down[1], down[0]])
    pixels = np.stack(np.divmod(part.pixels, width), axis=1)
    span = float(np.ptp(np.percentile(pixels @ across, [2, 98])))
    for (first, second), contact in contacts.items():
        sides = [groups.of(n) if n != SUPPORT else SUPPORT for n in (first, second)]
        if head not in sides or sides[0] == sides[1]:
            continue
        is_first = sides[0] == head
        own, other = (contact.own, contact.other) if is_first else (contact.other, contact.own)
        nearer = ~contact.nearer if is_first else contact.nearer
        carrying = ~contact.jump & (contact.gap < _CLOSE) & ~(normals_up[other] < 0.5)
        if np.count_nonzero(carrying) >= _LEAST_RIM:
            return True
        step = np.stack(np.divmod(other, width), 1) - np.stack(np.divmod(own, width), 1)
        below = step @ down > 0.7 * np.linalg.norm(step, axis=1)
        free += int((below & contact.jump & ~nearer & (SUPPORT in sides)).sum())
        rim += len(own)
        hidden += int((contact.jump & nearer).sum())
    return not free > max(_LEAST_RIM, 0.4 * span) and hidden > 0.15 * max(rim, 1)
