"""Figure of error against the horizontal distance of the contact from the centre of mass."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.study.analysis.groups import Group, by_solution, failed, offset_of, values_of
from drake_aerial.study.analysis.labels import METHOD_ORDER, position
from drake_aerial.study.analysis.quantities import BY_KEY
from drake_aerial.study.records import Record
from drake_aerial.study.report.method_styles import METHOD_MARKS, method_color
from drake_aerial.visualization.matplotlib_figure import figure, save_png_and_pdf

_ROWS = tuple(BY_KEY[key] for key in ("position_rmse_m", "attitude_rmse_rad"))


@dataclass(frozen=True)
class _Solution:
    """One contact solution: offset [cm], mean of each row's quantity in its unit, any failure."""

    offset: float
    means: list[float | None]
    failed: bool


def draw_contact_offsets(
    stem: Path, groups: Mapping[Group, Sequence[Record]], inertia: str
) -> Path | None:
    """Write the figure: one column per belief, position and attitude error of each solution.

    Parameters
    ----------
    stem : Path
        Path of the files without their endings.
    groups : mapping of Group to records
    inertia : str
        Only groups of this inertia are drawn.

    Returns
    -------
    Path or None
        The PNG; None if nothing was flown.
    """
    points = {
        group: _solutions(records) for group, records in groups.items() if group.inertia == inertia
    }
    points = {group: found for group, found in points.items() if found}
    if not points:
        return None
    beliefs = list(dict.fromkeys(group.belief for group in points))
    methods = sorted({group.method for group in points}, key=lambda m: position(METHOD_ORDER, m))
    size = (4.6 * len(beliefs) + 1.2, 5.6)
    drawing, axes = figure(*size, len(_ROWS), len(beliefs), sharex=True, sharey="row")
    everyone = [solution for found in points.values() for solution in found]
    for k, (row, quantity) in enumerate(zip(axes, _ROWS)):
        means = [s.means[k] for s in everyone]
        top = max((mean for mean in means if mean is not None), default=1.0)
        for axis, belief in zip(row, beliefs):
            for group, found in points.items():
                if group.belief == belief:
                    _draw_method(axis, group.method, found, k, top)
            axis.grid(alpha=0.25)
            axis.set_ylim(0.0, 1.2 * top)
        row[0].set_ylabel(f"{quantity.name}\n[{quantity.unit}]")
    for axis, belief in zip(axes[0], beliefs):
        axis.set_title(f"belief {belief}", fontsize=11)
    for axis in axes[-1]:
        axis.set_xlabel("horizontal distance of the contact from the centre of mass [cm]")
    handles = [axes[0, 0].plot([], [], label=m, mew=0, **_mark(m))[0] for m in methods]
    drawing.legend(handles=handles, loc="outside upper center", ncols=len(handles), frameon=False)
    return save_png_and_pdf(drawing, stem, dpi=110)


def _mark(method: str) -> dict[str, Any]:
    return {"ls": "none", "marker": METHOD_MARKS.get(method, "o"), "color": method_color(method)}


def _draw_method(
    axis: Any, method: str, solutions: Sequence[_Solution], row: int, top: float
) -> None:
    """Draw the solutions of a method; those with a failed flight are on the upper border."""
    good = [(s.offset, mean) for s in solutions if (mean := s.means[row]) is not None]
    if good:
        axis.plot(*np.array(good).T, ms=6, alpha=0.75, mew=0, **_mark(method))
    bad = [s.offset for s in solutions if s.failed]
    axis.plot(bad, [1.12 * top] * len(bad), ms=8, mfc="none", mew=1.4, **_mark(method))


def _solutions(records: Sequence[Record]) -> list[_Solution]:
    found = []
    for members in by_solution(records).values():
        offset = offset_of(members)
        if offset is None:
            continue
        means = []
        for quantity in _ROWS:
            values = values_of(members, quantity.key)
            means.append(quantity.factor * float(np.mean(values)) if values else None)
        found.append(_Solution(100 * offset, means, any(map(failed, members))))
    return found
