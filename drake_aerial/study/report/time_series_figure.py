"""Figure of errors, thrust, moment and tilt over time: mean and deviation of each method."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.study.analysis.quantities import DEGREES
from drake_aerial.study.analysis.timeline import PANELS, Timeline
from drake_aerial.study.report.method_styles import METHOD_LINES, method_color
from drake_aerial.visualization.matplotlib_figure import figure, save_png_and_pdf

_TITLES = {
    "position_error": ("distance from the path", "cm", 100.0),
    "velocity_error": ("velocity error", "cm/s", 100.0),
    "attitude_error": ("attitude error", "deg", DEGREES),
    "thrust": ("thrust per quadrotor", "N", 1.0),
    "moment": ("moment per quadrotor", "mN m", 1000.0),
    "tilt": ("tilt of the payload", "deg", DEGREES),
}
_BAND_FLIGHTS = 2
"""Smallest number of flights with a band."""


def draw_time_series(stem: Path, timelines: Mapping[str, Timeline]) -> Path | None:
    """Write the six panels of one condition, belief and inertia.

    Failed flights are part of the mean until they end.

    Parameters
    ----------
    stem : Path
        Path of the files without their endings.
    timelines : mapping of method to Timeline
        In the order of the legend.

    Returns
    -------
    Path or None
        The PNG; None if there are no series.
    """
    shown = {method: timeline for method, timeline in timelines.items() if len(timeline.time)}
    if not shown:
        return None
    drawing, axes = figure(11.5, 5.6, 2, 3, sharex=True)
    for panel, name in zip(axes.flat, PANELS):
        title, unit, factor = _TITLES[name]
        tops = [_draw(panel, method, timeline, name, factor) for method, timeline in shown.items()]
        panel.set_title(title, fontsize=11)
        panel.set_ylabel(f"[{unit}]")
        panel.grid(alpha=0.25)
        _limit(panel, name, tops)
        _phases(panel, next(iter(shown.values())))
    for panel in axes[-1]:
        panel.set_xlabel("time from the circle's start [s]")
    for panel in axes.flat:
        low, high = min(t.time[0] for t in shown.values()), max(t.time[-1] for t in shown.values())
        panel.set_xlim(low, high)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    drawing.legend(
        handles, labels, loc="outside upper center", ncols=len(labels), frameon=False, fontsize=11
    )
    return save_png_and_pdf(drawing, stem, dpi=110)


def _draw(panel: Any, method: str, timeline: Timeline, name: str, factor: float) -> float:
    """Draw one method in one panel; return the top of its band, without extreme values."""
    values = factor * timeline.values[name]
    count = np.isfinite(values).sum(axis=0)
    there = count > 0
    total = np.where(np.isfinite(values), values, 0.0)
    mean = total.sum(axis=0) / np.maximum(count, 1)
    square = np.where(np.isfinite(values), (values - mean) ** 2, 0.0).sum(axis=0)
    std = np.sqrt(square / np.maximum(count - 1, 1))
    color = method_color(method)
    flights = len(values)
    broken = int(flights - timeline.completed.sum())
    label = (
        f"{method} ({flights} flight{'s' * (flights != 1)}{f', {broken} failed' if broken else ''})"
    )
    panel.plot(
        timeline.time[there],
        mean[there],
        color=color,
        ls=METHOD_LINES.get(method, "-"),
        lw=1.6,
        label=label,
        zorder=3,
    )
    banded = there & (count >= _BAND_FLIGHTS)
    panel.fill_between(
        timeline.time,
        (mean - std).clip(min=0.0),
        mean + std,
        where=banded,
        color=color,
        alpha=0.16,
        lw=0,
        zorder=2,
    )
    # A cross at the end of a failed flight.
    for flight in values[~timeline.completed]:
        last = np.flatnonzero(np.isfinite(flight))
        if len(last):
            panel.plot(
                timeline.time[last[-1]],
                mean[last[-1]],
                color=color,
                marker="x",
                ms=7,
                mew=1.8,
                zorder=4,
            )
    scored = there & (timeline.time > 0.2)
    # The quantile leaves out a flight out of control, which would hide all others.
    return float(np.quantile((mean + std)[scored], 0.97)) if scored.any() else 0.0


def _limit(panel: Any, name: str, tops: list[float]) -> None:
    """Scale a panel to the scored time; peaks during the lift may be cut off."""
    if name == "thrust":
        return
    panel.set_ylim(0.0, 1.15 * max(tops) if max(tops) > 0 else None)


def _phases(panel: Any, timeline: Timeline) -> None:
    for name, (start, end) in timeline.phases.items():
        if name in ("ground", "tensioning"):
            continue
        panel.axvline(start, color="0.6", lw=0.8, ls=":", zorder=1)
        middle = 0.5 * (max(start, timeline.time[0]) + end)
        panel.text(
            middle,
            0.99,
            name,
            transform=panel.get_xaxis_transform(),
            ha="center",
            va="top",
            fontsize=7,
            color="0.4",
        )
