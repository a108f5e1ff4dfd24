"""Inline SVG plots over time beside a replay, with a cursor that moves with the animation."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_aerial.geometry import Array
from drake_aerial.visualization.html_report import fill_template

LINE_COLORS = ("#1b62c4", "#d1432b", "#2a8f4d", "#8a5cc2", "#b8860b", "#0e8a8a")
_WIDTH, _HEIGHT, _BINS = 1000.0, 100.0, 250


@dataclass(frozen=True, eq=False)
class TimePlot:
    """One quantity over time.

    Attributes
    ----------
    title : str
        With the unit in brackets.
    values : (T, lines) array
        Not negative.
    """

    title: str
    values: Array


def svg_time_plots(time: Array, plots: Sequence[TimePlot], marks: Sequence[float] = ()) -> str:
    """Return the HTML of plots over one time axis, for a page with a Meshcat animation.

    Parameters
    ----------
    time : (T,) array
        Rising [s]; the animation starts at the first.
    plots : sequence of TimePlot
    marks : sequence of float
        Times of dotted vertical lines [s].

    Returns
    -------
    str
        Empty for fewer than two samples.
    """
    if len(time) < 2:
        return ""
    begin, span = float(time[0]), float(time[-1] - time[0])
    # The cursor shows ten values a second.
    step = max(1, round(0.1 / max(span / (len(time) - 1), 1e-9)))
    x = _WIDTH * (time - begin) / span
    drawn, read = [], []
    for plot in plots:
        values = np.nan_to_num(np.asarray(plot.values, dtype=float).reshape(len(time), -1))
        top = _round_up(float(values.max()))
        lines = [
            (_points(x, _HEIGHT * (1.0 - column / top)), LINE_COLORS[k % len(LINE_COLORS)])
            for k, column in enumerate(values.T)
        ]
        drawn.append({"title": plot.title, "top": f"{top:g}", "lines": lines})
        read.append([[float(f"{value:.3g}") for value in row] for row in values[::step]])
    data = {
        "span": round(span, 6),
        "period": round(step * span / (len(time) - 1), 9),
        "colors": LINE_COLORS,
        "values": read,
    }
    inside = [_WIDTH * (mark - begin) / span for mark in marks]
    shown = [f"{mark:.1f}" for mark in inside if 0.0 < mark < _WIDTH]
    return fill_template("svg_time_plots.html", {"plots": drawn, "marks": shown, "data": data})


def _points(x: Array, y: Array) -> str:
    """Return the SVG points of a line; it keeps the ends and each bin's extreme values."""
    kept = _envelope(y)
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x[kept], y[kept], strict=True))


def _envelope(values: Array) -> Any:
    """Return indices of values (T,): first, last, least and largest of each of `_BINS` bins."""
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
