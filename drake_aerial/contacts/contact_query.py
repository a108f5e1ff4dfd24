"""The densities that a transfer searches for contacts, with their values at the scan's features."""

from dataclasses import dataclass

import numpy as np

from drake_aerial.contacts.canonical_scan import CanonicalScan
from drake_aerial.contacts.likelihood.contact_likelihood import ContactLikelihood
from drake_aerial.geometry import Array, Pose, invert, quat_about_axis, rotate, transform


@dataclass(frozen=True, eq=False)
class ContactQuery:
    """The scan of one transfer, and the likelihood of contacts on it.

    Attributes
    ----------
    scan : CanonicalScan
        The new payload's scan in its canonical frame N.
    likelihood : ContactLikelihood
        log J with its query densities and votes, in N.
    chains : Pose or None
        Ends of the annealing chains in N, likeliest first, batch (chains, n). A refinement takes
        further seeds from them. None before the search.
    """

    scan: CanonicalScan
    likelihood: ContactLikelihood
    chains: Pose | None = None

    def log_likelihood(self, X_SG: Pose) -> Array:
        """Return log J (K,) of K configurations of grippers X_SG, batch (K, n)."""
        return self.likelihood(invert(self.scan.X_SN) @ X_SG)

    def log_query(self, gripper: int = 0) -> Array:
        """Return log Q_n (N,) of a gripper at each feature, aligned with the feature's normal."""
        return self.likelihood.queries[gripper].log_density(self.scan.features.pose)

    def log_votes(self, gripper: int | None = None) -> Array:
        """Return log V (N,) at each feature for the best yaw; zeros for methods without votes.

        V is a density of the formation's origin. Without `gripper` it is evaluated at the feature.
        With one it is evaluated at the origin of the formation whose `gripper` stands on the
        feature, at the scale that the prior expects.
        """
        p, votes = self.scan.features.p, self.likelihood.votes
        if votes is None:
            return np.zeros(len(p))
        if not votes.with_yaw:
            return votes.log_density(p, np.zeros(len(p)))
        offset = np.zeros(3)
        if gripper is not None:
            scale = np.exp(self.likelihood.prior.log_mean)
            offset = scale * self.likelihood.configuration.X_FG.p[gripper]
        yaws = np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False)
        origins = [p - rotate(quat_about_axis([0.0, 0.0, 1.0], yaw), offset) for yaw in yaws]
        logs = [
            votes.log_density(origin, np.full(len(p), yaw)) for origin, yaw in zip(origins, yaws)
        ]
        return np.max(logs, axis=0)

    def log_surface(self, gripper: int = 0) -> Array:
        """Return the heat map (N,): the log-likelihood of a gripper on each feature.

        For one gripper it is log J, gravity included. For one of several it is log(Q_n V^gamma)
        at the best yaw.
        """
        if len(self.likelihood.queries) == 1:
            X = self.scan.features.pose
            return self.likelihood(Pose(X.p[:, None], X.q[:, None]))
        return self.log_query(gripper) + self.likelihood.gamma * self.log_votes(gripper)

    def votes_S(self) -> tuple[Array, Array]:
        """Return votes: positions (M, 3) in S [m], at the scan's top height; weights (M,)."""
        votes = self.likelihood.votes
        if votes is None:
            return np.empty((0, 3)), np.empty(0)
        top = np.full(len(votes.positions), self.scan.features.p[:, 2].max())
        return transform(self.scan.X_SN, np.column_stack([votes.positions, top])), votes.weights
