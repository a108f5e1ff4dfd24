"""The contact likelihood J(h) = H(h) prod_n Q_n(L_n) V^gamma (docs/method.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_aerial.contacts.likelihood.query_density import Query
from drake_aerial.contacts.votes.hull_votes import HullVotes
from drake_aerial.contacts.votes.scan_cuts import ScanCuts
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.geometry import Array, Pose, quat_about_axis, rotate
from drake_aerial.skill.configuration_model import ConfigurationModel

# Weight gamma of the votes in J, for one gripper and for several. The votes' density is blurred by
# the spread of the features, so that its log is shallow: with gamma = 1 the noise of the local
# surface decides. Several grippers bring several such noises.
GAMMA, GAMMA_FORMATION = 3.0, 6.0
# Smallest scale of a formation.
SMALLEST_SCALE = 0.05
# Standard deviation of the log of a scale that was read off one direction alone.
_SIGMA_OF_ONE_WIDTH = 0.05
# Standard deviation of the log of a scale where hulls agree in all directions.
_MIN_SIGMA = 0.02
# Largest error of the votes' yaw that is allowed for [rad].
_YAW_TOLERANCE = np.deg2rad(20.0)
# Number of yaws at which hulls are compared, for methods without votes.
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
        cuts: ScanCuts | None = None,
    ) -> ScalePrior:
        """Return the prior with mean and spread of log(h_new / h_old) over all directions.

        Parameters
        ----------
        new, old : HorizontalHull
            Hulls of the new and of the demonstrated object.
        yaw : float
            Yaw by which the demonstrated object is turned onto the new one [rad].
        p_FG : (n, 3) array, optional
            Demonstrated grippers in the formation frame [m]. Directions are weighted by the
            grippers' second moment along them: the width of a bar says nothing about grippers in
            line. A regular formation weights all directions alike, as does None.
        cuts : ScanCuts, optional
            Cuts of the new scan. If there are any, only the widths across them are compared, which
            they do not shorten.
        """
        angle = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
        t_old = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        t_new = np.stack([np.cos(angle + yaw), np.sin(angle + yaw)], axis=-1)
        if cuts:
            return cls(_log_ratio_across(cuts, new, old, yaw), _SIGMA_OF_ONE_WIDTH)
        log_ratio = np.log(new.support(t_new) / old.support(t_old))
        weight = (
            np.ones(len(angle)) if p_FG is None else np.sum((p_FG[:, :2] @ t_old.T) ** 2, axis=0)
        )
        if not weight.sum() > 1e-12:
            weight = np.ones(len(angle))
        mean = float(np.average(log_ratio, weights=weight))
        spread = float(np.sqrt(np.average((log_ratio - mean) ** 2, weights=weight)))
        return cls(mean, max(spread, _MIN_SIGMA))

    @classmethod
    def of_best_yaw(
        cls,
        new: HorizontalHull,
        old: HorizontalHull,
        p_FG: Array | None = None,
        cuts: ScanCuts | None = None,
    ) -> ScalePrior:
        """Return `of_hulls` at the yaw of the smallest spread, where the hulls are most alike."""
        yaws = np.linspace(0.0, 2.0 * np.pi, _YAWS, endpoint=False)
        best = min(yaws, key=lambda yaw: cls.of_hulls(new, old, float(yaw), p_FG).sigma)
        return cls.of_hulls(new, old, float(best), p_FG, cuts)


def _log_ratio_across(
    cuts: ScanCuts, new: HorizontalHull, old: HorizontalHull, yaw: float
) -> float:
    """Return the log of the ratio of the two objects' widths across the cuts.

    The scan is complete in that direction. The smallest widths within the tolerance of the yaw are
    compared, since a box that is turned by a few degrees looks wider.
    """
    x, y = cuts.axis()
    angle = np.arctan2(x, -y) + np.linspace(-_YAW_TOLERANCE, _YAW_TOLERANCE, 21)
    width_new = new.width(np.column_stack([np.cos(angle), np.sin(angle)])).min()
    width_old = old.width(np.column_stack([np.cos(angle - yaw), np.sin(angle - yaw)])).min()
    return float(np.log(width_new / width_old))


class ContactLikelihood:
    """log J of gripper poses in the new cloud's canonical frame N.

    Parameters
    ----------
    configuration : ConfigurationModel
        The configuration model H.
    queries : tuple of n query densities
        Q_n or C_n of each gripper.
    votes : HullVotes or None
        V; None for methods that have no votes or have them inside Q_n.
    prior : ScalePrior
        Prior of the formation's scale.
    """

    def __init__(
        self,
        configuration: ConfigurationModel,
        queries: tuple[Query, ...],
        votes: HullVotes | None,
        prior: ScalePrior,
    ):
        self.configuration, self.queries = configuration, queries
        self.votes, self.prior = votes, prior
        self.gamma = GAMMA if len(queries) == 1 else GAMMA_FORMATION
        self._weight = np.array([1.0, 1.0, configuration.vertical**2])
        self._spread = float(np.sum(self._weight * configuration.X_FG.p**2))

    def __call__(
        self, X_NG: Pose, coarse: bool = False, log_queries: Sequence[Array] | None = None
    ) -> Array:
        """Return log J (...) of gripper poses X_NG (..., n).

        Parameters
        ----------
        X_NG : Pose
            Gripper poses: p (..., n, 3) [m], q (..., n, 4).
        coarse : bool
            Whether query densities are evaluated in single precision.
        log_queries : sequence of n (...) arrays, optional
            The logarithms of the query densities, if they are known already.
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
        """Return the most likely scale (...) of formations X_NG (..., n) at given frames.

        It is the closed-form Procrustes solution with a Gaussian prior. The frames have origins
        (..., 3) [m] and yaws (...) [rad].
        """
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
        """Derivative of `scale` (lower bound ignored) with respect to the overlap [1/m^2].

        The overlap is sum_n R_z(yaw) p_FGn . (p_NGn - origin), its heights by their weight.
        """
        mean, trust = np.exp(self.prior.log_mean), 1.0 / self.configuration.sigma_p**2
        if self._spread < 1e-12:
            return 0.0
        return float(trust / (self._spread * trust + 1.0 / (self.prior.sigma * mean) ** 2))
