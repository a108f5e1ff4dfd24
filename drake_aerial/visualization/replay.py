"""The replay of a flight: one self-contained HTML page, made from a trial's series."""

from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.geometry import Array, Pose
from drake_aerial.simulation.metrics import SLACK
from drake_aerial.simulation.trial_result import TrialResult
from drake_aerial.statics.gravity import GRAVITY
from drake_aerial.visualization.flight_scene import FLIGHT_LEGEND, FlightScene
from drake_aerial.visualization.meshcat_page import start_meshcat, write_meshcat_page
from drake_aerial.visualization.svg_time_plots import TimePlot, svg_time_plots

_FRAMES_PER_SECOND = 25.0


def write_replay(path: str | Path, result: TrialResult, *, title: str = "Flight") -> None:
    """Write the replay page: an animation of the flight with plots beside it.

    Quadrotors, cables, payload and contacts move; the paths are drawn. A slack cable is bowed and
    orange; a cable whose gripper has let go is not drawn. The plots (position error, tension,
    tilt) have a cursor that moves with the flight; dragging it moves the flight.

    Parameters
    ----------
    path : str or Path
        The page; it appears when it is complete.
    result : TrialResult
    title : str
        Title of the page.

    Raises
    ------
    InputError
        If the page cannot be written.
    """
    meshcat = start_meshcat()
    record_flight(meshcat, result)
    times = (
        f"{name} {start:.2f} to {end:.2f} s"
        for name, (start, end) in result.metrics["phases"].items()
    )
    write_meshcat_page(
        path,
        meshcat,
        title=title,
        legend=FLIGHT_LEGEND,
        text="\n".join([result.summary(), "", *times]),
        overlay=_plots(result),
    )


def record_flight(meshcat: Any, result: TrialResult) -> None:
    """Put a flight into a Meshcat as an animation that repeats."""
    series = result.series
    scene = FlightScene(meshcat, result.vertices, result.faces, result.p_LC, result.cable_length)
    time = series["time"]
    if not len(time):
        return
    p_WL, p_WR = series["payload_position"], series["reference_position"]
    scene.draw_flown(p_WL)
    scene.draw_reference(p_WR)
    low = np.minimum(p_WL.min(axis=0), p_WR.min(axis=0))
    high = np.maximum(series["quadrotor_position"].max(axis=(0, 1)), p_WR.max(axis=0))
    scene.look_at(low, high)
    tension = series["tension"]
    mass = result.metrics["configuration"]["payload"]["mass"]
    slack = tension < SLACK * GRAVITY * mass / tension.shape[1]
    attached = series.get("attached", np.ones_like(tension, dtype=bool))
    meshcat.StartRecording(
        frames_per_second=_FRAMES_PER_SECOND, set_visualizations_while_recording=False
    )
    meshcat.get_mutable_recording().set_repetitions(100_000)
    frames = _frames(time)
    for frame, k in enumerate(frames):
        scene.move(
            Pose(p_WL[k], series["payload_quaternion"][k]),
            p_WR[k],
            Pose(series["quadrotor_position"][k], series["quadrotor_quaternion"][k]),
            series["contact_position"][k],
            slack[k],
            attached[k],
            t=frame / _FRAMES_PER_SECOND,
            # The clip of each part ends at its last key: all parts have keys at both ends.
            all_parts=frame in (0, len(frames) - 1),
        )
    meshcat.StopRecording()
    meshcat.PublishRecording()


def _frames(time: Array) -> Array:
    """Return the indices of the samples that are shown."""
    frames = np.searchsorted(
        time, np.arange(time[0], time[-1] + 1e-9, 1.0 / _FRAMES_PER_SECOND) - 1e-9
    )
    return np.minimum(frames, len(time) - 1)


def _plots(result: TrialResult) -> str:
    series = result.series
    error = 100.0 * np.linalg.norm(
        series["payload_position"] - series["reference_position"], axis=1
    )
    n = series["tension"].shape[1]
    plots = [
        TimePlot("position error [cm]", error[:, None]),
        TimePlot(
            "cable tension [N]" if n == 1 else f"tension of cables 1 to {n} [N]",
            np.maximum(series["tension"], 0.0),
        ),
        TimePlot("payload tilt [deg]", np.rad2deg(series["tilt"])[:, None]),
    ]
    starts = [start for start, _ in result.metrics["phases"].values()]
    return svg_time_plots(series["time"], plots, starts)
