"""Contacts of the methods without densities, by name."""

from drake_aerial.contacts.baselines.box_contacts import box_contacts
from drake_aerial.contacts.baselines.centroid import centroid_contacts
from drake_aerial.contacts.baselines.registration_contacts import registration_contacts
from drake_aerial.contacts.canonical_scan import CanonicalScan
from drake_aerial.geometry import Array, Pose
from drake_aerial.skill.contact_skill import ContactSkill

_BY_METHOD = {
    "centroid": centroid_contacts,
    "obb": box_contacts,
    "registration": registration_contacts,
}


def baseline_contacts(method: str, skill: ContactSkill, scan: CanonicalScan) -> tuple[Pose, Array]:
    """Return the configurations X_NG, batch (K, n), of a baseline, and their log-fits (K,).

    Raises
    ------
    InputError
        If the method needs a library that is not installed.
    """
    return _BY_METHOD[method](skill, scan)
