"""Votes in hull coordinates for the demonstrated contact on a new object (docs/method.md)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.votes.scan_cuts import ScanCuts
from drake_aerial.density.grid_density import GridDensity
from drake_aerial.density.mixture import systematic_resample
from drake_aerial.errors import JobError
from drake_aerial.features.horizontal_direction import gravity_saliency, horizontal_direction
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array
from drake_aerial.skill.contact_skill import ContactSkill

# Curvature times rho of a concave edge.
_CONCAVE = -0.3


@dataclass(frozen=True, eq=False)
class GravityFeatures:
    """Salient features in their gravity frames: t horizontal and outward, e = t rotated by +90 deg.

    Attributes
    ----------
    p : (N, 2) array
        Horizontal positions [m].
    t : (N, 2) array
        Unit outward horizontal directions.
    strength : (N,) array
        Saliency: |r1|, or that of an edge for a rim (dimensionless).
    depth : (N,) array
        Relative depth xi = t . (p - m) / h(t) in the hull.
    support : (N,) array
        Support of the hull along t [m].
    length, width : (N,) arrays
        Widths of the hull along t and along e [m].
    side : (N,) array
        Relative position along e between the hull's two limits there, -1 to 1.
    """

    p: Array
    t: Array
    strength: Array
    depth: Array
    support: Array
    length: Array
    width: Array
    side: Array

    @classmethod
    def of(cls, features: SurfaceFeatures, hull: HorizontalHull) -> GravityFeatures:
        """Return the gravity frames of features in a frame whose z is up."""
        t, _ = horizontal_direction(features)
        p = features.p[:, :2]
        t = np.where(_at_a_wall(features, p, t, hull)[:, None], -t, t)
        support = np.maximum(hull.support(t), 1e-6)
        depth = np.sum(t * (p - hull.centroid), axis=1) / support
        length, width = np.maximum(hull.width(t), 1e-6), np.maximum(hull.width(turned(t)), 1e-6)
        e = turned(t)
        middle = 0.5 * (hull.support(e) - hull.support(-e))
        side = (np.sum(e * (p - hull.centroid), axis=1) - middle) / (0.5 * width)
        return cls(p, t, features.saliency, depth, support, length, width, side)


def _at_a_wall(features: SurfaceFeatures, p: Array, t: Array, hull: HorizontalHull) -> Array:
    """Return which features are the foot of a wall along the outline, (N,).

    They are concave, face the middle of an open tray, and the outline is within rho. The object
    ends behind them: their outward direction is away from the side that they face.
    """
    inward = np.sum(t * (p - hull.centroid), axis=1) < 0.0
    concave = ~features.rim & (features.r[:, 0] < _CONCAVE)
    return concave & inward & ~hull.contains(p, -features.rho)


def turned(t: Array) -> Array:
    """Return horizontal vectors t (..., 2) rotated by +90 degrees."""
    return np.stack([-t[..., 1], t[..., 0]], axis=-1)


class HullVotes:
    """Votes of the new cloud's salient features, and their density V.

    V is a density over x, y and, for several grippers, yaw.

    Parameters
    ----------
    skill : ContactSkill
        The learnt skill, for n grippers.
    features : SurfaceFeatures
        Features of the new cloud, in its canonical frame N (z up).
    hull : HorizontalHull
        The new cloud's hull in N.
    cuts : ScanCuts
        Directions in which the scan is cut off; used with `support`. The hull's supports there are
        lower bounds: the demonstrated proportions complete them, and rims there do not vote.
    scale : str
        Scale of demonstrated offsets: `support`, `area` or `rigid`.
    parameters : TransferParameters
        Bandwidths and the number of voters.
    rng : numpy.random.Generator
        Random generator; it draws the voters.

    Attributes
    ----------
    positions : (M, 2) array
        Votes for the formation origin (for one gripper: the gripper) in N [m].
    weights : (M,) array
        Their weights.
    yaw : (M,) array
        Their yaws in N [rad], 0 to 2 pi.
    with_yaw : bool
        Whether V is a density over yaw too.
    density : GridDensity
        V.
    cuts : ScanCuts
        The cuts of the scan, as given.

    Raises
    ------
    JobError
        If every vote has the weight zero.
    """

    def __init__(
        self,
        skill: ContactSkill,
        features: SurfaceFeatures,
        hull: HorizontalHull,
        cuts: ScanCuts,
        scale: str,
        parameters: TransferParameters,
        rng: np.random.Generator,
    ):
        self.cuts = cuts
        saliency = gravity_saliency(features)
        if scale == "support":
            saliency = np.where(cuts.voting(features), saliency, 0.0)
        drawn = systematic_resample(saliency, parameters.voters, rng)
        new = GravityFeatures.of(features.take(drawn), hull)
        old = GravityFeatures.of(skill.task.salient, skill.hull)
        X = skill.X_NG.p.mean(axis=0)[:2]
        along = np.sum(old.t * (X - old.p), axis=1)
        across = np.sum(turned(old.t) * (X - old.p), axis=1)
        ratio_t, ratio_e, depth = _ratios(scale, new, old, hull, skill.hull, cuts)
        # Every demonstrated feature j against every voter a: arrays (A, J).
        p = (
            new.p[:, None]
            + new.t[:, None] * (ratio_t * along)[..., None]
            + turned(new.t)[:, None] * (ratio_e * across)[..., None]
        )
        log_weight = (
            -0.5 * ((new.strength[:, None] - old.strength) / parameters.vote_descriptor) ** 2
        )
        log_weight = log_weight - 0.5 * ((depth - old.depth) / parameters.vote_depth) ** 2
        if len(skill) > 1 and not cuts:
            # A formation's votes must agree on its yaw too. At one yaw the edges of another outline
            # (a triangle's on a box) do not cross: the votes of one edge, smeared along it, would
            # decide alone. The edge's own ends bound them.
            log_weight = (
                log_weight - 0.5 * ((new.side[:, None] - old.side) / parameters.vote_depth) ** 2
            )
        # The same object in another size and aspect: stretched along t about as much as along e.
        stretch = np.log(ratio_t / ratio_e)
        log_weight = log_weight - 0.5 * (stretch / parameters.vote_aspect) ** 2
        self.positions = p.reshape(-1, 2)
        self.weights = np.exp(log_weight).ravel()
        self.yaw = (_angle(new.t)[:, None] - _angle(old.t)).ravel() % (2.0 * np.pi)

        # One gripper's yaw is not wanted, yet votes must agree on one: otherwise the images of a
        # site under the object's near-symmetries add up in the middle.
        self.with_yaw = len(skill) > 1
        self.density = GridDensity(
            np.column_stack([self.positions, self.yaw]),
            self.weights,
            [parameters.vote_sigma, parameters.vote_sigma, parameters.vote_sigma_rotation],
            [*hull.vertices.min(axis=0), 0.0],
            [*hull.vertices.max(axis=0), 2.0 * np.pi],
            [False, False, True],
            best_of_last=not self.with_yaw,
        )
        if not self.density.total > 1e-12 * len(self.weights):
            raise JobError(
                "the votes are zero: no salient feature of the new cloud resembles one of the "
                "demonstration in curvature and depth; use method `control`, which has no votes, "
                "or a skill demonstrated on a more similar object"
            )

    def log_density(self, origin: Array, yaw: Array) -> Array:
        """Return log V (...) at formation origins (..., 3) [m], z ignored, and yaws (...) [rad]."""
        x = origin[..., :2]
        if self.with_yaw:
            x = np.concatenate([x, yaw[..., None]], axis=-1)
        return self.density.log_density(x)


def _angle(t: Array) -> Array:
    return np.arctan2(t[:, 1], t[:, 0])


def _ratios(
    scale: str,
    new: GravityFeatures,
    old: GravityFeatures,
    hull: HorizontalHull,
    hull_old: HorizontalHull,
    cuts: ScanCuts,
) -> tuple[Array, Array, Array]:
    """Return factors of offsets along t and e, and the voters' relative depths, each (A, J)."""
    depth = np.broadcast_to(new.depth[:, None], (len(new.p), len(old.p)))
    if scale != "support":
        factor = np.sqrt(hull.area / hull_old.area) if scale == "area" else 1.0
        return np.full(depth.shape, factor), np.full(depth.shape, factor), depth
    along, across = new.support[:, None] / old.support, new.width[:, None] / old.width
    if not cuts:
        return along, across, depth
    behind = cuts.towards(-new.t)[:, None]
    beside = (cuts.towards(turned(new.t)) | cuts.towards(-turned(new.t)))[:, None]
    completed_along = np.where(behind & ~beside, np.maximum(along, across), along)
    completed_across = np.where(
        beside & ~behind, np.maximum(across, new.length[:, None] / old.length), across
    )
    # Depth is measured from the near side, which the scan shows.
    gap = (1.0 - depth) * new.support[:, None]
    return completed_along, completed_across, 1.0 - gap / (completed_along * old.support)
