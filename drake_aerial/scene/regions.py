"""Connected regions of an image, and the pairs of pixels that face each other across their rims."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_aerial.geometry import Array

Mask = NDArray[np.bool_]
Labels = NDArray[np.int64]


def connected_regions(mask: Mask, least: int) -> Labels:
    """Return the 4-connected regions of a mask (H, W), numbered from 1, by falling size.

    Regions of fewer than `least` pixels are 0, as is what is not in the mask.
    """
    import cv2

    _, labels, statistics, _ = cv2.connectedComponentsWithStats(
        mask.astype(np.uint8), connectivity=4
    )
    size = statistics[:, cv2.CC_STAT_AREA].copy()
    size[0] = 0
    order = np.argsort(-size, kind="stable")
    order = order[size[order] >= least]
    number = np.zeros(len(size), dtype=np.int64)
    number[order] = 1 + np.arange(len(order))
    return number[labels]


@dataclass(frozen=True, eq=False)
class Nearest:
    """The nearest labelled pixel of each pixel.

    Attributes
    ----------
    pixel : (H, W) int array
        Its flat index.
    distance : (H, W) array
        Its distance [pixels].
    """

    pixel: Labels
    distance: Array


def nearest_labelled(labels: Labels) -> Nearest:
    """Return the nearest pixel whose label (H, W) is not 0, for each pixel."""
    import cv2

    if not labels.any():
        return Nearest(np.zeros(labels.shape, np.int64), np.full(labels.shape, np.inf))
    distance, cell = cv2.distanceTransformWithLabels(
        (labels == 0).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    of_cell = np.zeros(int(cell.max()) + 1, dtype=np.int64)
    labelled = np.flatnonzero(labels)
    of_cell[cell.ravel()[labelled]] = labelled
    return Nearest(of_cell[cell], distance)


@dataclass(frozen=True, eq=False)
class Rims:
    """Pairs of pixels of different regions that face each other across a rim.

    Attributes
    ----------
    first, second : (K,) int array
        Flat indices of the pixels.
    gap : (K,) array
        Unlabelled pixels between them.
    """

    first: Labels
    second: Labels
    gap: Array


def find_rims(labels: Labels, nearest: Nearest, widest: float) -> Rims:
    """Return the pairs across all rims where at most `widest` unlabelled pixels lie between."""
    grown = np.where(nearest.distance <= 0.5 * widest, labels.ravel()[nearest.pixel], 0)
    height, width = labels.shape
    first, second, gap = [], [], []
    for rows, columns in ((0, 1), (1, 0)):
        here = (slice(0, height - rows), slice(0, width - columns))
        there = (slice(rows, None), slice(columns, None))
        rim = (grown[here] != grown[there]) & (grown[here] > 0) & (grown[there] > 0)
        first.append(nearest.pixel[here][rim])
        second.append(nearest.pixel[there][rim])
        gap.append((nearest.distance[here] + nearest.distance[there])[rim])
    return Rims(np.concatenate(first), np.concatenate(second), np.concatenate(gap))
