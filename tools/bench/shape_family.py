"""Generated kinds of objects with sites that are defined in each kind's own parameters.

A kind draws all its proportions from a generator, so that parts move, stretch and change height
between two draws. Half of the kinds are for development, half for reports; the split was fixed by
name before anything was measured.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import shape_kinds_development as development
import shape_kinds_report as report
from shape_parts import Shape

HALVES = ("development", "report")


@dataclass(frozen=True)
class Kind:
    """A kind of object: its generator, and the range of its largest extent [m]."""

    name: str
    half: str
    make: Callable[..., Shape]
    sites: tuple[str, ...]
    extent: tuple[float, float] = (0.15, 2.0)


KINDS = {
    kind.name: kind
    for kind in (
        *(Kind(name, "development", *entry) for name, entry in development.KINDS.items()),
        *(Kind(name, "report", *entry) for name, entry in report.KINDS.items()),
    )
}


def kinds_of(half: str) -> list[Kind]:
    """Return the kinds of a half, in a fixed order."""
    return [kind for kind in KINDS.values() if kind.half == half]
