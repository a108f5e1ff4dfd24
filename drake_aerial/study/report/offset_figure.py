"""Why one contact flies better than another: flights against how far the contact lies from above the centre of mass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from drake_aerial.study.analysis.quantities import (
    BY_KEY,
    METHOD_MARKS,
    METHOD_ORDER,
    method_color,
    position,
)
from drake_aerial.study.analysis.statistics import (
    Group,
    Record,
    by_solution,
    failed,
    flown,
    value_of,
)
from drake_aerial.visualization.matplotlib_figure import figure, save_png_and_pdf

ROWS = ("position_rmse_m", "attitude_rmse_rad")


def draw_offsets(stem: Path, groups: Mapping[Group, Sequence[Record]], inertia: str) -> Path | None:
    """Write, one column a belief, position and attitude error of each solution against its contact's offset; return its PNG, or None if none was flown.

    Parameters
    ----------
    stem : Path
        Of the files, without an ending.
    groups : mapping of Group to records
        Of one condition or of several.
    inertia : str
        Arms of this one are drawn.
    """
    points = {
        group: _solutions(records) for group, records in groups.items() if group.inertia == inertia
    }
    points = {group: found for group, found in points.items() if found}
    if not points:
        return None
    beliefs = list(dict.fromkeys(group.belief for group in points))
    methods = sorted({group.method for group in points}, key=lambda m: position(METHOD_ORDER, m))
    drawing, axes = figure(
        4.6 * len(beliefs) + 1.2, 5.6, len(ROWS), len(beliefs), sharex=True, sharey="row"
    )
    for row, key in zip(axes, ROWS):
        quantity = BY_KEY[key]
        top = max(
            (
                quantity.factor * v
                for found in points.values()
                for _, values, _ in found
                if (v := values[key]) is not None
            ),
            default=1.0,
        )
        for axis, belief in zip(row, beliefs):
            for group, found in points.items():
                if group.belief != belief:
                    continue
                mark = {
                    "color": method_color(group.method),
                    "marker": METHOD_MARKS.get(group.method, "o"),
                }
                good = [
                    (100 * x, quantity.factor * value)
                    for x, v, _ in found
                    if (value := v[key]) is not None
                ]
                if good:
                    axis.plot(*np.array(good).T, ls="none", ms=6, alpha=0.75, mew=0, **mark)
                # A solution with a failed flight stands on the upper border.
                bad = [100 * x for x, _, broken in found if broken]
                axis.plot(
                    bad, [1.12 * top] * len(bad), ls="none", ms=8, mfc="none", mew=1.4, **mark
                )
            axis.grid(alpha=0.25)
            axis.set_ylim(0.0, 1.2 * top)
        row[0].set_ylabel(f"{quantity.name}\n[{quantity.unit}]")
    for axis, belief in zip(axes[0], beliefs):
        axis.set_title(f"belief {belief}", fontsize=11)
    for axis in axes[-1]:
        axis.set_xlabel("contact's distance from above the centre of mass [cm]")
    handles = [
        axes[0, 0].plot(
            [],
            [],
            ls="none",
            marker=METHOD_MARKS.get(m, "o"),
            color=method_color(m),
            mew=0,
            label=m,
        )[0]
        for m in methods
    ]
    drawing.legend(handles=handles, loc="outside upper center", ncols=len(handles), frameon=False)
    return save_png_and_pdf(drawing, stem, dpi=110)


def _solutions(records: Sequence[Record]) -> list[tuple[float, dict[str, float | None], bool]]:
    found = []
    for members in by_solution(flown(records)).values():
        offset = (members[0].get("contact") or {}).get("off_com_m")
        if offset is None:
            continue
        values: dict[str, float | None] = {}
        for key in ROWS:
            measured = [v for v in (value_of(record, key) for record in members) if v is not None]
            values[key] = float(np.mean(measured)) if measured else None
        found.append((float(offset), values, any(failed(record) for record in members)))
    return found
