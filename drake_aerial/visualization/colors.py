"""Colours of the drawings: names, colour maps, and the colour of a solution."""

import numpy as np

from drake_aerial.geometry import Array

Color = tuple[float, float, float]
"""Red, green and blue in 0..1, as they look on the screen (sRGB)."""

GREY: Color = (0.62, 0.65, 0.70)
RED: Color = (0.85, 0.12, 0.10)
BLACK: Color = (0.05, 0.05, 0.06)
BLUE: Color = (0.10, 0.35, 0.85)
GREEN: Color = (0.10, 0.60, 0.25)
ORANGE: Color = (0.95, 0.55, 0.05)
AXES: tuple[Color, Color, Color] = ((0.90, 0.10, 0.10), (0.10, 0.70, 0.15), (0.12, 0.25, 0.95))

# First rank darkest; the paper shows five.
RANK_COLORS: tuple[Color, ...] = (
    (0.05, 0.42, 0.16),
    (0.15, 0.58, 0.30),
    (0.35, 0.70, 0.45),
    (0.52, 0.78, 0.56),
    (0.68, 0.85, 0.68),
)
HEAT_COLORS: tuple[Color, Color, Color] = (GREY, ORANGE, RED)
"""Colours of `heat` at 0, 1/2 and 1."""


def diverging(value: Array) -> Array:
    """Return colours (N, 3) for values (N,): blue at -1, grey at 0, red at +1."""
    value = np.clip(np.asarray(value, float), -1.0, 1.0)[:, None]
    return np.where(
        value > 0,
        (1 - value) * np.array(GREY) + value * np.array(RED),
        (1 + value) * np.array(GREY) - value * np.array(BLUE),
    )


def heat(value: Array) -> Array:
    """Return colours (N, 3) for values (N,) in 0..1: grey over orange to red."""
    value = np.clip(np.asarray(value, float), 0.0, 1.0)[:, None]
    low = (1 - 2 * value) * np.array(GREY) + 2 * value * np.array(ORANGE)
    high = (2 - 2 * value) * np.array(ORANGE) + (2 * value - 1) * np.array(RED)
    return np.where(value < 0.5, low, high)


def solution_color(rank: int, feasible: bool) -> Color:
    """Return the colour of a solution: green by rank, red if it is infeasible."""
    return RANK_COLORS[min(rank, len(RANK_COLORS)) - 1] if feasible else RED
