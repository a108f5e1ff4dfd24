"""Figure of the contacts of several methods: the demonstration, then each method's best."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.geometry import Array
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.visualization.colored_mesh import ColoredMesh
from drake_aerial.visualization.colors import BLACK, GREY, RED, heat, solution_color
from drake_aerial.visualization.matplotlib_figure import figure, save_figure
from drake_aerial.visualization.method_meshes import add_formation, skill_mesh
from drake_aerial.visualization.rendering import render, render_over

PANEL = (460, 460)
"""Width and height of a rendered panel [pixels]."""
POINT_RADIUS = 0.0048
"""Radius of a point as a fraction of the scan's diagonal: features close up to a surface."""


def draw_contacts(
    path: str | Path,
    skill: ContactSkill,
    points: Array,
    results: Mapping[str, ContactSolutions],
    *,
    heats: Mapping[str, Array] | None = None,
    most: int = 5,
) -> None:
    """Write the figure, with one row a method.

    Parameters
    ----------
    path : str or Path
        The figure (.png, .pdf or .svg).
    skill : ContactSkill
        Its demonstration is the first column.
    points : (N, 3) array
        The scan, in the frame of the solutions [m].
    results : mapping of label to ContactSolutions
        One row each.
    heats : mapping of label to (N,) array, optional
        Query density at the points, in 0..1, drawn as heat map.
    most : int
        Largest number of solutions in a row.
    """
    columns = 1 + min(most, max(len(result.solutions) for result in results.values()))
    drawing, axes = figure(2.4 * columns, 2.6 * len(results), len(results), columns)
    demonstration = render(skill_mesh(skill), size=PANEL, zoom=1.1)
    radius = float(np.linalg.norm(np.ptp(points, axis=0))) * POINT_RADIUS
    for row, (label, result) in zip(axes, results.items()):
        row[0].imshow(demonstration)
        row[0].set_title("demonstration", fontsize=9)
        row[0].set_ylabel(label, fontsize=11)
        colors = heat(heats[label]) if heats and label in heats else GREY
        scan = ColoredMesh()
        scan.add_points(points, color=colors, radius=radius)
        formations = []
        for solution in result.solutions[: len(row) - 1]:
            formation = ColoredMesh()
            color = solution_color(solution.rank, solution.feasible)
            add_formation(formation, solution.X_SG, solution.X_SQ, color)
            formations.append(formation)
        images = render_over(scan, formations, size=PANEL, zoom=1.1)
        for axis, solution, image in zip(row[1:], result.solutions, images):
            axis.imshow(image)
            reason = "" if solution.feasible else f": {solution.reasons[0]}"
            axis.set_title(
                f"{solution.rank}{reason}", fontsize=9, color=BLACK if solution.feasible else RED
            )
        for axis in row:
            axis.set(xticks=[], yticks=[])
            axis.spines[:].set_visible(False)
    save_figure(drawing, path, dpi=150)
