"""Plots over time beside a replay: inline SVG with a cursor that goes with the animation, and takes it along when dragged."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from drake_aerial.geometry import Array

LINE_COLORS = ("#1b62c4", "#d1432b", "#2a8f4d", "#8a5cc2", "#b8860b", "#0e8a8a")
_WIDTH, _HEIGHT, _BINS = 1000.0, 100.0, 250


@dataclass(frozen=True, eq=False)
class TimePlot:
    """One quantity over time.

    Attributes
    ----------
    title : str
        With its unit in brackets.
    values : (T, lines) array
        Not negative.
    """

    title: str
    values: Array


def time_plots(time: Array, plots: Sequence[TimePlot], marks: Sequence[float] = ()) -> str:
    """Return the HTML of plots over one time axis, for a page with a Meshcat animation.

    Parameters
    ----------
    time : (T,) array
        [s], rising; the animation's time 0 is its first.
    plots : sequence of TimePlot
    marks : sequence of float
        Times [s] of the vertical dotted lines.

    Returns
    -------
    str
        Empty where there are fewer than two samples.
    """
    if len(time) < 2:
        return ""
    begin, span = float(time[0]), float(time[-1] - time[0])
    figures, data = [], []
    # What the cursor reads off: ten values a second.
    step = max(1, round(0.1 / max(span / (len(time) - 1), 1e-9)))
    for plot in plots:
        values = np.nan_to_num(np.asarray(plot.values, dtype=float).reshape(len(time), -1))
        top = _round_up(float(values.max()))
        lines = []
        for k, column in enumerate(values.T):
            kept = _envelope(column)
            x = _WIDTH * (time[kept] - begin) / span
            y = _HEIGHT * (1.0 - column[kept] / top)
            points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
            lines.append(
                f'<polyline points="{points}" stroke="{LINE_COLORS[k % len(LINE_COLORS)]}"/>'
            )
        dotted = "".join(
            f'<line class="mark" x1="{x:.1f}" x2="{x:.1f}" y2="100"/>'
            for x in (_WIDTH * (mark - begin) / span for mark in marks)
            if 0.0 < x < _WIDTH
        )
        figures.append(
            f"<figure><figcaption>{html.escape(plot.title)} <output></output></figcaption><span>{top:g}</span>"
            f'<svg viewBox="0 0 1000 100" preserveAspectRatio="none">{dotted}{"".join(lines)}'
            '<line class="cursor" y2="100"/></svg></figure>'
        )
        data.append([[float(f"{x:.3g}") for x in row] for row in values[::step]])
    period = step * span / (len(time) - 1)
    known = json.dumps(
        {"span": round(span, 6), "period": round(period, 9), "colors": LINE_COLORS, "values": data}
    )
    source = files(__package__).joinpath("time_plots.html").read_text(encoding="utf-8")
    return source.replace("<!-- figures -->", "".join(figures)).replace("/* data */", known)


def _envelope(values: Array) -> Any:
    """Return the indices of what a plot of `_BINS` columns shows of values (T,): the ends, each column's least and largest."""
    if len(values) <= 2 * _BINS:
        return np.arange(len(values))
    kept = [0, len(values) - 1]
    for part in np.array_split(np.arange(len(values)), _BINS):
        kept += [part[np.argmin(values[part])], part[np.argmax(values[part])]]
    return np.unique(kept)


def _round_up(value: float) -> float:
    """Return the next number above of the form 1, 1.5, 2, 3, 5, 7 times a power of ten."""
    if not (np.isfinite(value) and value > 1e-9):
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(
        next(m * power for m in (1, 1.5, 2, 3, 5, 7, 10) if m * power >= value * (1.0 - 1e-12))
    )
