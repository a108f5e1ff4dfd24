"""Plots over time of one flight or of several flights side by side."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.simulation.trial_result import TrialResult
from drake_aerial.visualization.matplotlib_figure import figure, save_figure

COLORS = ("#1b62c4", "#d1432b", "#2a8f4d", "#8a5cc2")


def plot_flights(flights: Mapping[str, TrialResult], path: str | Path) -> None:
    """Draw path, position error, tilt, thrust, moment and tension of flights, side by side.

    Parameters
    ----------
    flights : mapping of label to TrialResult
        In the order of the legend.
    path : str or Path
        The figure to write (.png, .pdf or .svg).
    """
    drawing, axes = figure(12.5, 6.4, 2, 3)
    ((above, error, tilt), (thrust, moment, tension)) = axes
    for index, (label, flight) in enumerate(flights.items()):
        series, color = flight.series, COLORS[index % len(COLORS)]
        time = series["time"]
        p_WR, p_WL = series["reference_position"], series["payload_position"]
        if index == 0:
            above.plot(p_WR[:, 0], p_WR[:, 1], color="0.6", lw=4, alpha=0.6, label="reference")
        above.plot(p_WL[:, 0], p_WL[:, 1], color=color, lw=1.2, label=label)
        distance = 100 * np.linalg.norm(p_WL - p_WR, axis=1)
        error.plot(time, distance, color=color, lw=1, label=label)
        tilt.plot(time, np.rad2deg(series["tilt"]), color=color, lw=1)
        thrust.plot(time, series["thrust"].sum(axis=1), color=color, lw=0.8)
        mean_moment = np.linalg.norm(series["moment"], axis=2).mean(axis=1)
        moment.plot(time, 1e3 * mean_moment, color=color, lw=0.8)
        tension.plot(time, series["tension"].sum(axis=1), color=color, lw=0.8)
    above.set(title="payload from above", xlabel="x [m]", ylabel="y [m]", aspect="equal")
    error.legend(*above.get_legend_handles_labels(), fontsize=8)
    error.set(title="distance from the reference", ylabel="[cm]")
    tilt.set(title="payload tilt", ylabel="[deg]")
    thrust.set(title="thrust, sum over quadrotors", ylabel="[N]")
    moment.set(title="moment, mean over quadrotors", ylabel="[mN m]")
    tension.set(title="cable tension, sum over cables", ylabel="[N]")
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
