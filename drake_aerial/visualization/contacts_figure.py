"""The paper's figure of contacts: the demonstration first, then the best solutions of each method."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from drake_aerial.geometry import Array
from drake_aerial.visualization.picture import BLACK, Picture
from drake_aerial.visualization.pictures import add_formation, heat, skill_picture, solution_color
from drake_aerial.visualization.plots import figure, save_figure
from drake_aerial.visualization.rendering import render

if TYPE_CHECKING:
    from drake_aerial.contacts.solutions import ContactSolutions
    from drake_aerial.skill.contact_skill import ContactSkill

PANEL = (460, 460)
# A dot's radius as a fraction of the scan's diagonal: the features of a scan then close up to a surface.
DOT = 0.0048


def draw_contacts(
    path: str | Path,
    skill: ContactSkill,
    points: Array,
    results: Mapping[str, ContactSolutions],
    *,
    heats: Mapping[str, Array] | None = None,
    most: int = 5,
) -> None:
    """Write the figure: one row a method; demonstration, then its best solutions on the scan.

    Parameters
    ----------
    path : str or Path
        The figure (.png, .pdf or .svg).
    skill : ContactSkill
        What was demonstrated.
    points : (N, 3) array
        The scan, in the frame of the solutions [m].
    results : mapping of label to ContactSolutions
        One row each.
    heats : mapping of label to (N,) array, optional
        The query density at the points, in 0..1, drawn as heat.
    most : int
        How many solutions a row shows.
    """
    columns = 1 + min(most, max(len(result.solutions) for result in results.values()))
    drawing, axes = figure(2.4 * columns, 2.6 * len(results), len(results), columns)
    demonstration = render(skill_picture(skill), size=PANEL, zoom=1.1)
    radius = float(np.linalg.norm(np.ptp(points, axis=0))) * DOT
    for row, (label, result) in zip(axes, results.items()):
        row[0].imshow(demonstration)
        row[0].set_title("shown once", fontsize=9)
        row[0].set_ylabel(label, fontsize=11)
        colors = heat(heats[label]) if heats and label in heats else None
        for axis, solution in zip(row[1:], result.solutions):
            picture = Picture()
            if colors is None:
                picture.add_points(points, radius=radius)
            else:
                picture.add_points(points, color=colors, radius=radius)
            add_formation(
                picture,
                solution.X_SG,
                solution.X_SQ,
                solution_color(solution.rank, solution.feasible),
            )
            axis.imshow(render(picture, size=PANEL, zoom=1.1))
            title = (
                f"{solution.rank}"
                if solution.feasible
                else f"{solution.rank}: {solution.reasons[0]}"
            )
            axis.set_title(title, fontsize=9, color=BLACK if solution.feasible else (0.8, 0.1, 0.1))
        for axis in row:
            axis.set_xticks([])
            axis.set_yticks([])
            for spine in axis.spines.values():
                spine.set_visible(False)
    save_figure(drawing, path, dpi=150)
