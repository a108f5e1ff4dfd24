"""The contact likelihood J(h) = H(h) prod_n Q_n(L_n) V^gamma that annealing maximises (docs/method.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_aerial.contacts.likelihood.query_density import Query
from drake_aerial.contacts.votes.hull_votes import HullVotes
from drake_aerial.contacts.votes.scan_cuts import Cuts
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.geometry import Array, Pose, quat_about_axis, rotate
from drake_aerial.skill.configuration_model import ConfigurationModel

# Weight gamma of the votes in J. Their density is blurred by the features' own spread, so that its log is shallow:
# one vote's weight leaves the contact to the noise of the local surface. Several grippers bring several such noises.
GAMMA, GAMMA_FORMATION = 3.0, 6.0
# Smallest scale of a formation that is considered.
SMALLEST_SCALE = 0.05
# Spread of the log of a scale that was read off one direction alone.
_PROPORTIONS = 0.05
# How far the yaw of the votes may be off [rad].
_YAW_DOUBT = np.deg2rad(20.0)
# Yaws at which hulls are compared, where no votes say which.
_YAWS = 72
_Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class ScalePrior:
    """Gaussian prior of the log of a formation's scale on the new object.

    Attributes
    ----------
    log_mean, sigma : float
        Mean and standard deviation of log s.
    """

    log_mean: float
    sigma: float

    @classmethod
    def of_hulls(
        cls,
        new: HorizontalHull,
        old: HorizontalHull,
        yaw: float,
        p_FG: Array | None = None,
        cuts: Cuts | None = None,
    ) -> ScalePrior:
        """Return the mean and spread over direction of log(h_new / h_old), the old hull turned by `yaw` [rad].

        A direction counts by the moment of the demonstrated grippers p_FG (n, 3) [m] along it, if they are given: how
        much wider a bar is says nothing about grippers in line. A regular formation weighs all directions alike.
        Where the new scan has `cuts`, the widths across them are compared, which they do not shorten.
        """
        angle = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
        t_old = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        t_new = np.stack([np.cos(angle + yaw), np.sin(angle + yaw)], axis=-1)
        if cuts:
            return cls(_log_ratio_across(cuts, new, old, yaw), _PROPORTIONS)
        log_ratio = np.log(new.support(t_new) / old.support(t_old))
        weight = (
            np.ones(len(angle)) if p_FG is None else np.sum((p_FG[:, :2] @ t_old.T) ** 2, axis=0)
        )
        if not weight.sum() > 1e-12:
            weight = np.ones(len(angle))
        mean = float(np.average(log_ratio, weights=weight))
        spread = float(np.sqrt(np.average((log_ratio - mean) ** 2, weights=weight)))
        return cls(mean, max(spread, 0.02))

    @classmethod
    def of_best_yaw(
        cls,
        new: HorizontalHull,
        old: HorizontalHull,
        p_FG: Array | None = None,
        cuts: Cuts | None = None,
    ) -> ScalePrior:
        """Return `of_hulls` at the yaw where the two hulls are most alike: the one of the smallest spread."""
        yaws = np.linspace(0.0, 2.0 * np.pi, _YAWS, endpoint=False)
        best = min(yaws, key=lambda yaw: cls.of_hulls(new, old, float(yaw), p_FG).sigma)
        return cls.of_hulls(new, old, float(best), p_FG, cuts)


def _log_ratio_across(cuts: Cuts, new: HorizontalHull, old: HorizontalHull, yaw: float) -> float:
    """Return the log of the ratio of widths across the cuts, where the object is whole; along them the demonstrated
    proportions complete it. The narrowest nearby count: the yaw is known within some degrees, and a box that is turned
    by those is wider.
    """
    x, y = cuts.along()
    angle = np.arctan2(x, -y) + np.linspace(-_YAW_DOUBT, _YAW_DOUBT, 21)
    found = new.width(np.column_stack([np.cos(angle), np.sin(angle)])).min()
    taught = old.width(np.column_stack([np.cos(angle - yaw), np.sin(angle - yaw)])).min()
    return float(np.log(found / taught))


class ContactLikelihood:
    """log J of gripper poses in the new cloud's canonical frame N.

    Parameters
    ----------
    configuration : ConfigurationModel
        H.
    queries : sequence of n query densities
        Q_n, or C_n.
    votes : HullVotes or None
        V; None where the method has none or has them inside Q_n.
    prior : ScalePrior
        Prior of a formation's scale.
    """

    def __init__(
        self,
        configuration: ConfigurationModel,
        queries: tuple[Query, ...],
        votes: HullVotes | None,
        prior: ScalePrior,
    ):
        self.configuration, self.queries, self.votes, self.prior = (
            configuration,
            queries,
            votes,
            prior,
        )
        self.gamma = GAMMA if len(queries) == 1 else GAMMA_FORMATION
        self._weight = np.array([1.0, 1.0, configuration.vertical**2])
        self._spread = float(np.sum(self._weight * configuration.X_FG.p**2))

    def __call__(
        self, X_NG: Pose, coarse: bool = False, log_queries: Sequence[Array] | None = None
    ) -> Array:
        """Return log J (...) of gripper poses X_NG (..., n); quadrotors hang their cables as demonstrated.

        `coarse` evaluates the query densities in single precision; `log_queries` are their logarithms (...), where they
        are known already.
        """
        origin, yaw = self.configuration.formation_frames(X_NG)
        scale = self.scale(X_NG, origin, yaw)
        log_j = self.configuration.log_density(X_NG, scale=scale, frames=(origin, yaw))
        if len(self.queries) > 1:
            log_j = log_j - 0.5 * ((np.log(scale) - self.prior.log_mean) / self.prior.sigma) ** 2
        for n, query in enumerate(self.queries):
            if log_queries is None:
                log_j = log_j + query.log_density(
                    Pose(X_NG.p[..., n, :], X_NG.q[..., n, :]), coarse
                )
            else:
                log_j = log_j + log_queries[n]
        if self.votes is not None:
            log_j = log_j + self.gamma * self.votes.log_density(origin, yaw)
        return log_j

    def scale(self, X_NG: Pose, origin: Array, yaw: Array) -> Array:
        """Return the formation's scale (...): closed-form Procrustes, drawn to the prior's mean by its width."""
        mean = np.exp(self.prior.log_mean)
        if self._spread < 1e-12:
            return np.full(np.shape(yaw), mean)
        turned = rotate(quat_about_axis(_Z, yaw)[..., None, :], self.configuration.X_FG.p)
        overlap = np.sum(self._weight * turned * (X_NG.p - origin[..., None, :]), axis=(-1, -2))
        trust = 1.0 / self.configuration.sigma_p**2
        prior = 1.0 / (self.prior.sigma * mean) ** 2
        return np.maximum(
            (overlap * trust + prior * mean) / (self._spread * trust + prior), SMALLEST_SCALE
        )

    @property
    def scale_slope(self) -> float:
        """Derivative [1/m^2] of an unbounded `scale` by the overlap sum_n R_z(yaw) p_FGn . (p_NGn - origin),
        heights by their weight.
        """
        mean, trust = np.exp(self.prior.log_mean), 1.0 / self.configuration.sigma_p**2
        if self._spread < 1e-12:
            return 0.0
        return float(trust / (self._spread * trust + 1.0 / (self.prior.sigma * mean) ** 2))
