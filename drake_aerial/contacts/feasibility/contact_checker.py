"""Likelihood and feasibility of given gripper poses on the cloud of a transfer."""

from dataclasses import replace

import numpy as np

from drake_aerial.contacts.contact_query import ContactQuery
from drake_aerial.contacts.feasibility.checks import reasons_against
from drake_aerial.contacts.feasibility.reasons import Reason, ReasonKind
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.solutions import Solution
from drake_aerial.errors import InputError
from drake_aerial.geometry import Pose, axis_of, rotate

# A magnet whose axis leans further from the surface's normal does not hold [rad].
_LARGEST_TILT = float(np.deg2rad(15.0))


class ContactChecker:
    """Likelihood and feasibility of given gripper poses in the canonical frame N.

    Parameters
    ----------
    query : ContactQuery or None
        Scan and densities of a transfer: `ContactSolutions.query`.
    parameters : TransferParameters
        Limits of feasibility.

    Raises
    ------
    InputError
        If `query` is None.
    """

    def __init__(self, query: ContactQuery | None, parameters: TransferParameters):
        if query is None:
            raise InputError(
                "`query` must hold the densities of a transfer, got None; contacts.json and the "
                "methods registration, obb and centroid have none: use solutions that `transfer` "
                "returned with another method"
            )
        self.query, self.parameters = query, parameters
        self.likelihood, self.surface = query.likelihood, query.scan.surface
        self.X_SN, self.features = query.scan.X_SN, query.scan.features
        self.centre = query.scan.hull.centroid

    def reasons(self, X_NG: Pose) -> tuple[Reason, ...]:
        """Return the reasons why grippers X_NG (n,) are infeasible; empty if they are feasible."""
        X_NQ = self.likelihood.configuration.quadrotors_over(X_NG)
        return self._reasons(X_NG, X_NQ, self.parameters)

    def reasons_of_one(self, X_NG: Pose, gripper: int) -> tuple[Reason, ...]:
        """Return the reasons why one of the grippers X_NG (n,) is infeasible by itself."""
        X_NQ = self.likelihood.configuration.quadrotors_over(X_NG)
        # The weight that it lifts depends on the others.
        limits = replace(self.parameters, lift=None)
        return self._reasons(X_NG.take([gripper]), X_NQ.take([gripper]), limits)

    def solution(self, X_NG: Pose, rank: int = 1) -> Solution:
        """Return the solution with grippers X_NG (n,), in the cloud's frame S."""
        X_SN, reasons = self.X_SN, self.reasons(X_NG)
        _, normal, _ = self.surface.set_down(X_NG)
        return Solution(
            rank=rank,
            log_likelihood=float(self.likelihood(Pose(X_NG.p[None], X_NG.q[None]))[0]),
            feasible=not reasons,
            reasons=reasons,
            X_SG=X_SN @ X_NG,
            normal=rotate(X_SN.q, normal),
            X_SQ=X_SN @ self.likelihood.configuration.quadrotors_over(X_NG),
        )

    def _reasons(self, X_NG: Pose, X_NQ: Pose, limits: TransferParameters) -> tuple[Reason, ...]:
        square = np.sum((self.surface.points - X_NG.p[:, None]) ** 2, axis=-1)
        gaps = np.sqrt(square.min(axis=1))
        reasons = reasons_against(X_NG, X_NQ, gaps, self.centre, self.surface, limits)
        _, normal, _ = self.surface.set_down(X_NG)
        tilt = np.arccos(np.clip(np.sum(normal * axis_of(X_NG.q, 2), axis=1), -1.0, 1.0))
        return reasons + tuple(
            Reason(ReasonKind.TILTED, int(i) if len(tilt) > 1 else None, value=float(tilt[i]))
            for i in np.flatnonzero(tilt > _LARGEST_TILT)
        )
