"""Reasons for and against a solution, as text."""

from __future__ import annotations

import numpy as np

from drake_aerial.contacts.trust.evidence import Evidence
from drake_aerial.contacts.trust.trust import Trust

_SHARES = (
    (0.92, "nearly all"),
    (0.72, "three quarters"),
    (0.6, "two thirds"),
    (0.45, "half"),
    (0.3, "a third"),
    (0.22, "a quarter"),
    (0.15, "a fifth"),
    (0.08, "a tenth"),
    (0.0, "almost none"),
)


def statements(evidence: Evidence) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the reasons for a solution, and the reasons against it."""
    found = [
        _fit(evidence),
        _elsewhere(evidence),
        _counterparts(evidence),
        _box(evidence),
        _height(evidence),
        _alternative(evidence),
        _cut(evidence),
        _size(evidence),
    ]
    speaks_for = tuple(text for good, text in found if text and good)
    speaks_against = tuple(text for good, text in found if text and not good)
    return speaks_for, speaks_against


def low_trust(trust: Trust, least: float) -> str:
    """Return one line that says that a trust is too low, why, and what to do."""
    why = "; ".join(trust.speaks_against) or "no statistic is clearly good"
    return (
        f"trust {trust.probability:.2f} in the best contact is below `min_trust` = {least:g}: "
        f"{why}; check it with `view`, demonstrate on a more similar object, or lower `min_trust`"
    )


def _cm(length: float) -> str:
    return f"{100.0 * length:.0f} cm" if length >= 0.02 else f"{100.0 * length:.1f} cm"


def _fit(e: Evidence) -> tuple[bool, str]:
    off = _cm(e.whole * e.size)
    if e.whole < 0.008:
        return True, f"aligned at this contact, the demonstrated object fits the scan to {off}"
    if e.whole > 0.018:
        return False, f"aligned at this contact, the demonstrated object is {off} from the scan"
    return True, ""


def _elsewhere(e: Evidence) -> tuple[bool, str]:
    if e.better_elsewhere > 0.003:
        return False, "the demonstrated object fits better with the contact at another place"
    return True, ""


def _counterparts(e: Evidence) -> tuple[bool, str]:
    if e.counterparts >= 0.75:
        return True, f"{_share(e.counterparts)} of the demonstrated edges have a counterpart"
    if e.counterparts < 0.6:
        share = _share(1.0 - e.counterparts)
        return False, f"{share} of the demonstrated edges have no counterpart"
    return True, ""


def _share(share: float) -> str:
    return next(words for least, words in _SHARES if share >= least)


def _box(e: Evidence) -> tuple[bool, str]:
    away = _cm(e.box_distance * e.size)
    if e.box_distance < 0.05:
        return True, f"the demonstrated place in the bounding box is {away} away"
    if e.box_distance > 0.1:
        return False, f"the demonstrated place in the bounding box is {away} away"
    return True, ""


def _height(e: Evidence) -> tuple[bool, str]:
    if abs(e.height) > 0.1:
        way = "higher" if e.height > 0.0 else "lower"
        by = _cm(abs(e.height) * e.size)
        return False, f"below the top, the contact lies {by} {way} than the demonstrated one"
    return True, ""


def _alternative(e: Evidence) -> tuple[bool, str]:
    if e.gap < 1.0:
        likely = "likelier" if e.gap < 0.0 else "nearly as likely"
        return False, f"another place {_cm(e.gap_distance * e.size)} away is {likely}"
    if e.gap > 3.0:
        return True, "no other place is nearly as likely"
    return True, ""


def _cut(e: Evidence) -> tuple[bool, str]:
    if e.cut > 0.04:
        return False, f"the scan is cut off in {100.0 * e.cut:.0f} % of the directions"
    return True, ""


def _size(e: Evidence) -> tuple[bool, str]:
    if e.size_ratio > np.log(3.0):
        return False, f"one object is {np.exp(e.size_ratio):.1f} times as large as the other"
    return True, ""
