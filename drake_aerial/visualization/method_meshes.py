"""Coloured meshes of the method's values: surface features, a skill, contacts on a scan."""

from collections.abc import Iterable

import numpy as np

from drake_aerial.contacts.solutions import Solution
from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import Array, Pose
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.visualization.colored_mesh import ColoredMesh
from drake_aerial.visualization.colors import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Color,
    diverging,
    solution_color,
)

FEATURE_LEGEND = [
    (GREY, "flat"),
    (RED, "convex"),
    (BLUE, "concave"),
    (ORANGE, "rim of the visible part"),
]
SKILL_LEGEND = [(GREY, "demonstrated cloud"), (RED, "contact features"), (BLACK, "task features")]


def features_mesh(features: SurfaceFeatures) -> ColoredMesh:
    """Draw surface features: first principal curvature as colour, orange rims, a few frames."""
    mesh = ColoredMesh()
    radius = _point_radius(features.p)
    colors = diverging(features.r[:, 0] / 0.7)
    colors[features.rim] = ORANGE
    mesh.add_points(features.p, color=colors, radius=radius)
    for index in np.linspace(0, len(features) - 1, min(40, len(features))).astype(int):
        mesh.add_frame(features.pose.take(index), length=8 * radius, radius=0.5 * radius)
    return mesh


def skill_mesh(skill: ContactSkill) -> ColoredMesh:
    """Draw a demonstration: cloud, contact features (red), task features (black), formation."""
    mesh = ColoredMesh()
    radius = _point_radius(skill.points)
    mesh.add_points(skill.points, radius=radius)
    for model in skill.objects:
        mesh.add_points(model.features.p, color=RED, radius=1.3 * radius)
    mesh.add_points(skill.task.salient.p, color=BLACK, radius=2.2 * radius)
    add_formation(mesh, skill.X_NG, skill.X_NQ, GREEN)
    return mesh


def contacts_mesh(
    points: Array, solutions: Iterable[Solution], *, colors: Array | None = None
) -> ColoredMesh:
    """Draw a scan with solutions: green, darkest for the first rank; red if infeasible.

    Parameters
    ----------
    points : (N, 3) array
        The scan, in the frame of the solutions [m].
    solutions : iterable of Solution
        The first is drawn with its quadrotors, the others as contact and normal.
    colors : (N, 3) array, optional
        Colours of the points in 0..1, for instance the query density as `heat`.
    """
    mesh = ColoredMesh()
    radius = _point_radius(points)
    # Larger points close up to a surface, on which a density is easier to see.
    mesh.add_points(
        points,
        color=GREY if colors is None else colors,
        radius=radius if colors is None else 1.8 * radius,
    )
    for index, solution in enumerate(solutions):
        color = solution_color(solution.rank, solution.feasible)
        if index == 0:
            add_formation(mesh, solution.X_SG, solution.X_SQ, color)
            continue
        for p, normal in zip(solution.X_SG.p, solution.normal):
            mesh.add_sphere(p, color=color, radius=4 * radius)
            mesh.add_arrow(p, p + 0.08 * normal, color=color, radius=radius)
    return mesh


def add_formation(mesh: ColoredMesh, grippers: Pose, quadrotors: Pose, color: Color) -> None:
    """Add n grippers with their frames, cables and quadrotors: batches (n,) in one frame."""
    for n in range(len(grippers.p)):
        p_G, p_Q = grippers.p[n], quadrotors.p[n]
        mesh.add_sphere(p_G, color=color, radius=0.016)
        mesh.add_frame(grippers.take(n), length=0.08, radius=0.004)
        mesh.add_tube([p_G, p_Q], color=BLACK, radius=0.0025)
        mesh.add_quadrotor(quadrotors.take(n), arm=0.11)


def _point_radius(points: Array) -> float:
    """Return a radius for drawn points [m]: a fraction of the scan's size, less for many points."""
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    return size * float(np.clip(0.4 / np.sqrt(max(len(points), 1)), 0.0015, 0.01))
