"""Find the objects on the supports: the labels of the pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_aerial.geometry import Array
from drake_aerial.scene.hidden_parts import join_behind_occluders, join_floating, join_strips
from drake_aerial.scene.merging import (
    Groups,
    find_contacts,
    join_floors,
    join_hollow,
    join_smooth,
)
from drake_aerial.scene.parameters import SceneParameters
from drake_aerial.scene.parts import Ground, find_parts, part_of
from drake_aerial.scene.regions import connected_regions, nearest_labelled
from drake_aerial.scene.scene import FIRST_OBJECT, NOTHING, SUPPORT
from drake_aerial.scene.scene_image import SceneImage
from drake_aerial.scene.surfaces import Surfaces

Labels = NDArray[np.int64]
# Left-over pixels take the label of a neighbour at most this far away [pixels], if their depths
# differ by at most this length [m].
_GROW, _GROW_DEPTH = 6.0, 0.03
# Objects have at least this share of their pixels over a support.
_OVER = 0.5


def find_labels(
    image: SceneImage, surfaces: Surfaces, ground: Ground, R_UC: Array, parameters: SceneParameters
) -> Labels:
    """Return the labels (H, W): 0 nothing, 1 support, 2 and up objects, the largest first."""
    labels = find_parts(surfaces, ground)
    numbers = range(FIRST_OBJECT, int(labels.max()) + 1)
    order = np.argsort(labels.ravel(), kind="stable")
    starts = np.searchsorted(labels.ravel()[order], np.arange(labels.max() + 2))
    groups = Groups(
        {n: part_of(order[starts[n] : starts[n + 1]], surfaces, ground, R_UC) for n in numbers}
    )
    contacts = find_contacts(labels, surfaces, parameters)
    viewer = None if image.viewpoint is None else np.zeros(3)
    join_smooth(groups, contacts)
    join_strips(groups, contacts, surfaces)
    hollow = join_hollow(groups, contacts, viewer)
    islands = connected_regions(ground.support, 20)
    pieces = {
        -k: part_of(np.flatnonzero(islands == k), surfaces, ground, R_UC)
        for k in range(2, int(islands.max(initial=0)) + 1)
    }
    for island, head in join_floors(groups, labels, hollow, contacts, pieces):
        labels.ravel()[pieces[island].pixels] = head
    join_floating(groups, contacts, image, surfaces, R_UC)
    join_behind_occluders(groups, contacts, image, surfaces, R_UC)
    head_of = np.arange(labels.max() + 1)
    for number in numbers:
        head_of[number] = groups.of(number)
    labels = head_of[labels]
    grown = _grow(labels, surfaces, ground)
    return _numbered(grown, ground, parameters)


def _grow(labels: Labels, surfaces: Surfaces, ground: Ground) -> Labels:
    """Give pixels that are left over on edges the label of the nearest object's pixel."""
    nearest = nearest_labelled(np.where(labels >= FIRST_OBJECT, labels, 0))
    depth = surfaces.points[..., 2]
    near = np.abs(depth - depth.ravel()[nearest.pixel]) < _GROW_DEPTH
    take = (labels == NOTHING) & ground.candidates & near & (nearest.distance <= _GROW)
    return np.where(take, labels.ravel()[nearest.pixel], labels)


def _numbered(labels: Labels, ground: Ground, parameters: SceneParameters) -> Labels:
    """Return the labels without what is no object, numbered by size."""
    found = []
    for number in np.unique(labels):
        if number < FIRST_OBJECT:
            continue
        pixels = labels == number
        count = np.count_nonzero(pixels)
        high = np.percentile(ground.height[pixels], 98) >= parameters.min_height
        if count >= parameters.min_pixels and high and ground.over[pixels].mean() >= _OVER:
            found.append((count, number))
    renumbered = np.zeros(labels.max() + 1, dtype=np.int64)
    renumbered[SUPPORT] = SUPPORT
    for k, (_, number) in enumerate(sorted(found, reverse=True)):
        renumbered[number] = FIRST_OBJECT + k
    return renumbered[labels]
