"""Metrics of a flight, computed from its series alone, as saved in trial.npz."""

from typing import Any

import numpy as np

from drake_aerial.geometry import Array
from drake_aerial.simulation.recording import TAKE_OFF, Series

SLACK = 0.05
"""A cable is slack if its tension is below this fraction of its share of the payload's weight."""


def flight_metrics(series: Series, names: tuple[str, ...], weight: float) -> dict[str, Any]:
    """Return the metrics of a flight.

    Errors are scored over the phases circle and hover, or, without a circle, over all phases after
    the lift. Samples after a gripper lets go are left out.

    Parameters
    ----------
    series : dict of arrays
        See `recording.record`.
    names : tuple of str
        Phase names.
    weight : float
        Weight of the payload [N].

    Returns
    -------
    dict
        `*_rmse_*` is the root mean square over time of the length of the error vector, and
        `circle_position_rmse_m` that over the circle alone. Thrust and moment are per quadrotor.
        `slack_fraction` counts samples from lifting on, `saturated_fraction` from tensioning on.
        `phases` maps names to [start, end] as flown [s]. A value is None if no sample counts.
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
