"""What a transfer was based on, for pictures: features, votes and densities of the new cloud."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_aerial.contacts.likelihood.contact_likelihood import ContactLikelihood
from drake_aerial.contacts.votes.hull_votes import HullVotes
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array, Pose, quat_about_axis, rotate, transform


@dataclass(frozen=True, eq=False)
class Evidence:
    """The inner values of one transfer.

    Attributes
    ----------
    X_SN : Pose
        The cloud's canonical frame N in its own frame S.
    features : SurfaceFeatures
        Features of the cloud, in N.
    hull : HorizontalHull
        The cloud's hull, seen from above, in N.
    likelihood : ContactLikelihood or None
        log J with its query densities and votes, in N; None for `centroid`.
    votes : HullVotes or None
        The votes in hull coordinates; None for methods without.
    scale : str
        Scale mode that the votes used.
    chains : Pose or None
        Where annealing ended, likeliest first, in N, batch (chains, n): what further seeds of a refinement are drawn
        from. None for `centroid`.
    """

    X_SN: Pose
    features: SurfaceFeatures
    hull: HorizontalHull
    likelihood: ContactLikelihood | None
    votes: HullVotes | None
    scale: str
    chains: Pose | None = None

    @property
    def features_S(self) -> SurfaceFeatures:
        """The features in the cloud's frame S."""
        return self.features.transformed(self.X_SN)

    def log_query(self, gripper: int = 0) -> Array:
        """Return log Q_n at every feature (N,), a gripper standing on it along its normal; zeros for `centroid`."""
        if self.likelihood is None:
            return np.zeros(len(self.features))
        return self.likelihood.queries[gripper].log_density(self.features.pose)

    def log_votes(self, gripper: int | None = None) -> Array:
        """Return log V at every feature (N,), the yaw that suits it best; zeros where there are no votes.

        V is a density of the formation's origin. For several grippers it is read there, unless a `gripper` is given: then where the
        origin is when that gripper stands on the feature, the formation being as large as it is expected to be.
        """
        if self.votes is None or self.likelihood is None:
            return np.zeros(len(self.features))
        p = self.features.p
        if not self.votes.with_yaw:
            return self.votes.log_density(p, np.zeros(len(p)))
        offset = np.zeros(3)
        if gripper is not None:
            offset = (
                np.exp(self.likelihood.prior.log_mean)
                * self.likelihood.configuration.X_FG.p[gripper]
            )
        yaws = np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False)
        origins = [p - rotate(quat_about_axis([0.0, 0.0, 1.0], yaw), offset) for yaw in yaws]
        logs = [
            self.votes.log_density(origin, np.full(len(p), yaw))
            for origin, yaw in zip(origins, yaws)
        ]
        return np.max(logs, axis=0)

    def log_surface(self, gripper: int = 0) -> Array:
        """Return at every feature (N,) how well the gripper belongs there, standing along the normal: the heat map.

        For one gripper it is log J itself, gravity included; for one of several log(Q_n V^gamma) at the best yaw.
        """
        if self.likelihood is None:
            return np.zeros(len(self.features))
        if len(self.likelihood.queries) == 1:
            X = self.features.pose
            return self.likelihood(Pose(X.p[:, None], X.q[:, None]))
        return self.log_query(gripper) + self.likelihood.gamma * self.log_votes(gripper)

    def votes_S(self) -> tuple[Array, Array]:
        """Return the votes' positions (M, 3) in S [m], at the cloud's top, and their weights (M,)."""
        if self.votes is None:
            return np.empty((0, 3)), np.empty(0)
        top = np.full(len(self.votes.positions), self.features.p[:, 2].max())
        p_N = np.column_stack([self.votes.positions, top])
        return transform(self.X_SN, p_N), self.votes.weights
