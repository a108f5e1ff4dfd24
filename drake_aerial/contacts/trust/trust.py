"""The trust in one solution: a probability, and the reasons for and against it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Trust:
    """Probability that one solution is right, with the reasons for and against it.

    Attributes
    ----------
    probability : float
        Probability that the solution lies at the right place: within 5 % of the object's size, at
        least 1 cm.
    speaks_for, speaks_against : tuple of str
        What speaks for the solution and against it, in words.
    """

    probability: float
    speaks_for: tuple[str, ...] = ()
    speaks_against: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return the entry `trust` of a solution in contacts.json."""
        return {
            "probability": round(self.probability, 4),
            "for": list(self.speaks_for),
            "against": list(self.speaks_against),
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Trust:
        """Return the trust of an entry of contacts.json; the inverse of `to_dict`.

        Raises
        ------
        ValueError
            If the probability is not in [0, 1].
        """
        probability = float(values["probability"])
        if not 0.0 <= probability <= 1.0:
            raise ValueError(f"`trust` must have a `probability` in [0, 1], got {probability}")
        return cls(probability, _texts(values, "for"), _texts(values, "against"))


def _texts(values: Mapping[str, Any], key: str) -> tuple[str, ...]:
    return tuple(str(text) for text in values[key])
