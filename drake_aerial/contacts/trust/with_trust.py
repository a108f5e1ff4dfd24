"""Attach trust to the solutions of a transfer."""

from dataclasses import replace

import numpy as np

from drake_aerial.contacts.canonical_scan import CanonicalScan
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.solutions import Solution
from drake_aerial.contacts.trust.evidence import Evidence, gather_evidence
from drake_aerial.contacts.trust.statements import statements
from drake_aerial.contacts.trust.trust import Trust
from drake_aerial.contacts.trust.trust_model import TrustModel
from drake_aerial.geometry import Pose, invert
from drake_aerial.skill.contact_skill import ContactSkill

TRUSTED_METHODS = ("task", "control")
"""Methods whose solutions get a trust; the model was fitted on answers of `task`."""


def evidence_of(
    skill: ContactSkill,
    scan: CanonicalScan,
    solutions: tuple[Solution, ...],
    parameters: TransferParameters,
) -> list[Evidence]:
    """Return the evidence about each solution of a transfer on a scan."""
    X_NS = invert(scan.X_SN)
    X_NG = [X_NS @ solution.X_SG for solution in solutions]
    configurations = Pose(np.stack([X.p for X in X_NG]), np.stack([X.q for X in X_NG]))
    log_j = np.array([solution.log_likelihood for solution in solutions])
    return gather_evidence(skill, scan, configurations, log_j, parameters)


def with_trust(
    method: str,
    skill: ContactSkill,
    scan: CanonicalScan,
    solutions: tuple[Solution, ...],
    parameters: TransferParameters,
) -> tuple[Solution, ...]:
    """Return the solutions with their trust; unchanged for methods that have none.

    Parameters
    ----------
    method : str
        Method of the transfer.
    skill : ContactSkill
        The skill of the transfer.
    scan : CanonicalScan
        The scan of the transfer.
    solutions : tuple of Solution
        Its solutions, in the scan's frame S.
    parameters : TransferParameters
        Its parameters.
    """
    if method not in TRUSTED_METHODS or not solutions:
        return solutions
    model = TrustModel.shipped()
    return tuple(
        replace(solution, trust=Trust(model.probability_of(evidence), *statements(evidence)))
        for solution, evidence in zip(
            solutions, evidence_of(skill, scan, solutions, parameters), strict=True
        )
    )
