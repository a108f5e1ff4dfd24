"""Contacts above the middle of the scan, without learning (method `centroid`)."""

import numpy as np

from drake_aerial.contacts.canonical_scan import CanonicalScan
from drake_aerial.geometry import Array, Pose
from drake_aerial.skill.contact_skill import ContactSkill


def centroid_contacts(skill: ContactSkill, scan: CanonicalScan) -> tuple[Pose, Array]:
    """Return grippers X_NG, batch (1, n), with the formation's origin over the hull's centroid.

    One gripper is set on the topmost surface there. Several keep the demonstrated layout at its
    demonstrated size, with the yaw of the canonical frame. Each is set on the topmost surface at
    its place.
    """
    origin = np.append(scan.hull.centroid, 0.0)
    layout = skill.configuration.demonstrated_at(origin, np.zeros(()))
    X_NG, _ = scan.surface.above(layout.p[..., :2])
    return Pose(X_NG.p[None], X_NG.q[None]), np.zeros(1)
