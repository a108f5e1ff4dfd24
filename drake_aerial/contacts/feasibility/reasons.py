"""Reasons why a contact solution cannot be flown: values with a kind and a text."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum

import numpy as np


class ReasonKind(Enum):
    """Kind of a reason; its value is the text (or template) that contacts.json holds."""

    UPSIDE_DOWN = "upside down (its axis points {value:.0f} deg above the horizontal)"
    SIDEWAYS = (
        "sideways (its axis points {value:.0f} deg above the horizontal, at least {limit:.0f} deg "
        "are needed)"
    )
    UPSIDE_DOWN_AFTER_MOVE = "upside down where it was moved to (the surface faces {value:.0f} deg)"
    CABLE_THROUGH_PAYLOAD = "cable through the payload"
    OFF_SURFACE = "off the surface (nearest point {value:.1f} cm away)"
    TILTED = "tilted against the surface ({value:.0f} deg)"
    QUADROTORS_TOO_CLOSE = (
        "quadrotors {first} and {second} too close ({value:.2f} m, at least {limit:.2f} m)"
    )
    ONE_SIDED = "no positive-tension equilibrium (all contacts on one side of the centre of mass)"
    UNBALANCED = "no positive-tension equilibrium (cables do not balance)"
    TOO_MUCH_TENSION = (
        "more tension than the propellers lift ({value:.1f} N, at most {limit:.1f} N)"
    )
    CONSTRAINT_VIOLATED = 'constraint "{name}" is violated by {value:.2g}'
    OTHER = "{name}"


# Units in texts that are not SI, over the SI unit.
_TEXT_UNIT = {
    ReasonKind.UPSIDE_DOWN: float(np.rad2deg(1.0)),
    ReasonKind.SIDEWAYS: float(np.rad2deg(1.0)),
    ReasonKind.UPSIDE_DOWN_AFTER_MOVE: float(np.rad2deg(1.0)),
    ReasonKind.OFF_SURFACE: 100.0,
    ReasonKind.TILTED: float(np.rad2deg(1.0)),
}


@dataclass(frozen=True)
class Reason:
    """One reason against a solution; `str(reason)` is its text.

    Attributes
    ----------
    kind : ReasonKind
        Kind of the reason.
    gripper : int or None
        Index of the gripper, from 0. None if it concerns all of them, or there is only one.
    pair : (int, int) or None
        Indices of two quadrotors, from 0.
    value : float or None
        The number that is out of bounds: an elevation or a tilt [rad], a distance [m], a tension
        [N], or the violation of a constraint in the constraint's own unit. A reason that was read
        from a file has it as rounded as its text.
    limit : float or None
        The bound, in the same unit, if the text names it.
    name : str or None
        Name of a constraint, or the whole text if the kind is `OTHER`.

    Examples
    --------
    >>> from drake_aerial.contacts.feasibility.reasons import Reason, ReasonKind
    >>> reason = Reason(ReasonKind.OFF_SURFACE, gripper=1, value=0.03)
    >>> str(reason)
    'gripper 2: off the surface (nearest point 3.0 cm away)'
    >>> Reason.from_text(str(reason)) == reason
    True
    """

    kind: ReasonKind
    gripper: int | None = None
    pair: tuple[int, int] | None = None
    value: float | None = None
    limit: float | None = None
    name: str | None = None

    def __str__(self) -> str:
        first, second = (-1, -1) if self.pair is None else self.pair
        unit = _TEXT_UNIT.get(self.kind, 1.0)
        text = self.kind.value.format(
            value=None if self.value is None else self.value * unit,
            limit=None if self.limit is None else self.limit * unit,
            name=self.name,
            first=first + 1,
            second=second + 1,
        )
        return text if self.gripper is None else f"gripper {self.gripper + 1}: {text}"

    @classmethod
    def from_text(cls, text: str) -> Reason:
        """Return the reason with a text; an unknown text becomes a reason of the kind `OTHER`."""
        for kind, pattern in _PATTERNS.items():
            match = pattern.fullmatch(text)
            if match is not None and str(reason := cls._of_match(kind, match.groupdict())) == text:
                return reason
        return cls(ReasonKind.OTHER, name=text)

    @classmethod
    def _of_match(cls, kind: ReasonKind, given: dict[str, str]) -> Reason:
        number = {
            key: float(given[key]) / _TEXT_UNIT.get(kind, 1.0)
            for key in ("value", "limit")
            if key in given
        }
        return cls(
            kind,
            gripper=None if given["gripper"] is None else int(given["gripper"]) - 1,
            pair=(int(given["first"]) - 1, int(given["second"]) - 1) if "first" in given else None,
            name=given.get("name"),
            **number,
        )


def _pattern(kind: ReasonKind) -> re.Pattern[str]:
    """Return the expression whose groups are the fields of a kind's text."""
    number = r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
    field = {"name": ".*", "first": r"\d+", "second": r"\d+"}
    parts = re.split(r"\{(\w+)[^}]*\}", kind.value)
    for i in range(1, len(parts), 2):
        parts[i] = f"(?P<{parts[i]}>{field.get(parts[i], number)})"
    parts[::2] = map(re.escape, parts[::2])
    return re.compile(r"(?:gripper (?P<gripper>\d+): )?" + "".join(parts), re.DOTALL)


_PATTERNS = {kind: _pattern(kind) for kind in ReasonKind}
