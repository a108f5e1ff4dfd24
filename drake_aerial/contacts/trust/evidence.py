"""Statistics of each solution of a transfer, by which right and wrong contacts differ."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from drake_aerial.contacts.canonical_scan import CanonicalScan
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.trust.counterparts import Counterparts
from drake_aerial.contacts.trust.surroundings import Surroundings
from drake_aerial.contacts.trust.top_surface import TopSurface
from drake_aerial.contacts.votes.scan_cuts import ScanCuts
from drake_aerial.features.upright_box import UprightBox
from drake_aerial.geometry import Array, Pose
from drake_aerial.skill.contact_skill import ContactSkill

# Solutions nearer than this share of the size are no alternatives.
_APART = 0.1
# Largest difference of log J that is told apart.
_MAX_GAP = 8.0
# Neutral values of `better_elsewhere`, `gap` and `gap_distance` where a search returned no
# alternative: medians of right answers.
_NO_ALTERNATIVE = (-0.01, 2.0, 0.3)
# Quarter turns of a bounding box whose fits differ by less are equally good, in sizes.
_SAME_FIT = 0.004


@dataclass(frozen=True)
class Evidence:
    """Statistics of one solution; lengths are shares of the new object's size.

    Attributes
    ----------
    whole, near, unexplained : float
        Fit of the demonstrated object at the contact: see `Fit`.
    box_fit : float
        Fit of the demonstrated object that is carried from bounding box to bounding box.
    better_elsewhere : float
        `whole` here, less the smallest one of the alternatives.
    counterparts : float
        Share of the demonstrated task features that have a counterpart.
    box_distance : float
        Distance from the demonstrated place in the bounding box, of the best quarter turns.
    box_nearest : float
        The same, of the nearest quarter turn.
    height : float
        Depth of the demonstrated contact below the top of its object, less that of the contact.
    above : float
        Difference in the share of the top surface that is higher than the contact.
    proportions : float
        Difference of the two objects' proportions: logarithm of width over length.
    fill : float
        Difference of the shares of the bounding rectangle that the outlines fill.
    gap : float
        log J, less the largest log J of the alternatives.
    gap_distance : float
        Distance of the likeliest alternative.
    cut : float
        Share of the outline's directions in which the scan ends but not the object.
    size_ratio : float
        Absolute logarithm of the two objects' ratio of sizes.
    size : float
        Longest side of the new object's upright box [m].
    """

    whole: float
    near: float
    unexplained: float
    box_fit: float
    better_elsewhere: float
    counterparts: float
    box_distance: float
    box_nearest: float
    height: float
    above: float
    proportions: float
    fill: float
    gap: float
    gap_distance: float
    cut: float
    size_ratio: float
    size: float

    def to_dict(self) -> dict[str, float]:
        """Return the statistics by name."""
        return asdict(self)


def gather_evidence(
    skill: ContactSkill,
    scan: CanonicalScan,
    X_NG: Pose,
    log_j: Array,
    parameters: TransferParameters,
) -> list[Evidence]:
    """Return the evidence about each of K configurations.

    Parameters
    ----------
    skill : ContactSkill
        The learnt skill, for n grippers.
    scan : CanonicalScan
        The new scan.
    X_NG : Pose
        Configurations in the scan's frame N, batch (K, n).
    log_j : (K,) array
        Their log J.
    parameters : TransferParameters
        Parameters of the transfer.
    """
    source = TopSurface.of_points(skill.points, skill.hull)
    target = TopSurface.of_points(scan.features.p, scan.hull)
    size = target.box.size
    places, site = X_NG.p.mean(axis=1), skill.X_NG.p.mean(axis=0)
    laid = Surroundings(source, site, target)
    fits = [laid.fit(place) for place in places]
    asked = Counterparts(skill, scan, size, parameters)
    box_fits, box_places = _box_places(skill.X_NG.p, source, target, laid)
    cuts = _cuts(scan)
    log_j = np.asarray(log_j, float)
    evidence = []
    for k, (place, fit) in enumerate(zip(places, fits, strict=True)):
        apart = np.linalg.norm(places - place, axis=1) / size
        others = np.flatnonzero(apart > _APART)
        elsewhere, gap, distance = _NO_ALTERNATIVE
        if len(others):
            first = others[np.argmax(log_j[others])]
            elsewhere = fit.whole - min(fits[i].whole for i in others)
            gap = float(np.clip(log_j[k] - log_j[first], -_MAX_GAP, _MAX_GAP))
            distance = float(apart[first])
        off = _distances(box_places, X_NG.p[k]) / size
        evidence.append(
            Evidence(
                whole=fit.whole,
                near=fit.near,
                unexplained=fit.unexplained,
                box_fit=float(box_fits.min()),
                better_elsewhere=elsewhere,
                counterparts=asked.share(place, fit.yaw),
                box_distance=float(off[box_fits < box_fits.min() + _SAME_FIT].min()),
                box_nearest=float(off.min()),
                height=source.depth(site) - target.depth(place),
                above=target.share_above(place) - source.share_above(site),
                proportions=_slenderness(target.box) - _slenderness(source.box),
                fill=_fill(target.box, scan.hull.area) - _fill(source.box, skill.hull.area),
                gap=gap,
                gap_distance=distance,
                cut=float(cuts.flags.mean()),
                size_ratio=abs(float(np.log(size / source.box.size))),
                size=size,
            )
        )
    return evidence


def _box_places(
    grippers: Array, source: TopSurface, target: TopSurface, laid: Surroundings
) -> tuple[Array, Array]:
    """Return the fits (4,) of the quarter turns between the boxes, and the grippers (4, n, 3).

    Demonstrated grippers are (n, 3) [m]. Heights are measured from the top, which all scans show.
    """
    site = grippers.mean(axis=0)
    old, new = (np.append(s.box.centre[:2], s.top) for s in (source, target))
    turns = range(0, len(laid.maps), 3)
    fits = [laid.fit_of(k, new + laid.maps[k] @ (site - old)) for k in turns]
    places = [new + (grippers - old) @ laid.maps[k].T for k in turns]
    return np.array(fits), np.array(places)


def _cuts(scan: CanonicalScan) -> ScanCuts:
    if scan.boundary is not None:
        return ScanCuts.known(scan.features, scan.hull, scan.boundary)
    return ScanCuts.find(scan.features, scan.hull, scan.viewpoint)


def _distances(box_places: Array, p: Array) -> Array:
    """Return the root mean square distances (4,) of grippers p (n, 3), paired at best [m]."""
    from scipy.optimize import linear_sum_assignment

    squared = np.sum((box_places[:, :, None] - p) ** 2, axis=-1)
    if len(p) == 1:
        return np.sqrt(squared[:, 0, 0])
    return np.sqrt([np.mean(cost[linear_sum_assignment(cost)]) for cost in squared])


def _slenderness(box: UprightBox) -> float:
    return float(np.log(box.half[1] / box.half[0]))


def _fill(box: UprightBox, area: float) -> float:
    return float(area / (4.0 * box.half[0] * box.half[1]))
