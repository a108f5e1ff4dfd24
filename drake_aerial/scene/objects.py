"""Find the objects on the supports: the labels of the pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_aerial.geometry import Array
from drake_aerial.scene.hidden_parts import join_behind_occluders, join_floating, join_strips
from drake_aerial.scene.merging import (
    find_contacts,
    join_convex,
    join_floors,
    join_hollow,
)
from drake_aerial.scene.parameters import SceneParameters
from drake_aerial.scene.part_groups import Groups
from drake_aerial.scene.parts import Ground, find_parts, part_of
from drake_aerial.scene.regions import connected_regions, nearest_labelled
from drake_aerial.scene.scene import FIRST_OBJECT, NOTHING, SUPPORT
from drake_aerial.scene.scene_image import SceneImage
from drake_aerial.scene.surfaces import Surfaces

Labels = NDArray[np.int64]
# Left-over pixels take the label of a neighbour at most this far away [pixels], if their depths
# differ by at most this length [m].
_GROW, _GROW_DEPTH = 6.0, 0.03
# Islands of the support have at least this many pixels, and less than this share of the largest.
_ISLAND, _MAIN = 20, 0.1
# Objects have at least this share of their pixels over a support.
_OVER = 0.5


def find_labels(
    image: SceneImage, surfaces: Surfaces, ground: Ground, R_UC: Array, parameters: SceneParameters
) -> Labels:
    """Return the labels (H, W): 0 nothing, 1 support, 2 and up objects, the largest first."""
    labels = find_parts(surfaces, ground)
    islands = _islands(ground)
    labels = np.where(islands > 0, labels.max() + islands, labels)
    groups = _groups(labels, surfaces, ground, R_UC)
    join_convex(groups, find_contacts(labels, surfaces, parameters))
    labels = _joined(labels, groups)
    groups = _groups(labels, surfaces, ground, R_UC)
    contacts = find_contacts(labels, surfaces, parameters)
    viewer = None if image.viewpoint is None else np.zeros(3)
    join_strips(groups, contacts, surfaces)
    hollow = join_hollow(groups, contacts, viewer)
    join_floors(groups, hollow)
    join_floating(groups, contacts, image, surfaces, R_UC)
    join_behind_occluders(groups, contacts, image, surfaces, R_UC)
    labels = _joined(labels, groups)
    # Islands of the support that belong to no object are support again.
    own = islands > 0
    alone = np.setdiff1d(np.unique(labels[own]), np.unique(labels[~own]))
    labels[own & np.isin(labels, alone)] = SUPPORT
    grown = _grow(labels, surfaces, ground)
    return _numbered(grown, ground, parameters)


def _islands(ground: Ground) -> Labels:
    """Return small regions of the support (H, W), numbered from 1: a bowl's floor may be one."""
    regions = connected_regions(ground.support, _ISLAND)
    size = np.bincount(regions.ravel())
    size[0] = 0
    small = size < _MAIN * size.max()
    small[0] = False
    return (np.cumsum(small) * small)[regions]


def _groups(labels: Labels, surfaces: Surfaces, ground: Ground, R_UC: Array) -> Groups:
    """Return the parts of the labels (H, W), each as a group of its own."""
    flat = labels.ravel()
    order = np.argsort(flat, kind="stable")
    order = order[np.searchsorted(flat[order], FIRST_OBJECT) :]
    runs = np.split(order, np.flatnonzero(np.diff(flat[order])) + 1)
    return Groups(
        {int(flat[run[0]]): part_of(run, surfaces, ground, R_UC) for run in runs if len(run)}
    )


def _joined(labels: Labels, groups: Groups) -> Labels:
    """Return the labels with those of each group made one."""
    head_of = np.arange(labels.max() + 1)
    for number in groups.parts:
        head_of[number] = groups.of(number)
    return head_of[labels]


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
