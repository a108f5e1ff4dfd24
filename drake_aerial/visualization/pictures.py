"""Pictures of the method's values: a cloud with its features, a skill, contacts on a scan."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from drake_aerial.geometry import Array, Pose
from drake_aerial.visualization.picture import BLACK, BLUE, GREEN, GREY, ORANGE, RED, Color, Picture

if TYPE_CHECKING:
    from drake_aerial.contacts.solutions import Solution
    from drake_aerial.features.surface_features import SurfaceFeatures
    from drake_aerial.skill.contact_skill import ContactSkill

# First rank darkest; the paper shows five.
RANK_COLORS: tuple[Color, ...] = (
    (0.05, 0.42, 0.16),
    (0.15, 0.58, 0.30),
    (0.35, 0.70, 0.45),
    (0.52, 0.78, 0.56),
    (0.68, 0.85, 0.68),
)

HEAT_COLORS: tuple[Color, Color, Color] = (GREY, ORANGE, RED)
"""Of `heat` at 0, 1/2 and 1."""
FEATURE_LEGEND = [
    (GREY, "flat"),
    (RED, "convex"),
    (BLUE, "concave"),
    (ORANGE, "rim of the visible part"),
]
SKILL_LEGEND = [(GREY, "demonstrated cloud"), (RED, "contact features"), (BLACK, "task features")]


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


def features_picture(features: SurfaceFeatures) -> Picture:
    """Draw surface features coloured by their first principal curvature, rims apart; frames on a few."""
    picture = Picture()
    radius = _dot(features.p)
    colors = diverging(features.r[:, 0] / 0.7)
    colors[features.rim] = ORANGE
    picture.add_points(features.p, color=colors, radius=radius)
    for index in np.linspace(0, len(features) - 1, min(40, len(features))).astype(int):
        picture.add_frame(features.pose.take(index), length=8 * radius, radius=0.5 * radius)
    return picture


def skill_picture(skill: ContactSkill) -> Picture:
    """Draw a demonstration as the paper does: cloud, contact features (red), task features (black), formation."""
    picture = Picture()
    radius = _dot(skill.points)
    picture.add_points(skill.points, radius=radius)
    for model in skill.objects:
        picture.add_points(model.features.p, color=RED, radius=1.3 * radius)
    picture.add_points(skill.task.salient.p, color=BLACK, radius=2.2 * radius)
    add_formation(picture, skill.X_NG, skill.X_NQ, GREEN)
    return picture


def contacts_picture(
    points: Array, solutions: Iterable[Solution], *, colors: Array | None = None
) -> Picture:
    """Draw a scan (N, 3) [m] with solutions on it; ranks fade from dark to light green, infeasible ones are red.

    Parameters
    ----------
    points : (N, 3) array
        The scan, in the frame that the solutions are in [m].
    solutions : iterable of Solution
        What to draw; the first is drawn with its quadrotors, the others as contact and normal.
    colors : (N, 3) array, optional
        Colours of the points in 0..1, for instance the query density as `heat`.
    """
    picture = Picture()
    radius = _dot(points)
    # A density is seen on a surface, not on dots.
    picture.add_points(
        points,
        color=GREY if colors is None else colors,
        radius=radius if colors is None else 1.8 * radius,
    )
    for index, solution in enumerate(solutions):
        color = solution_color(solution.rank, solution.feasible)
        if index == 0:
            add_formation(picture, solution.X_SG, solution.X_SQ, color)
            continue
        for p, normal in zip(solution.X_SG.p, solution.normal):
            picture.add_sphere(p, color=color, radius=4 * radius)
            picture.add_arrow(p, p + 0.08 * normal, color=color, radius=radius)
    return picture


def solution_color(rank: int, feasible: bool) -> Color:
    """Return the colour that a solution is drawn in."""
    return RANK_COLORS[min(rank, len(RANK_COLORS)) - 1] if feasible else RED


def add_formation(picture: Picture, grippers: Pose, quadrotors: Pose, color: Color) -> None:
    """Draw n grippers with their frames, cables and quadrotors: batches (n,) in one frame."""
    for n in range(len(grippers.p)):
        p_G, p_Q = grippers.p[n], quadrotors.p[n]
        picture.add_sphere(p_G, color=color, radius=0.016)
        picture.add_frame(grippers.take(n), length=0.08, radius=0.004)
        picture.add_tube([p_G, p_Q], color=BLACK, radius=0.0025)
        picture.add_quadrotor(quadrotors.take(n), arm=0.11)


def _dot(points: Array) -> float:
    """A dot's radius [m] that fits the scan: a fraction of its size, smaller where points are many."""
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    return size * float(np.clip(0.4 / np.sqrt(max(len(points), 1)), 0.0015, 0.01))
