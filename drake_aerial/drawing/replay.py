"""The replay of a flight: one self-contained HTML page, made from a trial's series alone."""

from __future__ import annotations

import logging
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import brentq

from drake_aerial.drawing.pages import add_card, card
from drake_aerial.drawing.picture import BLACK, BLUE, GREEN, RED, Color, Picture
from drake_aerial.drawing.rendering import write_gltf
from drake_aerial.files import write_text
from drake_aerial.geometry import Array, Pose, perpendicular, quat_from_xz
from drake_aerial.plant.quadrotor import QuadrotorParameters, visual_parts

if TYPE_CHECKING:
    from drake_aerial.transport.trial_result import TrialResult

CARDBOARD: Color = (0.80, 0.64, 0.44)
_SEGMENTS = 12
_FRAMES_PER_SECOND = 25.0


def write_replay(path: str | Path, result: TrialResult, *, title: str = "Flight") -> None:
    """Write the replay page: quadrotors, cables (bowed while slack), payload and contacts move; the paths are drawn.

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
    from pydrake.geometry import Meshcat, MeshcatParams

    # Drake logs the address of a server that nobody is going to visit.
    log = logging.getLogger("drake")
    level = log.level
    log.setLevel(logging.WARNING)
    try:
        meshcat = Meshcat(MeshcatParams(show_stats_plot=False))
    finally:
        log.setLevel(level)
    try:
        _set_scene(meshcat, result)
        _record(meshcat, result)
        page = meshcat.StaticHtml()
    finally:
        meshcat.Delete()
    legend = [
        (GREEN, "reference path, and the reference now"),
        (BLUE, "path flown by the payload's tracked point"),
        (RED, "contact"),
        (CARDBOARD, "payload"),
        (BLACK, "quadrotor and cable"),
    ]
    times = (f"{name} {start:.2f} to {end:.2f} s" for name, (start, end) in result.metrics["phases"].items())
    text = "\n".join([result.summary(), "", *times])
    write_text(path, add_card(page, card(title, legend, text), title))


def _set_scene(meshcat: Any, result: TrialResult) -> None:
    """Put in what is seen: static paths, and the parts that move, each in its own frame."""
    from pydrake.geometry import Cylinder, Rgba, Sphere

    series = result.series
    paths = Picture()
    flown, reference = (_simplified(series[f"{name}_position"], 0.03) for name in ("payload", "reference"))
    if len(flown) > 1:
        paths.add_tube(flown, color=BLUE, radius=0.006)
    # Dashes, wider than the flown path: both are seen where they coincide.
    for dash in _dashes(reference):
        paths.add_tube(dash, color=GREEN, radius=0.012)
    body = Picture()
    body.add_mesh(result.vertices, result.faces, color=CARDBOARD)
    for p in result.p_LC:
        body.add_sphere(p, color=RED, radius=0.024)
    body.add_frame(Pose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])), length=0.15, radius=0.004)
    for name, picture in (("paths", paths), ("payload", body)):
        if len(picture.vertices):
            _set_picture(meshcat, name, picture)
    meshcat.SetObject("reference", Sphere(0.030), Rgba(*GREEN, 1.0))
    parts = visual_parts(QuadrotorParameters())
    for i, length in enumerate(result.cable_length):
        for k, (X, shape, rgba) in enumerate(parts):
            meshcat.SetObject(f"quadrotor{i}/{k}", shape, Rgba(*rgba))
            meshcat.SetTransform(f"quadrotor{i}/{k}", X)
        for k in range(_SEGMENTS):
            # A little longer than its share, so that the bends are closed.
            link = Cylinder(0.005, 1.02 * float(length) / _SEGMENTS)
            meshcat.SetObject(f"cable{i}/{k}", link, Rgba(0.08, 0.08, 0.10, 1.0))
    meshcat.SetProperty("/Background", "top_color", [0.93, 0.96, 1.0])
    meshcat.SetProperty("/Background", "bottom_color", [0.99, 0.99, 0.99])
    meshcat.SetProperty("/Axes", "visible", False)
    low = np.minimum(series["payload_position"].min(axis=0), series["reference_position"].min(axis=0))
    high = np.maximum(series["quadrotor_position"].max(axis=(0, 1)), series["reference_position"].max(axis=0))
    center, size = 0.5 * (low + high), float(np.linalg.norm(high - low)) + 0.2
    meshcat.SetCameraPose(center + size * np.array([0.36, -0.58, 0.30]), center)


def _set_picture(meshcat: Any, name: str, picture: Picture) -> None:
    from pydrake.geometry import Mesh

    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / f"{name}.gltf"
        write_gltf(picture, model)
        meshcat.SetObject(name, Mesh(str(model)))


def _record(meshcat: Any, result: TrialResult) -> None:
    """Record the motion at a film's rate; the page plays it over and over."""
    series = result.series
    time = series["time"]
    if not len(time):
        return
    frames = np.searchsorted(time, np.arange(time[0], time[-1] + 1e-9, 1.0 / _FRAMES_PER_SECOND) - 1e-9)
    meshcat.StartRecording(frames_per_second=_FRAMES_PER_SECOND, set_visualizations_while_recording=False)
    for frame, k in enumerate(np.minimum(frames, len(time) - 1)):
        t = frame / _FRAMES_PER_SECOND
        _move(meshcat, "payload", series["payload_position"][k], series["payload_quaternion"][k], t)
        _move(meshcat, "reference", series["reference_position"][k], np.array([1.0, 0.0, 0.0, 0.0]), t)
        for i, length in enumerate(result.cable_length):
            p_WQ = series["quadrotor_position"][k, i]
            _move(meshcat, f"quadrotor{i}", p_WQ, series["quadrotor_quaternion"][k, i], t)
            links = cable_points(p_WQ, series["contact_position"][k, i], float(length), _SEGMENTS)
            along = np.diff(links, axis=0)
            along /= np.linalg.norm(along, axis=1, keepdims=True)
            attitude = quat_from_xz(perpendicular(along), along)
            for j, (middle, q) in enumerate(zip(0.5 * (links[1:] + links[:-1]), attitude, strict=True)):
                _move(meshcat, f"cable{i}/{j}", middle, q, t)
    meshcat.StopRecording()
    meshcat.PublishRecording()


