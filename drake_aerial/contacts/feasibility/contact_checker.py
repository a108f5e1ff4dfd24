"""What speaks for and against a configuration of grippers on a cloud, wherever its poses come from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drake_aerial.contacts.contact_query import ContactQuery
from drake_aerial.contacts.feasibility.reasons import reasons_against
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.solutions import Solution
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, Pose, axis_of, rotate

# A magnet whose axis leans further from the surface's normal does not hold [rad].
_FLUSH = float(np.deg2rad(15.0))


class Examination:
    """Likelihood and feasibility of grippers where they are, in the canonical frame N.

    Parameters
    ----------
    query : ContactQuery or None
        Scan and densities of a transfer: `ContactSolutions.query`.
    parameters : TransferParameters
        Limits.

    Raises
    ------
    InputError
        If `query` is None.
    """

    def __init__(self, query: ContactQuery | None, parameters: TransferParameters):
        if query is None:
            raise InputError(
                "`query` must hold the densities of a transfer, got None; contacts.json does not "
                "hold them and method `centroid` has none, so refine what `transfer` returns"
            )
        self.query, self.parameters = query, parameters
        self.likelihood, self.surface = query.likelihood, query.scan.surface
        self.centre = query.scan.hull.centroid

    def gaps(self, X_NG: Pose) -> Array:
        """Return the distances (n,) of grippers from the nearest points of the cloud [m]."""
        square = np.sum((self.surface.points - X_NG.p[:, None]) ** 2, axis=-1)
        return np.sqrt(square.min(axis=1))

    def reasons(self, X_NG: Pose) -> tuple[str, ...]:
        """Return what makes grippers X_NG (n,) infeasible where they are; empty if nothing does."""
        X_NQ = self.likelihood.configuration.quadrotors_over(X_NG)
        reasons = reasons_against(
            X_NG, X_NQ, self.gaps(X_NG), self.centre, self.surface, self.parameters
        )
        return reasons + self._tilted(X_NG)

    def reasons_of_one(self, X_NG: Pose, gripper: int) -> tuple[str, ...]:
        """Return what makes one of the grippers X_NG (n,) infeasible by itself, whatever the others do."""
        X_NQ = self.likelihood.configuration.quadrotors_over(X_NG)
        one = X_NG.take([gripper])
        # What it lifts depends on the others.
        alone = replace(self.parameters, lift=None)
        reasons = reasons_against(
            one, X_NQ.take([gripper]), self.gaps(one), self.centre, self.surface, alone
        )
        return reasons + self._tilted(one)

    def solution(self, X_NG: Pose, rank: int = 1) -> Solution:
        """Return the solution with grippers X_NG (n,), in the cloud's frame S."""
        X_SN, reasons = self.query.scan.X_SN, self.reasons(X_NG)
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

    def _tilted(self, X_NG: Pose) -> tuple[str, ...]:
        _, normal, _ = self.surface.set_down(X_NG)
        lean = np.arccos(np.clip(np.sum(normal * axis_of(X_NG.q, 2), axis=1), -1.0, 1.0))
        name = [f"gripper {k + 1}: " if len(lean) > 1 else "" for k in range(len(lean))]
        return tuple(
            f"{name[k]}tilted against the surface ({np.rad2deg(lean[k]):.0f} deg)"
            for k in np.flatnonzero(lean > _FLUSH)
        )
