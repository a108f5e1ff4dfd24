"""The numbers of a flight, from its series alone: whoever has trial.npz can compute them again."""

from __future__ import annotations

from typing import Any

import numpy as np

from drake_aerial.geometry import Array
from drake_aerial.simulation.recording import TAKE_OFF, Series

SLACK = 0.05
"""A cable counts as slack below this part of its share of the payload's weight."""


def flight_metrics(series: Series, names: tuple[str, ...], weight: float) -> dict[str, Any]:
    """Return the metrics of a flight; errors are scored over circle and hover, or over all that follows the lift if there is no circle.

    Parameters
    ----------
    series : dict of arrays
        See `recording.record`.
    names : tuple of str
        Of the phases.
    weight : float
        Of the payload [N].

    Returns
    -------
    dict
        `*_rmse_*`: root of the mean over time of the squared length of the error vector; `circle_position_rmse_m` over the circle alone;
        all of them up to the moment a gripper lets go; thrust and moment per quadrotor, tension of samples every 10 ms; `slack_fraction` and `saturated_fraction` of all samples from tensioning on;
        `phases`: name to [start, end] as flown [s]. None where nothing was flown that could be scored.
    """
    phase, time = series["phase"], series["time"]
    scored_names = (
        [n for n in ("circle", "hover") if n in names]
        if "circle" in names
        else list(names[len(TAKE_OFF) :])
    )
    whole = (
        series["attached"].all(axis=1) if "attached" in series else np.ones(len(phase), dtype=bool)
    )
    scored = whole & np.isin(phase, [names.index(n) for n in scored_names])
    carried = whole & (phase >= 1)
    flying = whole & (phase > 1)
    error = np.linalg.norm(series["payload_position"] - series["reference_position"], axis=1)
    velocity = np.linalg.norm(series["payload_velocity"] - series["reference_velocity"], axis=1)
    moment = np.linalg.norm(series["moment"], axis=2)
    share = weight / series["tension"].shape[1]
    circle = (
        whole & (phase == names.index("circle"))
        if "circle" in names
        else np.zeros(len(phase), dtype=bool)
    )
    return {
        "position_rmse_m": _rms(error[scored]),
        "position_max_m": _max(error[scored]),
        "circle_position_rmse_m": _rms(error[circle]),
        "velocity_rmse_m_s": _rms(velocity[scored]),
        "attitude_rmse_rad": _rms(series["attitude_error"][scored]),
        "tilt_mean_rad": _mean(series["tilt"][scored]),
        "tilt_max_rad": _max(series["tilt"][scored]),
        "thrust_mean_N": _mean(series["thrust"][scored]),
        "thrust_max_N": _max(series["thrust"][carried]),
        "moment_rms_N_m": _rms(moment[scored]),
        "slack_fraction": _mean(series["tension"][flying] < SLACK * share),
        "saturated_fraction": _mean(series["saturated"][carried]),
        "tension_max_N": _max(series["tension"][carried]),
        "phases": {
            name: [float(time[phase == k][0]), float(time[phase == k][-1])]
            for k, name in enumerate(names)
            if (phase == k).any()
        },
    }


def _rms(values: Array) -> float | None:
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else None


def _mean(values: Array) -> float | None:
    return float(np.mean(values)) if values.size else None


def _max(values: Array) -> float | None:
    return float(np.max(values)) if values.size else None
