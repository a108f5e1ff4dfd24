"""Find the columns x, y and z of a table file or a structured array."""

from __future__ import annotations

from collections.abc import Sequence


def coordinate_names(names: Sequence[str]) -> tuple[str, str, str] | None:
    """Return the names of the three coordinates among `names`, or None.

    Accepted are `x y z` in any case, f0 f1 f2, and three names that differ only in one letter x,
    y, z, such as `px py pz` or `position_x position_y position_z`. Names of normals are skipped.
    """
    lower = {name.strip().lower(): name for name in reversed(names)}
    for exact in (("x", "y", "z"), ("f0", "f1", "f2")):
        if all(name in lower for name in exact):
            return lower[exact[0]], lower[exact[1]], lower[exact[2]]
    for name in lower:
        if name.startswith("n"):
            continue
        for at in (i for i, letter in enumerate(name) if letter == "x"):
            y, z = (name[:at] + letter + name[at + 1 :] for letter in "yz")
            if y in lower and z in lower:
                return lower[name], lower[y], lower[z]
    return None
