"""Assumptions made while a cloud is read; they are printed and recorded with the results."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class AssumptionKind(StrEnum):
    """The subject of an assumption."""

    UNITS = "units"
    AXES = "axes"
    UP = "up"
    OUTSIDE = "outside"
    DROPPED = "dropped"
    SPACING = "spacing"
    PRECISION = "precision"
    FACES = "faces"
    TOPIC = "topic"
    UNSEEN = "unseen"
    SCENE = "scene"


@dataclass(frozen=True)
class Assumption:
    """One assumption about a cloud's axes, unit or points.

    Attributes
    ----------
    kind : AssumptionKind
        Its subject.
    text : str
        One line: what was assumed, and what to do if that is wrong.
    """

    kind: AssumptionKind
    text: str

    def __str__(self) -> str:
        return f"{self.kind}: {self.text}"

    def to_dict(self) -> dict[str, str]:
        """Return the assumption as result files hold it."""
        return {"kind": str(self.kind), "text": self.text}