def _move(meshcat: Any, name: str, p: Array, q: Array, t: float) -> None:
    from pydrake.common.eigen_geometry import Quaternion
    from pydrake.math import RigidTransform

    meshcat.SetTransform(name, RigidTransform(Quaternion(q / np.linalg.norm(q)), p), time_in_recording=t)


def cable_points(start: Array, end: Array, length: float, segments: int) -> Array:
    """Return points (segments + 1, 3) along a cable as it is drawn, equally spaced.

    A taut cable is straight. A slack one is a circular arc of its length that bows downwards, or sideways where its ends are above
    one another. One that no longer reaches its contact hangs down from `start`.

    Parameters
    ----------
    start, end : (3,) arrays
        The quadrotor and the contact [m].
    length : float
        [m]
    segments : int
        Number of straight pieces.
    """
    chord = end - start
    distance = float(np.linalg.norm(chord))
    if distance > 1.02 * length or distance < 1e-6:
        chord, distance = np.array([0.0, 0.0, -length]), length
    axis = chord / distance
    part = np.linspace(0.0, 1.0, segments + 1)
    if distance > 0.9995 * length:
        return start + part[:, None] * chord
    # Half the arc's angle phi from sin(phi)/phi = d/l.
    phi = brentq(lambda x: np.sinc(x / np.pi) - distance / length, 1e-6, np.pi)
    bow = np.array([0.0, 0.0, -1.0]) + axis[2] * axis
    size = float(np.linalg.norm(bow))
    bow = bow / size if size > 0.2 else perpendicular(axis)
    radius = length / (2.0 * phi)
    angle = phi * (2.0 * part - 1.0)
    return (
        start
        + 0.5 * chord
        + radius * np.sin(angle)[:, None] * axis
        + radius * (np.cos(angle) - np.cos(phi))[:, None] * bow
    )


def _simplified(points: Array, spacing: float) -> Array:
    """Return the points (N, 3) of a path that are at least `spacing` [m] apart, and the last."""
    kept = [0] if len(points) else []
    for k in range(len(points)):
        if np.linalg.norm(points[k] - points[kept[-1]]) >= spacing:
            kept.append(k)
    if len(points) and kept[-1] != len(points) - 1:
        kept.append(len(points) - 1)
    return points[kept]


def _dashes(points: Array) -> list[Array]:
    """Return every other piece of a path (N, 3), those left out that a second lap would put between earlier ones."""
    dashes: list[Array] = []
    middles: list[Array] = []
    for k in range(0, len(points) - 2, 4):
        middle = points[k + 1]
        if not middles or np.linalg.norm(np.array(middles) - middle, axis=1).min() > 0.1:
            middles.append(middle)
            dashes.append(points[k : k + 3])
    return dashes
