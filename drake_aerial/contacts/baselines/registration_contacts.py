"""Contacts carried by a non-rigid registration of the scans (method `registration`)."""

from typing import Any

import numpy as np

from drake_aerial.contacts.baselines.box_contacts import box_maps, chamfer, every
from drake_aerial.contacts.canonical_scan import CanonicalScan
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, Pose
from drake_aerial.skill.contact_skill import ContactSkill

# Largest number of points of either object in a registration.
_POINTS = 400
# Coherent point drift, in lengths relative to the new object's size: width of the deformation's
# kernel, weight of its smoothness, share of outliers, first width of the Gaussians. Chosen on
# development shapes (docs/method.md).
_BETA, _ALPHA, _OUTLIERS, _FIRST_WIDTH = 1.0, 5.0, 0.05, 0.1
_ITERATIONS, _TOLERANCE, _RANK = 80, 1e-6, 100
# Standard deviation of a point's distance and of its displacement, in object sizes.
_SIGMA, _SIGMA_DISPLACED = 0.05, 0.3


def registration_contacts(skill: ContactSkill, scan: CanonicalScan) -> tuple[Pose, Array]:
    """Carry the demonstrated grippers by coherent point drift (Myronenko and Song, 2010).

    The demonstrated object starts in the new object's upright box, once for each quarter turn, and
    is then deformed. Each result is one configuration, moved to the nearest surface that faces its
    way.

    Returns
    -------
    X_NG : Pose
        Configurations on the surface of the new scan, batch (4, n), in the order of quarter turns.
    log_fit : (4,) array
        Logarithm of how well the deformed demonstration covers the new scan: from the chamfer
        distance that is left, and from the deformation.

    Raises
    ------
    InputError
        If the library biocpd is not installed.
    """
    deformable = _library()
    target = scan.box
    points = every(scan.features.p, _POINTS) / target.size
    demonstrated = every(skill.points, _POINTS)
    carried, log_fit = [], []
    for turn in box_maps(skill, target):
        start, X = turn.points(demonstrated) / target.size, turn.poses(skill.X_NG)
        drift = deformable(
            X=points,
            Y=start,
            alpha=_ALPHA,
            beta=_BETA,
            w=_OUTLIERS,
            sigma2=_FIRST_WIDTH**2,
            num_eig=_RANK,
            # The other method draws random numbers of its own.
            low_rank_method="pivoted_cholesky",
            use_kdtree=False,
            max_iterations=_ITERATIONS,
            tolerance=_TOLERANCE,
            dtype=np.float64,
        )
        moved, _ = drift.register()
        site = drift.transform_point_cloud(X.p / target.size)
        carried.append(Pose(site * target.size, X.q))
        displaced = np.mean(np.sum((moved - start) ** 2, axis=1))
        log_fit.append(
            -0.5 * (chamfer(moved, points) / _SIGMA) ** 2 - 0.5 * displaced / _SIGMA_DISPLACED**2
        )
    X_NG = Pose(np.stack([X.p for X in carried]), np.stack([X.q for X in carried]))
    return scan.surface.nearest(X_NG), np.array(log_fit)


def _library() -> Any:
    try:
        from biocpd import DeformableRegistration
    except ImportError:
        raise InputError(
            "`method` registration needs the library biocpd, which is not installed; "
            "pip install biocpd, or choose another method"
        ) from None
    return DeformableRegistration
