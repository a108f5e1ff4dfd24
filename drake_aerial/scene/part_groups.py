"""Groups of parts that are one object."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drake_aerial.scene.parts import Part


@dataclass(eq=False)
class Groups:
    """Groups of parts that are one object; the lowest part number is the group's number."""

    parts: dict[int, Part]
    head: dict[int, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.head = {number: number for number in self.parts}

    def of(self, number: int) -> int:
        """Return the number of the group of a part."""
        while self.head[number] != number:
            number = self.head[number]
        return number

    def join(self, first: int, second: int) -> bool:
        """Join the groups of two parts; return False if they were one group already."""
        low, high = sorted((self.of(first), self.of(second)))
        self.head[high] = low
        return low != high

    def members(self) -> dict[int, list[int]]:
        """Return the parts of each group."""
        found: dict[int, list[int]] = {}
        for number in self.parts:
            found.setdefault(self.of(number), []).append(number)
        return found

    def part(self, group: int) -> Part:
        """Return a group's geometry as one part."""
        parts = [self.parts[number] for number in self.members()[self.of(group)]]
        return Part(
            *(
                np.concatenate([getattr(part, name) for part in parts])
                for name in Part.__annotations__
            )
        )
