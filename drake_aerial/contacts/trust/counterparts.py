"""Counterparts of the demonstrated task features on a new scan, if the contact is at a place."""

from __future__ import annotations

import numpy as np

from drake_aerial.contacts.canonical_scan import CanonicalScan
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.votes.hull_votes import GravityFeatures, turned
from drake_aerial.density.mixture import systematic_resample
from drake_aerial.features.horizontal_direction import gravity_saliency
from drake_aerial.geometry import Array
from drake_aerial.skill.contact_skill import ContactSkill

# Salient features of the new scan that are asked.
_ASKED = 250
# Standard deviation of a counterpart's place, as a share of the object's size.
_PLACE = 0.05


class Counterparts:
    """Demonstrated task features and their likely counterparts on a new scan.

    Parameters
    ----------
    skill : ContactSkill
        The learnt skill.
    scan : CanonicalScan
        The new scan.
    size : float
        The new object's size [m].
    parameters : TransferParameters
        Tolerances of the votes.
    """

    def __init__(
        self, skill: ContactSkill, scan: CanonicalScan, size: float, parameters: TransferParameters
    ):
        rng = np.random.default_rng(0)
        drawn = systematic_resample(gravity_saliency(scan.features), _ASKED, rng)
        new = GravityFeatures.of(scan.features.take(drawn), scan.hull)
        old = GravityFeatures.of(skill.task.salient, skill.hull)
        site = skill.X_NG.p.mean(axis=0)[:2]
        along = np.sum(old.t * (site - old.p), axis=1) * (new.support[:, None] / old.support)
        across = np.sum(turned(old.t) * (site - old.p), axis=1) * (new.width[:, None] / old.width)
        # Every demonstrated feature j at every asked feature a: arrays (A, J).
        self._sites = (
            new.p[:, None] + new.t[:, None] * along[..., None]
            + turned(new.t)[:, None] * across[..., None]
        )  # fmt: skip
        alike = ((new.strength[:, None] - old.strength) / parameters.vote_descriptor) ** 2
        depth = ((new.depth[:, None] - old.depth) / parameters.vote_depth) ** 2
        self._cost = alike + depth
        self._yaw = _angle(new.t)[:, None] - _angle(old.t)
        self._sigma = max(parameters.vote_sigma, _PLACE * size)
        self._sigma_yaw = parameters.vote_sigma_rotation

    def share(self, place: Array, yaw: float) -> float:
        """Return the share of demonstrated features with a counterpart.

        The contact is at `place` (3,) [m] and the demonstrated object is turned by `yaw` [rad].
        """
        off = np.sum((self._sites - place[:2]) ** 2, axis=-1) / self._sigma**2
        turn = np.abs((self._yaw - yaw + np.pi) % (2.0 * np.pi) - np.pi) / self._sigma_yaw
        return float(np.mean(np.exp(-0.5 * np.min(self._cost + off + turn**2, axis=0))))


def _angle(t: Array) -> Array:
    return np.arctan2(t[:, 1], t[:, 0])
