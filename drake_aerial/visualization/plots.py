"""Plots over time of one flight or of several flights side by side."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_aerial.io.files import replacing

if TYPE_CHECKING:
    from drake_aerial.simulation.trial import TrialResult

COLORS = ("#1b62c4", "#d1432b", "#2a8f4d", "#8a5cc2")


def figure(
    width: float, height: float, rows: int = 1, columns: int = 1, **options: Any
) -> tuple[Any, Any]:
    """Return a Matplotlib figure [inches] and its axes, without touching the global pyplot state."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    drawing = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(drawing)
    return drawing, drawing.subplots(rows, columns, squeeze=False, **options)


def save_figure(drawing: Any, path: str | Path, dpi: int = 130) -> None:
    """Write a figure as PNG, PDF or SVG by its name's ending, whole or not at all."""
    path = Path(path)
    # Without these entries the same figure gives the same bytes.
    metadata = {"pdf": {"CreationDate": None}, "png": {"Software": None}, "svg": {"Date": None}}
    kind = path.suffix.lstrip(".").lower()
    with replacing(path) as temporary:
        drawing.savefig(temporary, dpi=dpi, format=kind, metadata=metadata.get(kind))


def plot_flights(flights: Mapping[str, TrialResult], path: str | Path) -> None:
    """Draw flights side by side: the path from above, position error, tilt, thrust, moments, cable tension.

    Parameters
    ----------
    flights : mapping of label to TrialResult
        Flights to compare, in the order of the legend.
    path : str or Path
        The figure to write (.png, .pdf or .svg).
    """
    drawing, axes = figure(12.5, 6.4, 2, 3)
    ((above, error, tilt), (thrust, moment, tension)) = axes
    for index, (label, flight) in enumerate(flights.items()):
        series, color = flight.series, COLORS[index % len(COLORS)]
        time = series["time"]
        reference, position = series["reference_position"], series["payload_position"]
        if index == 0:
            above.plot(
                reference[:, 0], reference[:, 1], color="0.6", lw=4, alpha=0.6, label="reference"
            )
        above.plot(position[:, 0], position[:, 1], color=color, lw=1.2, label=label)
        error.plot(
            time, 100 * np.linalg.norm(position - reference, axis=1), color=color, lw=1, label=label
        )
        tilt.plot(time, np.rad2deg(series["tilt"]), color=color, lw=1)
        thrust.plot(time, series["thrust"].sum(axis=1), color=color, lw=0.8)
        moment.plot(
            time, 1e3 * np.linalg.norm(series["moment"], axis=2).mean(axis=1), color=color, lw=0.8
        )
        tension.plot(time, series["tension"].sum(axis=1), color=color, lw=0.8)
    above.set(title="payload from above", xlabel="x [m]", ylabel="y [m]", aspect="equal")
    handles, labels = above.get_legend_handles_labels()
    error.legend(handles, labels, fontsize=8)
    error.set(title="distance from the reference", ylabel="[cm]")
    tilt.set(title="payload tilt", ylabel="[deg]")
    thrust.set(title="thrust of all quadrotors", ylabel="[N]")
    moment.set(title="moment, mean over quadrotors", ylabel="[mN m]")
    tension.set(title="cable tension, sum", ylabel="[N]")
    first = next(iter(flights.values()))
    for panel in (error, tilt, thrust, moment, tension):
        panel.set_xlabel("time [s]")
        panel.grid(alpha=0.25)
        panel.set_ylim(bottom=0)
        _mark_phases(panel, first.series)
    save_figure(drawing, path)


def _mark_phases(panel: Any, series: Mapping[str, np.ndarray]) -> None:
    starts = np.flatnonzero(np.diff(series["phase"], prepend=-1))
    for start in starts[1:]:
        panel.axvline(series["time"][start], color="0.75", lw=0.7, ls=":", zorder=0)
