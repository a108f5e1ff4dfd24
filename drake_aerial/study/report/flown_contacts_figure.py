"""Figure of the flown contacts of a condition: the demonstration, then each method's solutions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drake_aerial.contacts.solutions import Solution
from drake_aerial.geometry import Array
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.study.analysis.saliency import SalientSurface
from drake_aerial.study.report.method_styles import method_color
from drake_aerial.visualization.colored_mesh import ColoredMesh
from drake_aerial.visualization.colors import BLACK, BLUE, GREY
from drake_aerial.visualization.contacts_figure import POINT_RADIUS
from drake_aerial.visualization.matplotlib_figure import figure, save_png_and_pdf
from drake_aerial.visualization.method_meshes import add_formation, skill_mesh
from drake_aerial.visualization.rendering import render, render_over

CELL = (330, 330)
"""Width and height of a rendered cell [pixels]."""
_WIDTH = 1.75
"""Width of a cell in the figure [inches]."""
_SALIENT = 0.45
"""Points darker than this are drawn larger, so that a thin rim is visible."""
_COM_COLOR = (0.85, 0.10, 0.75)


@dataclass(frozen=True)
class FlownSolution:
    """A solution as transferred, and the caption above it."""

    solution: Solution
    caption: str


def draw_flown_contacts(
    stem: Path,
    skill: ContactSkill | None,
    surface: SalientSurface,
    rows: Mapping[str, Sequence[FlownSolution]],
    com_S: Sequence[float] | None,
    *,
    columns: int = 5,
) -> Path:
    """Write the figure of one condition and return its PNG.

    Parameters
    ----------
    stem : Path
        Path of the files without their endings.
    skill : ContactSkill, optional
        Its demonstration is the first column.
    surface : SalientSurface
        The scan; salient points are dark.
    rows : mapping of method to solutions
        In order.
    com_S : (3,), optional
        True centre of mass in the scan's frame [m], drawn with a line upwards.
    columns : int
        Largest number of solutions in a row.
    """
    first = 0 if skill is None else 1
    if all(len(cells) == 1 for cells in rows.values()):
        # One solution a method: side by side.
        shown = [(method, cell) for method, cells in rows.items() for cell in cells]
        drawing, axes = figure(_WIDTH * (len(shown) + first), 2.3, 1, len(shown) + first)
        grid = [[pair] for pair in zip(axes[0, first:], shown)]
    else:
        columns = max(1, min(columns, max(len(cells) for cells in rows.values())))
        drawing, axes = figure(
            _WIDTH * (columns + first), 2.05 * len(rows), len(rows), columns + first
        )
        grid = [
            [*zip(row[first:], ((method, cell) for cell in cells))]
            for row, (method, cells) in zip(axes, rows.items())
        ]
    if skill is not None:
        axes[0, 0].imshow(render(skill_mesh(skill), size=CELL, zoom=1.1))
        axes[0, 0].set_title("demonstration", fontsize=9)
    for axis in axes.flat:
        axis.set_axis_off()
    bounds, colors = _bounds(surface.points, rows), _saliency_colors(surface.saliency)
    meshes = [_formation(cell.solution) for row in grid for _, (_, cell) in row]
    images = iter(
        render_over(_scan(surface.points, colors, com_S), meshes, size=CELL, bounds=bounds)
    )
    for row in grid:
        for k, (axis, (method, cell)) in enumerate(row):
            axis.imshow(next(images))
            axis.set_title(cell.caption, fontsize=9)
            if k == 0:
                axis.text(
                    -0.02,
                    0.45,
                    method,
                    transform=axis.transAxes,
                    color=method_color(method),
                    fontsize=12,
                    weight="bold",
                    rotation=90,
                    ha="right",
                    va="center",
                )
    return save_png_and_pdf(drawing, stem, dpi=120)


def _scan(points: Array, colors: Array, com_S: Sequence[float] | None) -> ColoredMesh:
    mesh = ColoredMesh()
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    salient = colors[:, 0] < _SALIENT
    mesh.add_points(points[~salient], color=colors[~salient], radius=POINT_RADIUS * diagonal)
    mesh.add_points(points[salient], color=colors[salient], radius=1.5 * POINT_RADIUS * diagonal)
    if com_S is not None:
        x, y, z = com_S
        top = max(float(points[:, 2].max()), z) + 0.15
        mesh.add_tube([[x, y, z], [x, y, top]], color=_COM_COLOR, radius=0.006)
        mesh.add_sphere([x, y, z], color=_COM_COLOR, radius=0.02)
    return mesh


def _formation(solution: Solution) -> ColoredMesh:
    mesh = ColoredMesh()
    add_formation(mesh, solution.X_SG, solution.X_SQ, BLUE)
    return mesh


def _saliency_colors(saliency: Array) -> Array:
    dark = np.clip(saliency / 1.0, 0.0, 1.0)[:, None]
    return (1.0 - dark) * (np.array(GREY) * 0.7 + 0.3) + dark * np.array(BLACK)


def _bounds(points: Array, rows: Mapping[str, Sequence[FlownSolution]]) -> tuple[Array, Array]:
    parts = [points]
    for cells in rows.values():
        for cell in cells:
            parts += [cell.solution.X_SG.p, cell.solution.X_SQ.p]
    everything = np.concatenate(parts)
    return everything.min(axis=0), everything.max(axis=0)
