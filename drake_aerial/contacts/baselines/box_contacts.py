"""Contacts at the demonstrated place in the object's bounding box (method `obb`)."""

from collections.abc import Iterator

import numpy as np

from drake_aerial.contacts.canonical_scan import CanonicalScan
from drake_aerial.features.upright_box import BoxMap, UprightBox
from drake_aerial.geometry import Array, Pose
from drake_aerial.skill.contact_skill import ContactSkill

COMPARED = 1500
"""Largest number of points of either object in a chamfer distance."""
# Standard deviation of a point's distance from the other object, in object sizes. It turns a
# chamfer distance into the logarithm of a likelihood.
_SIGMA = 0.05


def box_contacts(skill: ContactSkill, scan: CanonicalScan) -> tuple[Pose, Array]:
    """Carry the demonstrated grippers from bounding box to bounding box.

    The demonstrated sites keep their coordinates in the upright box of the least footprint. Each of
    the four quarter turns between the boxes is one configuration. Every gripper is moved to the
    nearest surface that faces its way.

    Returns
    -------
    X_NG : Pose
        Configurations on the surface of the new scan, batch (4, n), in the order of quarter turns.
    log_fit : (4,) array
        Logarithm of how well the carried demonstration covers the new scan, from its chamfer
        distance.
    """
    target = scan.box
    size = target.size
    points = every(scan.features.p, COMPARED)
    demonstrated = every(skill.points, COMPARED)
    carried, log_fit = [], []
    for turn in box_maps(skill, target):
        carried.append(turn.poses(skill.X_NG))
        distance = chamfer(turn.points(demonstrated), points)
        log_fit.append(-0.5 * (distance / (_SIGMA * size)) ** 2)
    X_NG = Pose(np.stack([X.p for X in carried]), np.stack([X.q for X in carried]))
    return scan.surface.nearest(X_NG), np.array(log_fit)


def box_maps(skill: ContactSkill, target: UprightBox) -> Iterator[BoxMap]:
    """Return the four maps from the demonstrated object's box to that of the new scan."""
    source = UprightBox.of_points(skill.points, skill.hull)
    return (BoxMap(source, target, turns) for turns in range(4))


def every(points: Array, count: int) -> Array:
    """Return at most `count` of the points (N, 3), evenly spaced in their order."""
    step = -(-len(points) // count)
    return points[::step]


def chamfer(a: Array, b: Array) -> float:
    """Return the mean distance of points a (N, 3) and b (M, 3) from the other set's nearest [m]."""
    from scipy.spatial import cKDTree

    there, back = cKDTree(b).query(a)[0], cKDTree(a).query(b)[0]
    return 0.5 * float(np.mean(there) + np.mean(back))
