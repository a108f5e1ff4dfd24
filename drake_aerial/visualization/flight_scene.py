"""The moving parts of a flight in a Meshcat: payload, quadrotors, cables and the reference."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import Cylinder, Rgba, Sphere
from pydrake.math import RigidTransform
from scipy.optimize import brentq

from drake_aerial.geometry import Array, Pose, identity, perpendicular, quat_from_xz
from drake_aerial.plant.quadrotor import QuadrotorParameters, visual_parts
from drake_aerial.visualization.colored_mesh import ColoredMesh
from drake_aerial.visualization.colors import BLACK, BLUE, GREEN, ORANGE, RED, Color
from drake_aerial.visualization.meshcat_page import set_mesh, soften_lights

CARDBOARD: Color = (0.80, 0.64, 0.44)
FLIGHT_LEGEND: list[tuple[Color, str]] = [
    (GREEN, "reference path and current reference"),
    (BLUE, "path of the payload's tracked point"),
    (RED, "contact"),
    (CARDBOARD, "payload"),
    (BLACK, "quadrotor and taut cable"),
    (ORANGE, "slack cable"),
]
_SEGMENTS = 12
_UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


class FlightScene:
    """The moving parts of a flight in a Meshcat.

    A taut cable is straight and black, a slack one bowed and orange; the cable of a gripper that
    has let go is not drawn.

    Parameters
    ----------
    meshcat : pydrake.geometry.Meshcat
    vertices, faces : (V, 3) array [m], (F, 3) int array
        The payload's surface in its tracked frame L.
    p_LC : (n, 3) array
        Contacts in L [m].
    cable_length : (n,) array
        [m]
    """

    def __init__(
        self, meshcat: Any, vertices: Array, faces: Array, p_LC: ArrayLike, cable_length: ArrayLike
    ):
        self.meshcat = meshcat
        self._length = [
            float(length) for length in np.atleast_1d(np.asarray(cable_length, dtype=float))
        ]
        self._shown: dict[str, bool] = {}
        self._links = 0
        body = ColoredMesh()
        body.add_mesh(vertices, faces, color=CARDBOARD)
        for p in np.asarray(p_LC, dtype=float).reshape(-1, 3):
            body.add_sphere(p, color=RED, radius=0.024)
        body.add_frame(identity(), length=0.15, radius=0.004)
        set_mesh(meshcat, "payload", body)
        meshcat.SetObject("reference", Sphere(0.030), Rgba(*GREEN, 1.0))
        parts = visual_parts(QuadrotorParameters())
        for i, length in enumerate(self._length):
            for k, (X, shape, rgba) in enumerate(parts):
                meshcat.SetObject(f"quadrotor{i}/{k}", shape, Rgba(*rgba))
                meshcat.SetTransform(f"quadrotor{i}/{k}", X)
            meshcat.SetObject(f"taut{i}", Cylinder(0.005, length), Rgba(*BLACK, 1.0))
            for k in range(_SEGMENTS):
                # Longer by 2 %, so that the bends have no gaps.
                link = Cylinder(0.007, 1.02 * length / _SEGMENTS)
                meshcat.SetObject(f"slack{i}/{k}", link, Rgba(*ORANGE, 1.0))
        meshcat.SetProperty("/Background/<object>", "top_color", [0.93, 0.96, 1.0])
        meshcat.SetProperty("/Background/<object>", "bottom_color", [0.99, 0.99, 0.99])
        meshcat.SetProperty("/Axes", "visible", False)
        meshcat.SetProperty("/Grid", "visible", False)
        soften_lights(meshcat)

    def look_at(self, low: Array, high: Array) -> None:
        """Look at a box between two corners (3,) [m], above a ground grid of 0.5 m squares."""
        begin, end = np.floor(2.0 * low[:2] - 0.5) / 2.0, np.ceil(2.0 * high[:2] + 0.5) / 2.0
        ground = ColoredMesh()
        for axis in (0, 1):
            for at in np.arange(begin[axis], end[axis] + 0.25, 0.5):
                line = np.array([[*begin, 0.0], [*end, 0.0]])
                line[:, axis] = at
                ground.add_tube(line, color=(0.72, 0.75, 0.79), radius=0.003)
        set_mesh(self.meshcat, "ground", ground)
        center, size = 0.5 * (low + high), float(np.linalg.norm(high - low)) + 0.2
        self.meshcat.SetCameraPose(center + size * np.array([0.27, -0.43, 0.25]), center)

    def draw_reference(self, points: Array) -> None:
        """Draw the reference path (N, 3) [m] in dashes, wider than the flown path."""
        mesh = ColoredMesh()
        for dash in _dashes(simplified(points, 0.03)):
            mesh.add_tube(dash, color=GREEN, radius=0.012)
        set_mesh(self.meshcat, "reference_path", mesh)

    def draw_flown(self, points: Array) -> None:
        """Draw the flown path (N, 3) [m]."""
        mesh = ColoredMesh()
        mesh.add_tube(simplified(points, 0.03), color=BLUE, radius=0.006)
        set_mesh(self.meshcat, "flown_path", mesh)

    def extend_flown(self, start: Array, end: Array) -> None:
        """Add a piece between two points (3,) [m] to the flown path."""
        along = end - start
        length = float(np.linalg.norm(along))
        name = f"flown_path/{self._links}"
        self._links += 1
        self.meshcat.SetObject(name, Cylinder(0.006, length), Rgba(*BLUE, 1.0))
        self._place(name, 0.5 * (start + end), _along(along / length), None)

    def move(
        self,
        payload: Pose,
        p_WR: Array,
        quadrotors: Pose,
        p_WC: Array,
        slack: Any,
        attached: Any,
        *,
        t: float | None = None,
        all_parts: bool = False,
    ) -> None:
        """Place all parts.

        Parameters
        ----------
        payload : Pose
            X_WL.
        p_WR : (3,) array
            Reference position [m].
        quadrotors : Pose
            X_WQ, batch (n,).
        p_WC : (n, 3) array
            Contacts on the payload [m].
        slack, attached : (n,) bool arrays
            State of each cable and gripper.
        t : float, optional
            Time in the recording [s]; without it, the scene moves now.
        all_parts : bool
            Place hidden parts too, as at the first and last time of a recording.
        """
        self._place("payload", payload.p, payload.q, t)
        self._place("reference", p_WR, _UPRIGHT, t)
        for i, length in enumerate(self._length):
            p_WQ = quadrotors.p[i]
            self._place(f"quadrotor{i}", p_WQ, quadrotors.q[i], t)
            holds, loose = bool(attached[i]), bool(slack[i])
            self._show(f"taut{i}", holds and not loose, t)
            self._show(f"slack{i}", holds and loose, t)
            if all_parts or (holds and not loose):
                chord = p_WC[i] - p_WQ
                distance = max(float(np.linalg.norm(chord)), 1e-9)
                self._place(f"taut{i}", p_WQ + 0.5 * chord, _along(chord / distance), t)
            if all_parts or (holds and loose):
                links = cable_points(p_WQ, p_WC[i], length, _SEGMENTS)
                along = np.diff(links, axis=0)
                attitude = _along(along / np.linalg.norm(along, axis=1, keepdims=True))
                for k, (middle, q) in enumerate(
                    zip(0.5 * (links[1:] + links[:-1]), attitude, strict=True)
                ):
                    self._place(f"slack{i}/{k}", middle, q, t)

    def _place(self, name: str, p: Array, q: Array, t: float | None) -> None:
        self.meshcat.SetTransform(
            name, RigidTransform(Quaternion(q / np.linalg.norm(q)), p), time_in_recording=t
        )

    def _show(self, name: str, visible: bool, t: float | None) -> None:
        if self._shown.get(name) != visible or t is not None:
            self._shown[name] = visible
            self.meshcat.SetProperty(name, "visible", visible, time_in_recording=t)


def cable_points(start: Array, end: Array, length: float, segments: int) -> Array:
    """Return equally spaced points (segments + 1, 3) along a cable as it is drawn.

    A taut cable is straight. A slack one is a circular arc of its length that bows downwards, or
    sideways if its ends are above one another. A cable too short to reach hangs down from `start`.

    Parameters
    ----------
    start, end : (3,) arrays
        Positions of the quadrotor and the contact [m].
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


def simplified(points: Array, spacing: float) -> Array:
    """Return the points (N, 3) of a path that are `spacing` [m] or more apart, and the last."""
    kept = [0] if len(points) else []
    for k in range(len(points)):
        if np.linalg.norm(points[k] - points[kept[-1]]) >= spacing:
            kept.append(k)
    if len(points) and kept[-1] != len(points) - 1:
        kept.append(len(points) - 1)
    return points[kept]


def _dashes(points: Array) -> list[Array]:
    """Return every other piece of a path (N, 3), without those within 0.1 m of earlier ones.

    The dashes of a second lap would fill the gaps of the first.
    """
    dashes: list[Array] = []
    middles: list[Array] = []
    for k in range(0, len(points) - 2, 4):
        middle = points[k + 1]
        if not middles or np.linalg.norm(np.array(middles) - middle, axis=1).min() > 0.1:
            middles.append(middle)
            dashes.append(points[k : k + 3])
    return dashes


def _along(direction: Array) -> Array:
    """Return quaternions (..., 4) whose z axis is a unit direction (..., 3)."""
    return quat_from_xz(perpendicular(direction), direction)
