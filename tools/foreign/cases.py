"""What a file of another library holds, and what is expected of reading it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

BOX = trimesh.creation.box([0.6, 0.4, 0.2])
RNG = np.random.default_rng(0)
POINTS = trimesh.sample.sample_surface(BOX, 480, seed=1)[0] + [0.05, -0.02, 0.03]
NORMALS = RNG.standard_normal((480, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)
COLORS = RNG.integers(0, 256, (480, 3)).astype(np.uint8)
VERTICES, TRIANGLES = np.asarray(BOX.vertices), np.asarray(BOX.faces)
# The box's sides as rings of corners, counter-clockwise from outside.
QUADS = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)


@dataclass(frozen=True)
class Case:
    """One file.

    Attributes
    ----------
    library : str
        The library that writes it.
    name : str
        The file's name; its options are part of it.
    write : callable
        Writes the file to a path.
    holds : str
        "points", "mesh", or a regular expression of the reason why it is refused.
    tolerance : float
        Largest error of a coordinate by the file's own number format [m].
    options : dict, optional
        Arguments of `read_scan`.
    expected : (N, 3) array, optional
        The points that it holds; `POINTS` by default.
    """

    library: str
    name: str
    write: Callable[[Path], Any]
    holds: str = "points"
    tolerance: float = 1e-7
    options: dict[str, Any] | None = None
    expected: np.ndarray | None = None
