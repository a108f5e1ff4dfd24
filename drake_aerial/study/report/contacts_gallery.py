"""The paper's figure of contacts: the demonstration in the first column, then the best solutions of each method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from drake_aerial.geometry import Array
from drake_aerial.study.analysis.quantities import method_color
from drake_aerial.study.analysis.saliency import SalientSurface
from drake_aerial.visualization.colored_mesh import ColoredMesh
from drake_aerial.visualization.colors import BLACK, BLUE, GREY
from drake_aerial.visualization.matplotlib_figure import figure, save_png_and_pdf
from drake_aerial.visualization.method_meshes import add_formation, skill_mesh
from drake_aerial.visualization.rendering import render

if TYPE_CHECKING:
    from drake_aerial.contacts.solutions import Solution
    from drake_aerial.skill.contact_skill import ContactSkill

CELL = (330, 330)
_WIDTH = 1.75
# A dot's radius as a part of the scan's diagonal: the features then close up to a surface.
_DOT = 0.0048
# Points darker than this are drawn larger, for a thin rim is lost otherwise.
_RICH = 0.45
_COM = (0.85, 0.10, 0.75)


@dataclass(frozen=True)
class GalleryCell:
    """One solution as flown: what was transferred, what is written over it."""

    solution: Solution
    caption: str


def draw_gallery(
    stem: Path,
    skill: ContactSkill | None,
    surface: SalientSurface,
    rows: Mapping[str, Sequence[GalleryCell]],
    com_S: Sequence[float] | None,
    *,
    columns: int = 5,
) -> Path:
    """Write the figure of one condition and return its PNG.

    Parameters
    ----------
    stem : Path
        Of the files, without an ending.
    skill : ContactSkill, optional
        For the first column; left empty without.
    surface : SalientSurface
        The scan; drawn the darker, the more salient.
    rows : mapping of method to cells
        In order.
    com_S : (3,), optional
        The true centre of mass in the scan's frame [m], drawn as a vertical line through it.
    columns : int
        How many solutions a row has room for.
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
        axes[0, 0].set_title("shown once", fontsize=9)
    for axis in axes.flat:
        axis.set_axis_off()
    bounds, colors = _bounds(surface.points, rows), _saliency_colors(surface.saliency)
    for row in grid:
        for k, (axis, (method, cell)) in enumerate(row):
            picture = _picture(cell.solution, surface.points, colors, com_S)
            axis.imshow(render(picture, size=CELL, bounds=bounds))
            axis.set_title(cell.caption, fontsize=9)
            if k == 0:
                axis.text(
                    -0.02, 0.45, method, transform=axis.transAxes, fontsize=12, weight="bold", rotation=90, ha="right", va="center",
                    color=method_color(method),
                )  # fmt: skip
    return save_png_and_pdf(drawing, stem, dpi=120)


def _picture(
    solution: Solution, points: Array, colors: Array, com_S: Sequence[float] | None
) -> ColoredMesh:
    picture = ColoredMesh()
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    rich = colors[:, 0] < _RICH
    picture.add_points(points[~rich], color=colors[~rich], radius=_DOT * diagonal)
    picture.add_points(points[rich], color=colors[rich], radius=1.5 * _DOT * diagonal)
    add_formation(picture, solution.X_SG, solution.X_SQ, BLUE)
    if com_S is not None:
        x, y, z = com_S
        top = max(float(points[:, 2].max()), z) + 0.15
        picture.add_tube([[x, y, z], [x, y, top]], color=_COM, radius=0.006)
        picture.add_sphere([x, y, z], color=_COM, radius=0.02)
    return picture


def _saliency_colors(saliency: Array) -> Array:
    dark = np.clip(saliency / 1.0, 0.0, 1.0)[:, None]
    return (1.0 - dark) * (np.array(GREY) * 0.7 + 0.3) + dark * np.array(BLACK)


def _bounds(points: Array, rows: Mapping[str, Sequence[GalleryCell]]) -> tuple[Array, Array]:
    parts = [points]
    for cells in rows.values():
        for cell in cells:
            parts += [cell.solution.X_SG.p, cell.solution.X_SQ.p]
    everything = np.concatenate(parts)
    return everything.min(axis=0), everything.max(axis=0)
