"""The replay of a flight: one self-contained HTML page, made from a trial's series alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from drake_aerial.geometry import Array, Pose
from drake_aerial.io.files import write_text
from drake_aerial.simulation.metrics import SLACK
from drake_aerial.statics.gravity import GRAVITY
from drake_aerial.visualization.flight_scene import FLIGHT_LEGEND, FlightScene
from drake_aerial.visualization.pages import add_card, card, quiet_meshcat
from drake_aerial.visualization.time_plots import TimePlot, time_plots

if TYPE_CHECKING:
    from drake_aerial.simulation.trial_result import TrialResult

_FRAMES_PER_SECOND = 25.0


def write_replay(path: str | Path, result: TrialResult, *, title: str = "Flight") -> None:
    """Write the replay page: quadrotors, cables, payload and contacts move; the paths are drawn, plots stand beside it.

    A slack cable is bowed and orange; a cable whose gripper has let go is not drawn. The plots (position error, tension, tilt) have
    a cursor that moves with the flight; dragging it moves the flight.

    Parameters
    ----------
    path : str or Path
        The page; it is put in place when it is whole.
    result : TrialResult
        The flight.
    title : str
        Of the page.

    Raises
    ------
    InputError
        If the page cannot be written.
    """
    meshcat = quiet_meshcat()
    record_flight(meshcat, result)
    page = meshcat.StaticHtml()
    times = (
        f"{name} {start:.2f} to {end:.2f} s"
        for name, (start, end) in result.metrics["phases"].items()
    )
    text = "\n".join([result.summary(), "", *times])
    write_text(path, add_card(page, card(title, FLIGHT_LEGEND, text) + _plots(result), title))


def record_flight(meshcat: object, result: TrialResult) -> FlightScene:
    """Put a flight into a Meshcat as an animation at a film's rate, which is played over and over."""
    series = result.series
    scene = FlightScene(meshcat, result.vertices, result.faces, result.p_LC, result.cable_length)
    if not len(series["time"]):
        return scene
    scene.draw_flown(series["payload_position"])
    scene.draw_reference(series["reference_position"])
    low = np.minimum(
        series["payload_position"].min(axis=0), series["reference_position"].min(axis=0)
    )
    high = np.maximum(
        series["quadrotor_position"].max(axis=(0, 1)), series["reference_position"].max(axis=0)
    )
    scene.look_at(low, high)
    slack, attached = (
        _slack(result),
        series.get("attached", np.ones_like(series["tension"], dtype=bool)),
    )
    frames = _frames(series["time"])
    scene.meshcat.StartRecording(
        frames_per_second=_FRAMES_PER_SECOND, set_visualizations_while_recording=False
    )
    scene.meshcat.get_mutable_recording().set_repetitions(100_000)
    for frame, k in enumerate(frames):
        scene.move(
            Pose(series["payload_position"][k], series["payload_quaternion"][k]),
            series["reference_position"][k],
            Pose(series["quadrotor_position"][k], series["quadrotor_quaternion"][k]),
            series["contact_position"][k],
            slack[k],
            attached[k],
            t=frame / _FRAMES_PER_SECOND,
            # Each part's clip is as long as its last key says: all parts have keys at both ends.
            all_parts=frame in (0, len(frames) - 1),
        )
    scene.meshcat.StopRecording()
    scene.meshcat.PublishRecording()
    return scene


def _frames(time: Array) -> Array:
    """Return which samples are shown, at the film's rate."""
    frames = np.searchsorted(
        time, np.arange(time[0], time[-1] + 1e-9, 1.0 / _FRAMES_PER_SECOND) - 1e-9
    )
    return np.minimum(frames, len(time) - 1)


def _slack(result: TrialResult) -> Array:
    """Return which cables (T, n) are slack, as the metrics count it: far below their share of the payload's weight."""
    tension = result.series["tension"]
    mass = result.metrics["configuration"]["payload"]["mass"]
    return tension < SLACK * GRAVITY * mass / tension.shape[1]


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
    return time_plots(
        series["time"], plots, [start for start, _ in result.metrics["phases"].values()]
    )
